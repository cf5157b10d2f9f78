// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Mouse, pen and fingers on a pane, with the habits of viewers of medical images.

import {SlicePane} from './slice_pane.js';

/** @typedef {import('./pane.js').Point} Point */
/** @typedef {import('./volume_pane.js').VolumePane} VolumePane */
/** @typedef {import('./main.js').View} View */

const kTurn = 0.4;     // degrees a pixel
const kZoomDrag = 200; // pixels for e times as large
const kSwipe = 12;     // pixels of a finger for a slice

/**
 * @param {SlicePane | VolumePane} pane
 * @param {View} view
 */
export function listenTo(pane, view) {
  const element = pane.element;
  const canvas = pane.canvas;
  /** @type {Map<number, Point>} */
  const fingers = new Map();
  /** @type {'tool' | 'look' | 'levels' | 'turn' | 'pan' | 'zoom' | 'swipe' | null} */
  let drag = null;
  let start = {x: 0, y: 0};
  let last = {x: 0, y: 0};
  let wheel = 0;

  /** @param {PointerEvent} event */
  function kindOf(event) {
    if (event.button === 2) return 'zoom';
    if (event.button === 1 || (event.button === 0 && event.shiftKey)) return 'pan';
    const tool = view.hand.tool;
    if (tool === 'levels') return 'levels';
    if (tool !== 'look') return 'tool';
    if (!(pane instanceof SlicePane)) return 'turn';
    return event.pointerType === 'touch' ? 'swipe' : 'look';
  }

  /** @param {Point} point */
  function lookAt(point) {
    const at = pane instanceof SlicePane && pane.isInside(point) ? pane.placeAt(point) : null;
    if (at) view.look(at);
  }

  canvas.addEventListener('pointerdown', (event) => {
    element.focus();
    canvas.setPointerCapture(event.pointerId);
    const point = pane.pointOf(event);
    fingers.set(event.pointerId, point);
    if (fingers.size === 2) {
      if (drag === 'tool') view.hand.end();
      drag = null;  // two fingers pinch and pan
      return;
    }
    if (fingers.size > 2) return;
    start = last = point;
    drag = kindOf(event);
    if (drag === 'tool') view.hand.begin(pane, point);
    if (drag === 'look') lookAt(point);
    view.redraw();
    event.preventDefault();
  });

  canvas.addEventListener('pointermove', (event) => {
    const point = pane.pointOf(event);
    view.hover(pane, point);
    if (fingers.size === 2 && fingers.has(event.pointerId)) {
      pinch(event.pointerId, point);
      return;
    }
    if (!drag || !fingers.has(event.pointerId)) return;
    fingers.set(event.pointerId, point);
    const x = point.x - last.x;
    const y = point.y - last.y;
    if (drag === 'swipe') {
      const slices = Math.trunc((last.y - point.y) / kSwipe);
      if (slices === 0) return;
      if (pane instanceof SlicePane) pane.goBy(slices);
      last = {x: point.x, y: last.y - slices * kSwipe};
      return;
    }
    last = point;
    if (drag === 'tool') view.hand.drag(pane, start, point);
    if (drag === 'look') lookAt(point);
    if (drag === 'levels') view.levelsBy(x, y);
    if (drag === 'pan') pane.panBy(x, y);
    if (drag === 'zoom') pane.zoomBy(Math.exp(-y / kZoomDrag), start);
    if (drag === 'turn' && !(pane instanceof SlicePane)) pane.turnBy(x * kTurn, y * kTurn);
    view.redraw();
  });

  /** @param {PointerEvent} event */
  function up(event) {
    fingers.delete(event.pointerId);
    if (fingers.size > 0 || !drag) return;
    if (drag === 'tool') view.hand.end();
    drag = null;
    view.redraw();
  }
  canvas.addEventListener('pointerup', up);
  canvas.addEventListener('pointercancel', up);
  canvas.addEventListener('pointerleave', () => view.hover(null, null));
  canvas.addEventListener('contextmenu', (event) => event.preventDefault());
  canvas.addEventListener('dblclick', () => view.maximise(pane));

  canvas.addEventListener('wheel', (event) => {
    event.preventDefault();
    wheel += event.deltaMode === WheelEvent.DOM_DELTA_PIXEL ? event.deltaY / 100 : event.deltaY / 3;
    const steps = Math.trunc(wheel * (event.ctrlKey || event.altKey || !(pane instanceof SlicePane) ? 4 : 1));
    if (steps === 0) return;
    wheel = 0;
    if (event.altKey) {
      view.hand.resize(1.05 ** -steps);
      view.showHand();
    } else if (event.ctrlKey || !(pane instanceof SlicePane)) {
      pane.zoomBy(1.05 ** -steps, pane.pointOf(event));
    } else {
      pane.goBy(-steps);
    }
    view.redraw();
  }, {passive: false});

  /**
   * @param {number} id
   * @param {Point} point
   */
  function pinch(id, point) {
    const [a, b] = [...fingers.entries()];
    const other = a[0] === id ? b[1] : a[1];
    const before = fingers.get(id) ?? point;
    const apart = (/** @type {Point} */ one) => Math.max(1, Math.hypot(one.x - other.x, one.y - other.y));
    pane.panBy((point.x - before.x) / 2, (point.y - before.y) / 2);
    pane.zoomBy(apart(point) / apart(before), {x: (point.x + other.x) / 2, y: (point.y + other.y) / 2});
    fingers.set(id, point);
    view.redraw();
  }
}
