// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// What slices and volume have in common: a canvas of the size of its element, the last picture, and marks over it.

/** @typedef {import('./types.js').PictureAbout} PictureAbout */
/** @typedef {import('./types.js').Vector} Vector */
/** @typedef {import('./connection.js').Connection} Connection */

/** @typedef {{x: number, y: number}} Point  in CSS pixels of a pane, from its left upper corner */

export const kMarks = {
  cross: {axial: '#ff6b6b', coronal: '#5ad469', sagittal: '#ffd43b'},
  hand: '#ffa94d',
  pin: '#66d9e8',
  text: '#e9ecef',
  faint: '#adb5bd',
};

export class Pane {
  /**
   * @param {HTMLElement} element
   * @param {Connection} connection
   */
  constructor(element, connection) {
    this.element = element;
    this.connection = connection;
    this.name = /** @type {import('./types.js').SliceName | 'volume'} */ (element.dataset.pane);
    this.canvas = /** @type {HTMLCanvasElement} */ (element.querySelector('canvas'));
    this.context = /** @type {CanvasRenderingContext2D} */ (this.canvas.getContext('2d', {alpha: false}));
    /** @type {ImageBitmap | null} */
    this.image = null;
    /** @type {PictureAbout | null} */
    this.about = null;
    this.isDrawn = true;
    this.shown = 0;
    new ResizeObserver(() => this.resize()).observe(element);
  }

  get width() {
    return this.element.clientWidth;
  }

  get height() {
    return this.element.clientHeight;
  }

  get scale() {
    return window.devicePixelRatio || 1;
  }

  resize() {
    this.canvas.width = Math.max(1, Math.round(this.width * this.scale));
    this.canvas.height = Math.max(1, Math.round(this.height * this.scale));
    this.tellSize();
    this.redraw();
  }

  /** Tells the program how many pixels there are; none where the pane is hidden. */
  tellSize() {
    const seen = this.width > 0 && this.height > 0;
    this.connection.ask('size', {
      pane: this.name,
      width: seen ? Math.min(8192, this.canvas.width) : 0,
      height: seen ? Math.min(8192, this.canvas.height) : 0,
    });
  }

  /**
   * Takes a picture, and says when it is shown.
   * @param {PictureAbout} about
   * @param {Blob} file
   */
  async take(about, file) {
    const image = await createImageBitmap(file);
    this.image?.close();
    this.image = image;
    this.about = about;
    ++this.shown;
    this.element.dataset.number = String(about.number);
    this.element.dataset.exact = String(about.exact);
    this.connection.ask('shown', {pane: this.name, number: about.number});
    this.redraw();
  }

  redraw() {
    if (!this.isDrawn) return;
    this.isDrawn = false;
    requestAnimationFrame(() => {
      this.isDrawn = true;
      const context = this.context;
      context.setTransform(1, 0, 0, 1, 0, 0);
      context.fillStyle = '#000';
      context.fillRect(0, 0, this.canvas.width, this.canvas.height);
      context.setTransform(this.scale, 0, 0, this.scale, 0, 0);
      this.draw(context);
    });
  }

  /**
   * Draws picture and marks, in CSS pixels.
   * @param {CanvasRenderingContext2D} _context
   */
  draw(_context) {
    throw new Error('a pane draws itself');
  }

  /**
   * @param {PointerEvent | WheelEvent | MouseEvent} event
   * @returns {Point}
   */
  pointOf(event) {
    const box = this.canvas.getBoundingClientRect();
    return {x: event.clientX - box.left, y: event.clientY - box.top};
  }

  /**
   * A bar of a round length, at the lower edge.
   * @param {CanvasRenderingContext2D} context
   * @param {number} pixelsPerMm
   */
  drawBar(context, pixelsPerMm) {
    const most = (this.width * 0.3) / pixelsPerMm;
    const power = 10 ** Math.floor(Math.log10(most));
    const mm = power * (most / power >= 5 ? 5 : most / power >= 2 ? 2 : 1);
    const length = mm * pixelsPerMm;
    const x = (this.width - length) / 2;
    const y = this.height - 12;
    context.strokeStyle = kMarks.text;
    context.lineWidth = 2;
    context.beginPath();
    context.moveTo(x, y - 4);
    context.lineTo(x, y);
    context.lineTo(x + length, y);
    context.lineTo(x + length, y - 4);
    context.stroke();
    const text = mm >= 10 ? `${mm / 10} cm` : `${mm} mm`;
    this.drawText(context, text, this.width / 2, y - 6, 'center', 'bottom');
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {string} text
   * @param {number} x
   * @param {number} y
   * @param {CanvasTextAlign} [align]
   * @param {CanvasTextBaseline} [baseline]
   */
  drawText(context, text, x, y, align = 'left', baseline = 'top') {
    context.font = '13px system-ui, sans-serif';
    context.textAlign = align;
    context.textBaseline = baseline;
    context.lineWidth = 3;
    context.strokeStyle = 'rgba(0, 0, 0, 0.7)';
    context.strokeText(text, x, y);
    context.fillStyle = kMarks.text;
    context.fillText(text, x, y);
  }

  /**
   * A circle around what a hand would take.
   * @param {CanvasRenderingContext2D} context
   * @param {Point} at
   * @param {number} radius
   * @param {boolean} isFull  whether the hand holds it
   */
  drawCircle(context, at, radius, isFull) {
    context.strokeStyle = kMarks.hand;
    context.lineWidth = isFull ? 2.5 : 1.5;
    context.setLineDash(isFull ? [] : [5, 4]);
    context.beginPath();
    context.arc(at.x, at.y, Math.max(2, radius), 0, 2 * Math.PI);
    context.stroke();
    context.setLineDash([]);
  }

  /**
   * What is pinned: a thin circle with a cross in its middle.
   * @param {CanvasRenderingContext2D} context
   * @param {Point} at
   * @param {number} radius
   */
  drawPin(context, at, radius) {
    context.strokeStyle = kMarks.pin;
    context.lineWidth = 1.5;
    context.beginPath();
    context.arc(at.x, at.y, Math.max(2, radius), 0, 2 * Math.PI);
    context.moveTo(at.x - 4, at.y);
    context.lineTo(at.x + 4, at.y);
    context.moveTo(at.x, at.y - 4);
    context.lineTo(at.x, at.y + 4);
    context.stroke();
  }

  /**
   * A line that a cut will follow.
   * @param {CanvasRenderingContext2D} context
   * @param {Point[]} points
   * @param {boolean} isClosed  whether its ends are joined
   */
  drawLine(context, points, isClosed) {
    context.strokeStyle = kMarks.hand;
    context.lineWidth = 2;
    context.beginPath();
    for (const point of points) context.lineTo(point.x, point.y);
    if (isClosed) context.closePath();
    context.stroke();
    for (const point of points.length < 12 ? points : []) context.fillRect(point.x - 2, point.y - 2, 4, 4);
  }
}
