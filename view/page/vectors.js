// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Arithmetic of places in patient space, LPS mm.

/** @typedef {import('./types.js').Vector} Vector */
/** @typedef {import('./types.js').SlicePlane} SlicePlane */

/** Patient directions along L, P and S: where the number falls, and where it rises. */
export const kLetters = [['R', 'L'], ['A', 'P'], ['I', 'S']];

/**
 * a + s b
 * @param {Vector} a
 * @param {number} s
 * @param {Vector} b
 * @returns {Vector}
 */
export function along(a, s, b) {
  return [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
}

/**
 * @param {Vector} a
 * @param {Vector} b
 * @returns {Vector}
 */
export function minus(a, b) {
  return along(a, -1, b);
}

/**
 * @param {import('./types.js').Ball} ball
 * @returns {Vector}
 */
export function middleOf(ball) {
  return [ball[0], ball[1], ball[2]];
}

/**
 * @param {Vector} a
 * @param {Vector} b
 */
export function dot(a, b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/** @param {Vector} a */
export function length(a) {
  return Math.sqrt(dot(a, a));
}

/**
 * The place of a pixel of a slice.
 * @param {SlicePlane} plane
 * @param {number} x      0 in the middle of the first pixel
 * @param {number} y
 * @param {number} voxel  number of the slice
 * @returns {Vector}
 */
export function placeOf(plane, x, y, voxel) {
  return along(along(along(plane.first, x, plane.right), y, plane.down), voxel, plane.next);
}

/**
 * The pixel and slice of a place, as fractions: the inverse of `placeOf`.
 * @param {SlicePlane} plane
 * @param {Vector} place
 * @returns {{x: number, y: number, voxel: number}}
 */
export function pixelOf(plane, place) {
  const from = minus(place, plane.first);
  /** @param {Vector} step */
  const steps = (step) => dot(from, step) / dot(step, step);
  return {x: steps(plane.right), y: steps(plane.down), voxel: steps(plane.next)};
}

/**
 * A number for people.
 * @param {number} value
 * @param {number} [digits]
 */
export function shown(value, digits = 1) {
  return value.toFixed(digits).replace(/^-(0(\.0*)?)$/, '$1').replace('-', '\u2212');
}

/**
 * A number of things, for people.
 * @param {number} count
 * @param {string} what  one of them
 */
export function counted(count, what) {
  return `${count} ${what}${count === 1 ? '' : 's'}`;
}
