// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

import {Pane} from './pane.js';
import {along, dot, kLetters, middleOf, minus} from './vectors.js';

/** @typedef {import('./types.js').Vector} Vector */
/** @typedef {import('./pane.js').Point} Point */
/** @typedef {import('./main.js').View} View */

/** The pane with a picture of the volume, which the program makes. */
export class VolumePane extends Pane {
  /**
   * @param {HTMLElement} element
   * @param {View} view
   */
  constructor(element, view) {
    super(element, view.connection);
    this.view = view;
    this.camera = {angle: 20, elevation: 10, zoom: 1};
    /** @type {Vector | null} */
    this.target = null;
  }

  reset() {
    this.camera = {angle: 20, elevation: 10, zoom: 1};
    this.target = null;
    this.turned();
  }

  turned() {
    this.connection.ask('turn', this.target ? {...this.camera, target: this.target} : this.camera);
  }

  /**
   * @param {number} right  degrees
   * @param {number} up     degrees
   */
  turnBy(right, up) {
    this.camera.angle = (this.camera.angle - right + 720) % 360;
    this.camera.elevation = Math.min(90, Math.max(-90, this.camera.elevation + up));
    this.turned();
  }

  /** @param {number} by */
  zoomBy(by) {
    this.camera.zoom = Math.min(50, Math.max(0.1, this.camera.zoom * by));
    this.turned();
  }

  /**
   * @param {number} x
   * @param {number} y
   */
  panBy(x, y) {
    const plane = this.about?.plane;
    if (!plane) return;
    const from = this.target ?? plane.middle;
    const way = this.way({x: 0, y: 0}, {x, y});
    this.target = minus(from, way);
    this.turned();
  }

  /** mm that a CSS pixel has. */
  get mm() {
    const about = this.about;
    return about?.plane ? (about.plane.pixel * about.width) / Math.max(1, this.width) : 1;
  }

  /**
   * The direction of a drag, parallel to the screen.
   * @param {Point} from
   * @param {Point} to
   * @returns {Vector}
   */
  way(from, to) {
    const plane = this.about?.plane;
    if (!plane) return [0, 0, 0];
    return along(along([0, 0, 0], (to.x - from.x) * this.mm, plane.right), (to.y - from.y) * this.mm, plane.down);
  }

  /** The direction into the picture. */
  get normal() {
    return this.about?.plane?.forward ?? /** @type {Vector} */ ([0, 1, 0]);
  }

  /**
   * Where a place is seen.
   * @param {Vector} at
   * @returns {Point}
   */
  pointAt(at) {
    const plane = this.about?.plane;
    if (!plane) return {x: 0, y: 0};
    const from = minus(at, plane.middle);
    return {x: this.width / 2 + dot(from, plane.right) / this.mm, y: this.height / 2 + dot(from, plane.down) / this.mm};
  }

  /**
   * A point as a share of the picture, by which the program finds what is seen there.
   * @param {Point} point
   * @returns {[number, number]}
   */
  shareOf(point) {
    const share = (/** @type {number} */ value) => Math.min(1, Math.max(0, value));
    return [share(point.x / this.width), share(point.y / this.height)];
  }

  /** @param {CanvasRenderingContext2D} context */
  draw(context) {
    if (this.image) {
      context.imageSmoothingQuality = 'high';
      context.drawImage(this.image, 0, 0, this.width, this.height);
    }
    const plane = this.about?.plane;
    this.drawText(context, 'Volume', 10, 8);
    if (!plane) return;
    this.drawText(context, this.letters(plane.right, -1), 10, this.height / 2, 'left', 'middle');
    this.drawText(context, this.letters(plane.right, 1), this.width - 10, this.height / 2, 'right', 'middle');
    this.drawText(context, this.letters(plane.down, -1), this.width / 2, 8, 'center');
    this.drawText(context, this.letters(plane.down, 1), this.width - 10, this.height - 8, 'right', 'bottom');
    this.drawBar(context, 1 / this.mm);
    const {hand, state} = this.view;
    if (state?.ball) {
      this.drawCircle(context, this.pointAt(middleOf(state.ball)), state.ball[3] / this.mm, true);
    }
    for (const pin of state?.pins ?? []) this.drawPin(context, this.pointAt(middleOf(pin)), pin[3] / this.mm);
    if (hand.at) this.drawCircle(context, this.pointAt(hand.at), hand.radius / this.mm, true);
    else if (hand.point && hand.pane === this && hand.takes) this.drawCircle(context, hand.point, hand.radius / this.mm, false);
    if (hand.line && hand.pane === this) this.drawLine(context, hand.line, hand.isClosed);
  }

  /**
   * The patient direction of a side: two letters where it lies between two.
   * @param {Vector} direction
   * @param {number} sign
   */
  letters(direction, sign) {
    const axes = [0, 1, 2].filter((axis) => Math.abs(direction[axis]) > 0.38);
    axes.sort((a, b) => Math.abs(direction[b]) - Math.abs(direction[a]));
    return axes.slice(0, 2).map((axis) => kLetters[axis][direction[axis] * sign > 0 ? 1 : 0]).join('');
  }
}
