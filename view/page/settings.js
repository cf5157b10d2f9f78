// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Buttons, sliders and lists around the panes.

import {element} from './dom.js';
import {shown} from './vectors.js';

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
    /** @type {HTMLFormElement} */ (element('save-form')).onsubmit = (event) => {
      const button = /** @type {HTMLButtonElement} */ (event.submitter);
      if (button?.value === 'save') ask('save', {name: input('save-name').value, volume: list('save-volume').value});
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
    fill(list('save-volume'), [['', 'none'], ...about.volumes.map((kind) => /** @type {[string, string]} */ ([kind, kind === 'dicom' ? 'DICOM series' : kind]))]);
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
    enable('play', !state.plays);
    enable('save', state.frames > 0 && !state.plays);
    enable('unpin', state.pins > 0);
    enable('lift', state.ball !== null);
    element('held').textContent =
        `${state.frames} frames${state.pins ? `, ${state.pins} pins` : ''}${state.ball ? ', a ball' : ''}`;
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
    badge.textContent = quality === null ? (state.moving ? 'moving' : '\u2026') : bad ? 'It folds' : 'No folds';
    badge.className = quality === null ? '' : bad ? 'bad' : 'good';
    element('fold').hidden = state.fold === null;
    const rows = [
      ['Folded tetrahedra', quality ? String(quality.inverted + quality.degenerate) : '\u2026'],
      ['Least Jacobian', quality ? shown(quality.jacobian, 3) : '\u2026'],
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
    if (this.view.state && this.view.state.frames > 0) dialog('save-dialog').showModal();
    else this.view.tell('Nothing has been done yet that could be saved.');
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
