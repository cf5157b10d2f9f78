// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

import {kMarks, Pane} from './pane.js';
import {dot, length, middleOf, pixelOf, placeOf} from './vectors.js';

/** @typedef {import('./types.js').Vector} Vector */
/** @typedef {import('./types.js').SliceName} SliceName */
/** @typedef {import('./pane.js').Point} Point */
/** @typedef {import('./main.js').View} View */

const kMostZoom = 40;

/** A pane with slices: a pixel of the picture is a voxel, in its proportions in mm. */
export class SlicePane extends Pane {
  /**
   * @param {HTMLElement} element
   * @param {View} view
   */
  constructor(element, view) {
    super(element, view.connection);
    this.view = view;
    this.zoom = 1;
    /** @type {Point} */
    this.pan = {x: 0, y: 0};  // of the middle, CSS pixels
  }

  get slice() {
    return /** @type {SliceName} */ (this.name);
  }

  get plane() {
    return this.view.about?.panes[this.slice] ?? null;
  }

  reset() {
    this.zoom = 1;
    this.pan = {x: 0, y: 0};
    this.redraw();
  }

  /** Where the picture lies in the pane, and how large a pixel of it is. */
  get place() {
    const plane = this.plane;
    if (!plane) return null;
    const mm = {x: length(plane.right), y: length(plane.down)};
    const wide = plane.width * mm.x;
    const high = plane.height * mm.y;
    const pixelsPerMm = Math.min(this.width / wide, this.height / high) * this.zoom;
    return {
      pixelsPerMm,
      left: (this.width - wide * pixelsPerMm) / 2 + this.pan.x,
      top: (this.height - high * pixelsPerMm) / 2 + this.pan.y,
      x: mm.x * pixelsPerMm,
      y: mm.y * pixelsPerMm,
    };
  }

  /** The number of the slice through the place that all slices go through. */
  get voxel() {
    const plane = this.plane;
    if (!plane) return 0;
    return Math.min(plane.slices - 1, Math.max(0, Math.round(pixelOf(plane, this.view.cursor).voxel)));
  }

  /**
   * The place in the patient under a point of the pane.
   * @param {Point} point
   * @returns {Vector | null}
   */
  placeAt(point) {
    const place = this.place;
    if (!place || !this.plane) return null;
    return placeOf(this.plane, (point.x - place.left) / place.x - 0.5, (point.y - place.top) / place.y - 0.5, this.voxel);
  }

  /**
   * Where a place in the patient is seen, as if it lay in the slice.
   * @param {Vector} at
   * @returns {Point}
   */
  pointAt(at) {
    const place = this.place;
    if (!place || !this.plane) return {x: 0, y: 0};
    const pixel = pixelOf(this.plane, at);
    return {x: place.left + (pixel.x + 0.5) * place.x, y: place.top + (pixel.y + 0.5) * place.y};
  }

  /** @param {Point} point */
  isInside(point) {
    const place = this.place;
    if (!place || !this.plane) return false;
    const x = (point.x - place.left) / place.x;
    const y = (point.y - place.top) / place.y;
    return x >= 0 && y >= 0 && x < this.plane.width && y < this.plane.height;
  }

  /**
   * How far a place lies in front of the slice, mm.
   * @param {Vector} at
   */
  heightOver(at) {
    if (!this.plane) return 0;
    return (pixelOf(this.plane, at).voxel - this.voxel) * length(this.plane.next);
  }

  /** The direction into the slice. */
  get normal() {
    return this.plane ? this.plane.next : /** @type {Vector} */ ([0, 0, 1]);
  }

  /**
   * The direction of a drag on the screen.
   * @param {Point} from
   * @param {Point} to
   * @returns {Vector}
   */
  way(from, to) {
    const a = this.placeAt(from);
    const b = this.placeAt(to);
    return a && b ? [b[0] - a[0], b[1] - a[1], b[2] - a[2]] : [0, 0, 0];
  }

  /**
   * Enlarges the picture around a point, which stays where it is.
   * @param {number} by
   * @param {Point} [around]
   */
  zoomBy(by, around = {x: this.width / 2, y: this.height / 2}) {
    const zoom = Math.min(kMostZoom, Math.max(0.2, this.zoom * by));
    const ratio = zoom / this.zoom;
    for (const axis of /** @type {const} */ (['x', 'y'])) {
      const middle = (axis === 'x' ? this.width : this.height) / 2 + this.pan[axis];
      this.pan[axis] += (around[axis] - middle) * (1 - ratio);
    }
    this.zoom = zoom;
    this.redraw();
  }

  /**
   * @param {number} x
   * @param {number} y
   */
  panBy(x, y) {
    this.pan = {x: this.pan.x + x, y: this.pan.y + y};
    this.redraw();
  }

  /**
   * Goes through the slices. Towards the head, the back and the left is forward.
   * @param {number} count
   */
  goBy(count) {
    const plane = this.plane;
    if (!plane) return;
    const pixel = pixelOf(plane, this.view.cursor);
    const towards = dot(plane.next, [1, 1, 1]) < 0 ? -count : count;
    const voxel = Math.min(plane.slices - 1, Math.max(0, Math.round(pixel.voxel) + towards));
    this.view.look(placeOf(plane, pixel.x, pixel.y, voxel));
  }

  /**
   * Moves the crosshair within the slice.
   * @param {number} x
   * @param {number} y
   */
  stepBy(x, y) {
    if (!this.plane) return;
    const pixel = pixelOf(this.plane, this.view.cursor);
    const inside = (/** @type {number} */ value, /** @type {number} */ count) =>
        Math.min(count - 1, Math.max(0, Math.round(value)));
    this.view.look(
      placeOf(this.plane, inside(pixel.x + x, this.plane.width), inside(pixel.y + y, this.plane.height), this.voxel)
    );
  }

  /** @param {CanvasRenderingContext2D} context */
  draw(context) {
    const place = this.place;
    const plane = this.plane;
    if (!place || !plane) return;
    if (this.image) {
      context.imageSmoothingEnabled = Math.max(place.x, place.y) < 4;  // pixels are seen when they are large
      context.imageSmoothingQuality = 'high';
      context.drawImage(this.image, place.left, place.top, plane.width * place.x, plane.height * place.y);
    }
    this.drawCross(context);
    this.drawHand(context, place.pixelsPerMm);
    this.drawWords(context);
    this.drawBar(context, place.pixelsPerMm);
  }

  /**
   * The lines in which the other two slices meet this one.
   * @param {CanvasRenderingContext2D} context
   */
  drawCross(context) {
    if (!this.view.marks) return;
    const at = this.pointAt(this.view.cursor);
    const gap = 8;
    const others = {axial: ['sagittal', 'coronal'], coronal: ['sagittal', 'axial'], sagittal: ['coronal', 'axial']};
    const [upright, level] = /** @type {SliceName[]} */ (others[this.slice]);
    context.lineWidth = 1;
    context.strokeStyle = kMarks.cross[upright];
    context.beginPath();
    context.moveTo(at.x, 0);
    context.lineTo(at.x, at.y - gap);
    context.moveTo(at.x, at.y + gap);
    context.lineTo(at.x, this.height);
    context.stroke();
    context.strokeStyle = kMarks.cross[level];
    context.beginPath();
    context.moveTo(0, at.y);
    context.lineTo(at.x - gap, at.y);
    context.moveTo(at.x + gap, at.y);
    context.lineTo(this.width, at.y);
    context.stroke();
  }

  /**
   * What the hand holds or would take, the ball, and the line of a cut.
   * @param {CanvasRenderingContext2D} context
   * @param {number} pixelsPerMm
   */
  drawHand(context, pixelsPerMm) {
    const {hand, state} = this.view;
    const circle = (/** @type {Vector} */ at, /** @type {number} */ radius, /** @type {boolean} */ isFull) => {
      const over = Math.abs(this.heightOver(at));
      if (over >= radius) return;
      this.drawCircle(context, this.pointAt(at), Math.sqrt(radius * radius - over * over) * pixelsPerMm, isFull);
    };
    if (state?.ball) circle(middleOf(state.ball), state.ball[3], true);
    for (const pin of state?.pins ?? []) {
      const over = Math.abs(this.heightOver(middleOf(pin)));
      if (over < pin[3]) this.drawPin(context, this.pointAt(middleOf(pin)), Math.sqrt(pin[3] ** 2 - over ** 2) * pixelsPerMm);
    }
    if (hand.at) circle(hand.at, hand.radius, true);
    else if (hand.hover && hand.takes) circle(hand.hover, hand.radius, false);
    if (hand.line && hand.pane === this) this.drawLine(context, hand.line, hand.isClosed);
  }

  /** @param {CanvasRenderingContext2D} context */
  drawWords(context) {
    const plane = this.plane;
    if (!plane) return;
    const title = this.slice[0].toUpperCase() + this.slice.slice(1);
    this.drawText(context, `${title}  ${this.voxel + 1} / ${plane.slices}`, 10, 8);
    const [left, right, up, down] = plane.letters;
    this.drawText(context, left, 10, this.height / 2, 'left', 'middle');
    this.drawText(context, right, this.width - 10, this.height / 2, 'right', 'middle');
    this.drawText(context, up, this.width / 2, 8, 'center');
    this.drawText(context, down, this.width - 10, this.height - 8, 'right', 'bottom');
  }
}
