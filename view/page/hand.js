// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// What the hand does with the tool that was chosen, whether by mouse, finger or key.

import {SlicePane} from './slice_pane.js';
import {along, length} from './vectors.js';

/** @typedef {import('./types.js').Vector} Vector */
/** @typedef {import('./pane.js').Point} Point */
/** @typedef {import('./volume_pane.js').VolumePane} VolumePane */
/** @typedef {import('./main.js').View} View */
/** @typedef {'look' | 'levels' | 'grab' | 'pin' | 'cut' | 'ball'} Tool */

const kLeastLine = 4;  // CSS pixels between two places of a line
const kClosing = 12;   // CSS pixels between both ends of a line that closes

export class Hand {
  /** @param {View} view */
  constructor(view) {
    this.view = view;
    /** @type {Tool} */
    this.tool = 'look';
    this.radius = 20;
    this.depth = 40;
    /**
     * What is held or touched, where it is now.
     * @type {Vector | null}
     */
    this.at = null;
    /**
     * Where the hand took it.
     * @type {Vector | null}
     */
    this.from = null;
    /** @type {Vector} */
    this.by = [0, 0, 0];
    /**
     * The place under the pointer, in a slice.
     * @type {Vector | null}
     */
    this.hover = null;
    /**
     * The point under the pointer.
     * @type {Point | null}
     */
    this.point = null;
    /** @type {SlicePane | VolumePane | null} */
    this.pane = null;
    /** @type {Point[] | null} */
    this.line = null;
    this.asked = 0;  // number of the message that took hold
  }

  /** Whether the line that is drawn comes back to where it began, as a lasso. */
  get isClosed() {
    if (!this.line || this.line.length < 4) return false;
    const [first, last] = [this.line[0], this.line[this.line.length - 1]];
    const reach = Math.max(...this.line.map((point) => Math.hypot(point.x - first.x, point.y - first.y)));
    return reach > 2 * kClosing && Math.hypot(last.x - first.x, last.y - first.y) < kClosing;
  }

  /** Whether the tool takes what lies within a radius. */
  get takes() {
    return this.tool === 'grab' || this.tool === 'pin' || this.tool === 'ball';
  }

  /** @param {Tool} tool */
  choose(tool) {
    if (this.view.about?.reel && tool !== 'look' && tool !== 'levels') {
      this.view.tell('A field that was made before is shown; hands work without it.');
      return;
    }
    if (this.at) this.end();
    this.line = null;
    this.tool = tool;
  }

  /** @param {number} factor */
  resize(factor) {
    this.radius = Math.min(200, Math.max(1, this.radius * factor));
  }

  /**
   * A point as the program is told of it.
   * @param {SlicePane | VolumePane} pane
   * @param {Point} point
   */
  pointed(pane, point) {
    return pane instanceof SlicePane ? {at: pane.placeAt(point)} : {pixel: pane.shareOf(point)};
  }

  /**
   * The tool begins to work at a point.
   * @param {SlicePane | VolumePane} pane
   * @param {Point} point
   */
  begin(pane, point) {
    this.pane = pane;
    if (this.tool === 'cut') {
      this.line = [point];
      return;
    }
    const where = this.pointed(pane, point);
    if (pane instanceof SlicePane && !pane.isInside(point)) return;
    this.beginAt(where);
  }

  /** @param {{at?: Vector | null, pixel?: [number, number]}} where */
  beginAt(where) {
    const word = this.tool === 'grab' ? 'grip' : this.tool;
    this.by = [0, 0, 0];
    this.from = where.at ?? null;
    if (this.tool !== 'pin') this.at = this.from;
    this.asked = this.view.connection.ask(word, {...where, radius: this.radius});
  }

  /**
   * @param {SlicePane | VolumePane} pane
   * @param {Point} start  where the drag began
   * @param {Point} point
   */
  drag(pane, start, point) {
    if (this.line) {
      const last = this.line[this.line.length - 1];
      if (Math.hypot(point.x - last.x, point.y - last.y) >= kLeastLine && this.line.length < 400) this.line.push(point);
      return;
    }
    this.moveTo(pane.way(start, point));
  }

  /**
   * Moves what is held.
   * @param {Vector} by  from where it was taken, mm
   */
  moveTo(by) {
    if (!this.asked || this.tool === 'pin') return;
    this.by = by;
    if (!this.from) return;  // in the volume the program first says what was seen
    this.at = along(this.from, 1, by);
    if (this.tool === 'grab') this.view.connection.ask('move', {by});
    if (this.tool === 'ball') this.view.connection.ask('ball', {at: this.at, radius: this.radius});
  }

  /**
   * The program says where that lies which was pointed to.
   * @param {number} number
   * @param {Vector} at
   */
  held(number, at) {
    if (number !== this.asked || this.tool === 'pin' || this.from) return;
    this.from = at;
    this.moveTo(this.by);
  }

  /**
   * Something could not be done.
   * @param {number} number
   */
  failed(number) {
    if (number !== this.asked) return;
    this.at = this.from = null;
    this.asked = 0;
  }

  /** The tool has done its work at this place. */
  end() {
    if (this.line) {
      this.cut();
      return;
    }
    if (this.tool === 'grab' && this.asked) this.view.connection.ask('release');
    this.at = this.from = null;
    this.asked = 0;
  }

  cut() {
    const {line, pane, isClosed} = this;
    this.line = null;
    if (!line || !pane || line.length < 2) return;
    if (isClosed) line.pop();  // it lies where the first one does
    const normal = pane.normal;
    const unit = along([0, 0, 0], 1 / length(normal), normal);
    const common = {along: unit, depth: this.depth, centred: pane instanceof SlicePane, closed: isClosed};
    this.asked =
        pane instanceof SlicePane
            ? this.view.connection.ask('cut', {path: line.map((point) => pane.placeAt(point)), ...common})
            : this.view.connection.ask('cut', {pixels: line.map((point) => pane.shareOf(point)), ...common});
  }
}
