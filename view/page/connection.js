// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// The line to the program: says what is wanted, and hands on what comes.

/** @typedef {import('./types.js').PictureAbout} PictureAbout */

const kRetryMs = 1000;

/** In a frame nothing is kept: the token works once, and browsers may give frames no storage. */
const kIsFramed = window.parent !== window;

/**
 * The secret that the address had. It is taken out of the address, so that no history and no copied link holds it, and
 * kept for as long as this tab lives.
 */
function takeToken() {
  const given = location.hash.slice(1);
  if (given) history.replaceState(null, '', location.pathname);
  if (kIsFramed) return given;
  if (given) sessionStorage.setItem('token', given);
  return sessionStorage.getItem('token') ?? '';
}

/**
 * @typedef {object} Ears
 * @property {(message: any) => void} heard           a message of the program
 * @property {(about: PictureAbout, file: Blob) => void} seen
 * @property {(why: string, canTake: boolean) => void} lost  the line is down; `canTake`: another page has it
 * @property {() => void} open
 */

export class Connection {
  /** @param {Ears} ears */
  constructor(ears) {
    this.ears = ears;
    this.token = takeToken();
    /** @type {WebSocket | null} */
    this.socket = null;
    this.number = 0;
    this.seen = 0;  // number of the last message that may change what is seen
    this.takes = false;
    this.farewell = '';
    this.bytes = 0;
    this.open();
  }

  open() {
    this.farewell = '';
    const socket = new WebSocket(`ws://${location.host}/talk`);
    socket.binaryType = 'arraybuffer';
    socket.onopen = () => {
      socket.send(JSON.stringify({do: 'hello', token: this.token, take: this.takes}));
    };
    socket.onmessage = (event) => {
      if (this.socket === socket) this.hear(event.data);
    };
    socket.onclose = () => {
      if (this.socket === socket) this.closed();
    };
    this.socket = socket;
  }

  /** @param {string | ArrayBuffer} data */
  hear(data) {
    if (typeof data !== 'string') {
      this.bytes += data.byteLength;
      const length = new DataView(data).getUint32(0, true);
      const about = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
      const type = about.exact ? 'image/png' : 'image/jpeg';
      this.ears.seen(about, new Blob([new Uint8Array(data, 4 + length)], {type}));
      return;
    }
    const message = JSON.parse(data);
    if (message.say === 'bye') {
      this.farewell = message.text;
      return;
    }
    if (message.say === 'secret') {  // the token is used up; this one is kept in memory alone
      this.token = message.secret;
      if (!kIsFramed) sessionStorage.removeItem('token');
      return;
    }
    if (message.say === 'about') {
      this.takes = true;  // after a lost connection this page goes on
      this.ears.open();
    }
    this.ears.heard(message);
  }

  closed() {
    this.socket = null;
    if (this.farewell) {
      this.takes = true;
      this.ears.lost(this.farewell, this.farewell.startsWith('another page'));
      return;
    }
    this.ears.lost('The connection to the program is lost. Trying again \u2026', false);
    setTimeout(() => this.open(), kRetryMs);
  }

  /**
   * @param {string} what
   * @param {object} [keys]
   * @returns {number}  of the message; answers and pictures name it
   */
  ask(what, keys = {}) {
    if (this.socket?.readyState !== WebSocket.OPEN) return 0;
    ++this.number;
    if (what !== 'probe' && what !== 'save' && what !== 'shown') this.seen = this.number;
    this.socket.send(JSON.stringify({do: what, n: this.number, ...keys}));
    return this.number;
  }
}
