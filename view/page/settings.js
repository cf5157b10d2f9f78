// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Buttons, sliders and lists around the panes.

import {element} from './dom.js';
import {counted, shown} from './vectors.js';

/** @typedef {import('./types.js').About} About */
/** @typedef {import('./types.js').State} State */
/** @typedef {import('./main.js').View} View */

/**
 * Windows of grey levels for CT, width and level in HU.
 * @type {Record<string, [number, number]>}
 */
const kPresets = {
  lung: [1500, -600],
  bone: [1800, 400],
  'soft tissue': [400, 40],
  brain: [80, 40],
  liver: [150, 60],
};

/**
 * What may lie over slices, and what it is called.
 * @type {[string, string][]}
 */
const kOverlays = [
  ['', 'none'], ['lattice', 'lattice'], ['jacobian', 'Jacobian'], ['folds', 'folds'], ['coverage', 'coverage'],
  ['labels', 'labels'], ['contours', 'contours'],
];
const kOfTetrahedra = ['lattice', 'jacobian', 'folds'];
const kOfLabels = ['labels', 'contours'];

/**
 * Overlays that there are for what is shown.
 * @param {About} about
 */
function overlaysFor(about) {
  return kOverlays.filter(([name]) =>
      (about.labels || !kOfLabels.includes(name)) && (!about.pulls || !kOfTetrahedra.includes(name)));
}

/**
 * The numbers of a tissue, least and most.
 * @type {[keyof import('./types.js').Tissue, number, number][]}
 */
const kTissueNumbers = [['stiffness', 1e-6, 1e9], ['compression', 0, 1], ['stretch', 0, 100], ['shear', 0, 100]];

/**
 * @param {string} id
 * @returns {HTMLSelectElement}
 */
function list(id) {
  return /** @type {HTMLSelectElement} */ (element(id));
}

/**
 * @param {string} id
 * @returns {HTMLInputElement}
 */
function input(id) {
  return /** @type {HTMLInputElement} */ (element(id));
}

/**
 * @param {string} id
 * @returns {HTMLDialogElement}
 */
function dialog(id) {
  return /** @type {HTMLDialogElement} */ (element(id));
}

/**
 * Fills a list with options.
 * @param {HTMLSelectElement} where
 * @param {[string, string][]} options  value and text
 */
function fill(where, options) {
  where.replaceChildren(...options.map(([value, text]) => new Option(text, value)));
}

export class Settings {
  /** @param {View} view */
  constructor(view) {
    this.view = view;
    /** The cuts as they are listed now. */
    this.listed = '';
    const ask = view.connection.ask.bind(view.connection);
    for (const button of this.tools) {
      button.onclick = () => view.choose(/** @type {any} */ (button.dataset.tool));
    }
    element('undo').onclick = () => ask('undo');
    element('redo').onclick = () => ask('redo');
    element('reset').onclick = () => ask('reset');
    element('play').onclick = () => ask('play');
    element('save').onclick = () => this.openSave();
    element('help').onclick = () => view.openHelp();
    element('unpin').onclick = () => ask('unpin');
    element('lift').onclick = () => ask('lift');
    element('fold').onclick = () => view.lookAtFold();
    element('banner-button').onclick = () => view.connection.open();
    input('radius').oninput = () => {
      view.hand.radius = Number(input('radius').value);
      view.showHand();
    };
    input('depth').oninput = () => {
      view.hand.depth = Number(input('depth').value);
      this.showHand();
    };
    list('method').onchange = () => ask('use', {method: list('method').value});
    list('preset').onchange = () => this.preset(list('preset').value);
    list('style').onchange = () => ask('style', {name: list('style').value});
    list('overlay').onchange = () => ask('overlay', {kind: list('overlay').value || null});
    const compare = () => ask('compare', {show: list('show').value, share: Number(input('share').value)});
    list('show').onchange = compare;
    input('share').oninput = compare;
    input('frame').oninput = () => ask('frame', {number: Number(input('frame').value)});
    element('tissues').onclick = () => this.openTissues();
    this.onSubmit('tissues-form', 'apply', () => ask('tissues', {tissues: this.readTissues()}));
    this.onSubmit('save-form', 'save', () => ask('save', {
      name: input('save-name').value,
      volume: list('save-volume').value,
      field: input('save-field').checked,
      pictures: input('save-pictures').checked,
      film: list('save-film').value,
      of: list('save-of').value,
    }));
  }

  /**
   * @param {string} form
   * @param {string} value   of the button that does it
   * @param {() => void} what
   */
  onSubmit(form, value, what) {
    /** @type {HTMLFormElement} */ (element(form)).onsubmit = (event) => {
      if (/** @type {HTMLButtonElement} */ (event.submitter)?.value === value) what();
    };
  }

  get tools() {
    return /** @type {HTMLElement[]} */ ([...document.querySelectorAll('[data-tool]')]);
  }

  /** @param {About} about */
  fill(about) {
    element('title').textContent = about.title;
    element('backend').textContent = about.backend;
    element('save-folder').textContent = about.folder;
    fill(list('style'), about.styles.map((name) => [name, name]));
    fill(list('preset'), [['', 'own'], ...Object.keys(kPresets).map((name) => /** @type {[string, string]} */ ([name, name]))]);
    list('preset').disabled = !about.hounsfield;
    fill(list('overlay'), overlaysFor(about));
    element('reel').hidden = about.reel < 2;
    element('reel-title').textContent = about.grows ? 'The field grows' : 'Sequence';
    input('frame').max = String(Math.max(1, about.reel - 1));
    element('hand').hidden = element('history').hidden = element('save-field-label').hidden = about.reel > 0;
    element('save-what').hidden = about.reel > 0;
    for (const tool of this.tools) tool.hidden = about.reel > 0 && !['look', 'levels'].includes(tool.dataset.tool ?? '');
    const kinds = (/** @type {string[]} */ names) => /** @type {[string, string][]} */ (
      [['', 'none'], ...names.map((name) => [name, name === 'dicom' ? 'DICOM series' : name])]);
    fill(list('save-volume'), kinds(about.volumes));
    fill(list('save-film'), kinds(about.films));
    element('save-film-part').hidden = about.films.length === 0;
    this.showTool();
    this.showHand();
  }

  showTool() {
    for (const button of this.tools) {
      button.setAttribute('aria-pressed', String(button.dataset.tool === this.view.hand.tool));
    }
  }

  showHand() {
    const {radius, depth} = this.view.hand;
    input('radius').value = String(radius);
    element('radius-mm').textContent = `${shown(radius, radius < 10 ? 1 : 0)} mm`;
    input('depth').value = String(depth);
    element('depth-mm').textContent = `${shown(depth, 0)} mm`;
  }

  /** @param {State} state */
  show(state) {
    /**
     * @param {string} id
     * @param {boolean} can
     */
    const enable = (id, can) => (/** @type {HTMLButtonElement} */ (element(id)).disabled = !can);
    enable('undo', state.undo);
    enable('redo', state.redo);
    enable('reset', state.undo);
    element('play').hidden = !state.playable;
    const isReel = (this.view.about?.reel ?? 0) > 0;
    enable('play', isReel || !state.plays);
    enable('save', isReel || !state.plays);
    input('frame').value = String(state.frame);
    element('frame-number').textContent = `${state.frame + 1} of ${this.view.about?.reel}`;
    enable('unpin', state.pins.length > 0);
    enable('lift', state.ball !== null);
    const pins = state.pins.length;
    element('held').textContent = counted(state.frames, 'frame') + (pins ? `, ${counted(pins, 'pin')}` : '') +
        (state.ball ? ', a ball' : '');
    list('method').value = state.method;
    list('show').value = state.show;
    element('share-label').hidden = state.show !== 'swipe';
    list('overlay').value = state.overlay ?? '';
    list('style').value = state.style;
    const preset = Object.entries(kPresets).find(([, [width, level]]) => width === state.width && level === state.level);
    list('preset').value = preset?.[0] ?? '';
    element('window').textContent = `width ${shown(state.width, 0)}, level ${shown(state.level, 0)}`;
    this.showCuts(state);
    this.showQuality(state);
  }

  /** @param {State} state */
  showCuts(state) {
    const now = JSON.stringify(state.cuts);
    if (now === this.listed) return;
    this.listed = now;
    element('cuts').replaceChildren(...state.cuts.map((cut) => {
      const item = document.createElement('li');
      const button = document.createElement('button');
      button.type = 'button';
      button.textContent = cut.open ? 'Suture' : 'Open';
      button.setAttribute('aria-label', `${button.textContent} ${cut.name}`);
      button.onclick = () => this.view.connection.ask(cut.open ? 'suture' : 'reopen', {name: cut.name});
      item.append(`${cut.name}, ${cut.open ? 'open' : 'closed'}`, button);
      return item;
    }));
  }

  /** @param {State} state */
  showQuality(state) {
    const badge = element('badge');
    const quality = state.quality;
    const bad = quality !== null && quality.inverted + quality.degenerate > 0;
    const known = quality !== null && quality.jacobian !== null;
    const unknown = quality !== null ? 'A pull field: folds are not known' : state.moving ? 'moving' : '\u2026';
    badge.textContent = !known ? unknown : bad ? 'It folds' : 'No folds';
    badge.className = !known ? '' : bad ? 'bad' : 'good';
    element('fold').hidden = state.fold === null;
    const rows = [
      ['Folded tetrahedra', known ? String(quality.inverted + quality.degenerate) : '\u2026'],
      ['Least Jacobian', quality?.jacobian != null ? shown(quality.jacobian, 3) : '\u2026'],
      ['Coverage', quality ? `${shown(quality.coverage * 100, 2)} %` : '\u2026'],
    ];
    element('quality').replaceChildren(...rows.flatMap(([name, value]) => {
      const term = document.createElement('dt');
      term.textContent = name;
      const detail = document.createElement('dd');
      detail.textContent = value;
      return [term, detail];
    }));
  }

  /** @param {string} name */
  preset(name) {
    const found = kPresets[name];
    if (found) this.view.levels(...found);
  }

  openSave() {
    dialog('save-dialog').showModal();
  }

  openTissues() {
    element('tissue-rows').replaceChildren(...(this.view.state?.tissues ?? []).map((tissue) => {
      const row = document.createElement('tr');
      const head = document.createElement('th');
      head.scope = 'row';
      head.textContent = tissue.name;
      row.append(head, ...kTissueNumbers.map(([key, least, most]) => {
        const cell = document.createElement('td');
        const number = document.createElement('input');
        Object.assign(number, {type: 'number', required: true, min: least, max: most, step: 'any', value: tissue[key]});
        number.setAttribute('aria-label', `${tissue.name}, ${key}`);
        cell.append(number);
        return cell;
      }));
      return row;
    }));
    dialog('tissues-dialog').showModal();
  }

  /** @returns {object[]} */
  readTissues() {
    return [...element('tissue-rows').children].map((row) => {
      const numbers = [...row.querySelectorAll('input')].map((one) => Number(one.value));
      return Object.fromEntries([
        ['name', row.children[0].textContent],
        ...kTissueNumbers.map(([key], n) => [key, numbers[n]]),
      ]);
    });
  }

  /** What the next overlay is, of those that there are. */
  nextOverlay() {
    const names = [...list('overlay').options].map((option) => option.value);
    return names[(names.indexOf(list('overlay').value) + 1) % names.length] || null;
  }

  /** @param {{files: string[], command: string}} message */
  saved({files, command}) {
    this.view.tell(`Saved ${files.join(', ')}`);
    element('saved-files').replaceChildren(...files.map((file) => {
      const item = document.createElement('li');
      item.textContent = file;
      return item;
    }));
    element('saved-command').textContent = command;
    dialog('saved-dialog').showModal();
  }
}
