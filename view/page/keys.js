// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// All keys. The table is what `?` shows, too.

import {SlicePane} from './slice_pane.js';

/** @typedef {import('./types.js').Vector} Vector */
/** @typedef {import('./volume_pane.js').VolumePane} VolumePane */
/** @typedef {import('./main.js').View} View */

const kHandStep = 2;   // mm
const kTurnStep = 5;   // degrees

/** @type {[string, string, (view: View) => void][]}  key, what it does, and how */
export const kKeys = [
  ['v', 'Look: move the crosshair, turn the volume', (view) => view.choose('look')],
  ['w', 'Window: drag to change width and level', (view) => view.choose('levels')],
  ['g', 'Grab tissue and pull', (view) => view.choose('grab')],
  ['p', 'Pin tissue in place', (view) => view.choose('pin')],
  ['c', 'Cut along a line; back to its beginning: a lasso', (view) => view.choose('cut')],
  ['b', 'Push with a ball', (view) => view.choose('ball')],
  ['l', 'Lift the ball', (view) => view.connection.ask('lift')],
  ['u', 'Free all pins', (view) => view.connection.ask('unpin')],
  ['[', 'Smaller radius', (view) => view.resize(1 / 1.1)],
  [']', 'Larger radius', (view) => view.resize(1.1)],
  ['1', 'Window for lung', (view) => view.preset('lung')],
  ['2', 'Window for bone', (view) => view.preset('bone')],
  ['3', 'Window for soft tissue', (view) => view.preset('soft tissue')],
  ['4', 'Window for brain', (view) => view.preset('brain')],
  ['5', 'Window for liver', (view) => view.preset('liver')],
  ['o', 'Next overlay', (view) => view.nextOverlay()],
  ['x', 'Before and after side by side: swipe', (view) => view.compare('swipe')],
  ['d', 'Difference', (view) => view.compare('difference')],
  ['t', 'Before, or after again: blink', (view) => view.compare('before')],
  ['m', 'Show or hide the crosshair', (view) => view.toggleMarks()],
  ['f', 'Jump to a fold', (view) => view.lookAtFold()],
  [' ', 'Play the scenario or the field', (view) => view.play()],
  ['r', 'Reset zoom and views', (view) => view.resetViews()],
  ['s', 'Save', (view) => view.openSave()],
  ['?', 'All keys', (view) => view.openHelp()],
];

/**
 * Keys that `?` lists beside the others.
 * @type {[string, string][]}
 */
export const kMoreKeys = [
  ['Ctrl+Z', 'Undo'],
  ['Ctrl+Y', 'Redo'],
  ['Tab', 'Next pane or button'],
  ['Arrows', 'Move the crosshair, turn the volume, or move what is held'],
  ['Page Up, Page Down', 'Next slices'],
  ['+, \u2212', 'Zoom'],
  ['Enter', 'Use the tool at the crosshair; again: let go'],
  ['Shift+Enter', 'Finish a cut'],
  ['Escape', 'Let go, forget a line, show all panes'],
  ['Wheel', 'Slices; zoom in the volume'],
  ['Ctrl+wheel, right drag', 'Zoom'],
  ['Alt+wheel', 'Radius of the tool'],
  ['Middle or Shift+left drag', 'Pan'],
  ['Double click', 'One pane, or all'],
];

/** @param {View} view */
export function listenToKeys(view) {
  document.addEventListener('keydown', (event) => {
    const target = /** @type {HTMLElement} */ (event.target);
    if (target.closest('input, select, textarea, dialog')) return;
    if ((event.ctrlKey || event.metaKey) && !event.altKey) {
      const key = event.key.toLowerCase();
      if (key !== 'z' && key !== 'y') return;
      view.connection.ask(key === 'y' || event.shiftKey ? 'redo' : 'undo');
      event.preventDefault();
      return;
    }
    if (event.altKey || event.metaKey || event.ctrlKey) return;
    const isHandled = paneKey(view, event) || plainKey(view, event);
    if (isHandled) event.preventDefault();
  });
}

/**
 * @param {View} view
 * @param {KeyboardEvent} event
 */
function plainKey(view, event) {
  if (event.key === 'Escape') {
    view.escape();
    return true;
  }
  const found = kKeys.find(([key]) => key === event.key);
  if (!found) return false;
  found[2](view);
  return true;
}

/**
 * Keys that count where a pane has the focus.
 * @param {View} view
 * @param {KeyboardEvent} event
 */
function paneKey(view, event) {
  const pane = view.panes.find((one) => one.element === document.activeElement);
  if (!pane) return false;
  const arrows = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]};
  const arrow = /** @type {Record<string, number[]>} */ (arrows)[event.key];
  const times = event.shiftKey ? 10 : 1;
  if (arrow) {
    goBy(view, pane, arrow[0] * times, arrow[1] * times);
  } else if (event.key === 'PageUp' || event.key === 'PageDown') {
    if (!(pane instanceof SlicePane)) return false;
    pane.goBy((event.key === 'PageUp' ? 1 : -1) * times);
  } else if (event.key === '+' || event.key === '=') {
    pane.zoomBy(1.2);
  } else if (event.key === '-') {
    pane.zoomBy(1 / 1.2);
  } else if (event.key === 'Enter') {
    use(view, pane, event.shiftKey);
  } else {
    return false;
  }
  view.redraw();
  return true;
}

/**
 * @param {View} view
 * @param {SlicePane | VolumePane} pane
 * @param {number} x
 * @param {number} y
 */
function goBy(view, pane, x, y) {
  const {hand} = view;
  if (hand.at) {
    const mm = pane.way({x: 0, y: 0}, {x: 100, y: 0});
    const scale = (100 / Math.max(1e-6, Math.hypot(...mm))) * kHandStep;
    const way = pane.way({x: 0, y: 0}, {x: x * scale, y: y * scale});
    hand.moveTo([hand.by[0] + way[0], hand.by[1] + way[1], hand.by[2] + way[2]]);
  } else if (pane instanceof SlicePane) {
    pane.stepBy(x, y);
  } else {
    pane.turnBy(x * kTurnStep, y * kTurnStep);
  }
}

/**
 * The tool works at the crosshair.
 * @param {View} view
 * @param {SlicePane | VolumePane} pane
 * @param {boolean} isLast  whether a line ends here
 */
function use(view, pane, isLast) {
  const {hand} = view;
  if (hand.tool === 'look' || hand.tool === 'levels') return;
  if (hand.tool !== 'cut') {
    if (hand.at) hand.end();
    else hand.pane = pane, hand.beginAt({at: view.cursor});
    return;
  }
  const point = pane.pointAt(view.cursor);
  if (!hand.line || hand.pane !== pane) hand.begin(pane, point);
  else hand.line.push(point);
  if (isLast) hand.end();
}
