// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// The page: four panes, the hand, and all that stands around them.

import {Connection} from './connection.js';
import {element} from './dom.js';
import {Hand} from './hand.js';
import {kKeys, kMoreKeys, listenToKeys} from './keys.js';
import {listenTo} from './pointer.js';
import {Settings} from './settings.js';
import {SlicePane} from './slice_pane.js';
import {kLetters, shown} from './vectors.js';
import {VolumePane} from './volume_pane.js';

/** @typedef {import('./types.js').About} About */
/** @typedef {import('./types.js').State} State */
/** @typedef {import('./types.js').Vector} Vector */
/** @typedef {import('./pane.js').Point} Point */

const kMessageMs = 8000;
const kSpeedMs = 1000;

/** All that the page knows, and what may be done with it. */
export class View {
  constructor() {
    /** @type {About | null} */
    this.about = null;
    /** @type {State | null} */
    this.state = null;
    /** @type {Vector} */
    this.cursor = [0, 0, 0];
    this.marks = true;
    this.probed = true;  // whether no answer is awaited
    /** @type {Vector | null} */
    this.probes = null;  // the last place that was asked for
    this.looked = 0;  // numbers of the last messages that moved the crosshair, and changed the window
    this.levelled = 0;
    this.connection = new Connection({
      heard: (message) => this.hear(message),
      seen: (about, file) => void this.panes.find((pane) => pane.name === about.pane)?.take(about, file),
      lost: (why, canTake) => this.lose(why, canTake),
      open: () => this.greet(),
    });
    this.hand = new Hand(this);
    /** @type {(SlicePane | VolumePane)[]} */
    this.panes = [...document.querySelectorAll('.pane')].map((one) => {
      const pane = /** @type {HTMLElement} */ (one);
      return pane.dataset.pane === 'volume' ? new VolumePane(pane, this) : new SlicePane(pane, this);
    });
    for (const pane of this.panes) listenTo(pane, this);
    this.settings = new Settings(this);
    listenToKeys(this);
    this.fillHelp();
    setInterval(() => this.showSpeed(), kSpeedMs);
  }

  /** A connection is there. What the page has chosen is told again. */
  greet() {
    element('banner').hidden = true;
    for (const pane of this.panes) {
      pane.tellSize();
      if (pane instanceof VolumePane) pane.turned();
    }
  }

  /** @param {any} message */
  hear(message) {
    switch (message.say) {
      case 'about':
        this.about = message;
        this.settings.fill(message);
        break;
      case 'state':
        // What was asked for meanwhile counts more than what the program knew when it said this.
        if (message.request >= this.looked) this.cursor = message.cursor;
        if (this.state && message.request < this.levelled) {
          message.width = this.state.width;
          message.level = this.state.level;
        }
        this.state = message;
        this.settings.show(message);
        break;
      case 'held':
        this.hand.held(message.n, message.at);
        break;
      case 'value':
        this.showValue(message);
        this.probeAgain();
        break;
      case 'nothing':
        element('value').textContent = '';
        this.probeAgain();
        break;
      case 'progress':
        this.tell('Saving \u2026');
        break;
      case 'saved':
        this.settings.saved(message);
        break;
      case 'problem':
        this.hand.failed(message.n);
        this.tell(message.text, true);
        break;
    }
    this.redraw();
  }

  /**
   * @param {string} why
   * @param {boolean} canTake
   */
  lose(why, canTake) {
    element('banner').hidden = false;
    element('banner-text').textContent = why[0].toUpperCase() + why.slice(1);
    element('banner-button').hidden = !canTake;
    this.hand.at = null;
    this.probed = true;
    this.redraw();
  }

  /**
   * Says something at the lower edge, for a while.
   * @param {string} text
   * @param {boolean} [isProblem]
   */
  tell(text, isProblem = false) {
    const line = element('message');
    line.textContent = text;
    line.classList.toggle('problem', isProblem);
    clearTimeout(this.telling);
    this.telling = setTimeout(() => (line.textContent = ''), kMessageMs);
  }

  redraw() {
    for (const pane of this.panes) pane.redraw();
  }

  /**
   * All slices go through a place.
   * @param {Vector} at
   */
  look(at) {
    this.cursor = at;
    this.looked = this.connection.ask('look', {at});
    this.redraw();
  }

  lookAtFold() {
    if (this.state?.fold) this.look(this.state.fold);
  }

  /**
   * The pointer is over a place, or nowhere.
   * @param {SlicePane | VolumePane | null} pane
   * @param {Point | null} point
   */
  hover(pane, point) {
    const {hand} = this;
    if (!hand.line) hand.pane = pane;
    hand.point = point;
    const at = pane instanceof SlicePane && point && pane.isInside(point) ? pane.placeAt(point) : null;
    hand.hover = at;
    element('place').textContent = at
        ? at.map((value, axis) => `${kLetters[axis][value < 0 ? 0 : 1]} ${shown(Math.abs(value))}`).join('  ') + ' mm'
        : '\u00a0';
    if (!at) element('value').textContent = '';
    else if (this.probed) this.probe(at);
    if (hand.takes) this.redraw();
  }

  /** @param {Vector} at */
  probe(at) {
    this.probes = at;
    this.probed = this.connection.ask('probe', {at}) === 0;
  }

  /** The pointer may have gone on since the place was asked for that an answer has come for. */
  probeAgain() {
    this.probed = true;
    const at = this.hand.hover;
    if (at && at !== this.probes) this.probe(at);
  }

  /** @param {{after: number, before: number}} value */
  showValue({after, before}) {
    const unit = this.about?.hounsfield ? ' HU' : '';
    const digits = Number.isInteger(after) ? 0 : 2;
    const was = before === after ? '' : `, was ${shown(before, digits)}`;
    element('value').textContent = `${shown(after, digits)}${unit}${was}`;
  }

  /** @param {import('./hand.js').Tool} tool */
  choose(tool) {
    this.hand.choose(tool);
    this.settings.showTool();
    this.redraw();
  }

  /** @param {number} factor */
  resize(factor) {
    this.hand.resize(factor);
    this.showHand();
  }

  showHand() {
    this.settings.showHand();
    this.redraw();
  }

  /**
   * @param {number} x
   * @param {number} y
   */
  levelsBy(x, y) {
    if (!this.state) return;
    const step = Math.max(this.state.width, 1) / 300;
    this.levels(Math.max(step, this.state.width + x * step), this.state.level - y * step);
  }

  /**
   * @param {number} width
   * @param {number} level
   */
  levels(width, level) {
    if (!this.state) return;
    this.state.width = width;
    this.state.level = level;
    this.levelled = this.connection.ask('levels', {width, level});
  }

  /** @param {string} name */
  preset(name) {
    this.settings.preset(name);
  }

  nextOverlay() {
    this.connection.ask('overlay', {kind: this.settings.nextOverlay()});
  }

  /**
   * Shows it so, or the deformed volume again.
   * @param {State['show']} how
   */
  compare(how) {
    if (!this.state) return;
    this.connection.ask('compare', {show: this.state.show === how ? 'after' : how, share: this.state.share});
  }

  toggleMarks() {
    this.marks = !this.marks;
    this.redraw();
  }

  resetViews() {
    for (const pane of this.panes) pane.reset();
    if (this.about) this.look(this.about.middle);
  }

  /**
   * One pane alone, or all.
   * @param {SlicePane | VolumePane | null} pane
   */
  maximise(pane) {
    const main = element('panes');
    const is = !main.classList.contains('single') && pane !== null;
    main.classList.toggle('single', is);
    for (const one of this.panes) one.element.classList.toggle('large', is && one === pane);
  }

  escape() {
    if (this.hand.line) this.hand.line = null;
    else if (this.hand.at) this.hand.end();
    else this.maximise(null);
    this.redraw();
  }

  play() {
    if (this.state?.playable && (!this.state.plays || this.about?.reel)) this.connection.ask('play');
  }

  openSave() {
    this.settings.openSave();
  }

  openHelp() {
    /** @type {HTMLDialogElement} */ (element('help-dialog')).showModal();
  }

  fillHelp() {
    for (const [key, what] of [...kKeys, ...kMoreKeys]) {
      const row = document.createElement('tr');
      const head = document.createElement('th');
      head.scope = 'row';
      head.textContent = key === ' ' ? 'Space' : key;
      const cell = document.createElement('td');
      cell.textContent = what;
      row.append(head, cell);
      element('keys').append(row);
    }
  }

  /** Pictures and bytes of the last second. */
  showSpeed() {
    const pictures = Math.max(...this.panes.map((pane) => pane.shown));
    for (const pane of this.panes) pane.shown = 0;
    const megabytes = this.connection.bytes / 1e6;
    this.connection.bytes = 0;
    element('speed').textContent = pictures > 1 ? `${pictures} frames/s, ${shown(megabytes)} MB/s` : '';
  }
}

// For tests, and for people at the browser's console.
Object.assign(window, {tetwarp: new View()});
