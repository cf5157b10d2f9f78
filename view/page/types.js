// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Types of what page and program tell each other, for the checker alone; no code.

/**
 * A place or direction in patient space, LPS mm.
 * @typedef {[number, number, number]} Vector
 */

/**
 * The name of a pane of slices.
 * @typedef {'axial' | 'coronal' | 'sagittal'} SliceName
 */

/**
 * How the slices of a plane lie in space.
 * @typedef {object} SlicePlane
 * @property {number} width      pixels of a slice
 * @property {number} height     pixels of a slice
 * @property {number} slices     how many there are
 * @property {Vector} first      the middle of the first pixel of slice 0
 * @property {Vector} right      from a pixel to the one on its right
 * @property {Vector} down       from a pixel to the one below
 * @property {Vector} next       from a slice to the next
 * @property {string[]} letters  patient directions at the left, right, upper and lower edge
 */

/**
 * What does not change.
 * @typedef {object} About
 * @property {string} title
 * @property {Vector} size     voxels
 * @property {Vector} spacing  mm
 * @property {Vector} middle   of the volume
 * @property {Record<SliceName, SlicePlane>} panes
 * @property {string} backend
 * @property {boolean} hounsfield
 * @property {string[]} styles   names of transfer functions
 * @property {string[]} volumes  what the deformed volume may be saved as
 * @property {string[]} films    and films
 * @property {string} folder
 * @property {boolean} labels  whether there are any
 * @property {number} reel     frames of the fields that are shown; 0: hands work
 * @property {boolean} grows   whether they are one field that grows
 * @property {boolean} pulls   whether they are pull fields
 */

/**
 * What is known of the field.
 * @typedef {object} Quality
 * @property {number} coverage    share of the voxels that got a value
 * @property {number} inverted    tetrahedra that are turned inside out
 * @property {number} degenerate  tetrahedra without volume
 * @property {number | null} jacobian  least Jacobian determinant; a pull field has none
 */

/**
 * A centre, LPS mm, and a radius, mm.
 * @typedef {[number, number, number, number]} Ball
 */

/**
 * @typedef {object} Tissue
 * @property {string} name
 * @property {number} stiffness    Young's modulus, kPa
 * @property {number} compression  part of its length by which a link may shrink
 * @property {number} stretch      and grow
 * @property {number} shear        and be sheared
 */

/**
 * @typedef {object} State
 * @property {number} request  number of the last message that it knows of
 * @property {number} frames
 * @property {boolean} moving
 * @property {boolean} undo
 * @property {boolean} redo
 * @property {boolean} holds
 * @property {Ball[]} pins
 * @property {Ball | null} ball
 * @property {{name: string, open: boolean}[]} cuts
 * @property {boolean} playable  whether there is a scenario to play
 * @property {boolean} plays
 * @property {number} frame  of the fields that are shown
 * @property {Tissue[]} tissues
 * @property {'chainmail' | 'mass-spring'} method
 * @property {Quality | null} quality
 * @property {Vector | null} fold
 * @property {Vector} cursor
 * @property {number} width   of the window of grey levels
 * @property {number} level
 * @property {'after' | 'before' | 'difference' | 'swipe'} show
 * @property {number} share   of a swipe
 * @property {string | null} overlay
 * @property {string} style
 * @property {Record<SliceName | 'volume', number>} pictures  numbers of the exact ones, or of the next ones
 */

/**
 * Pixels and rays of the volume's picture.
 * @typedef {object} ViewPlane
 * @property {Vector} middle
 * @property {Vector} right
 * @property {Vector} down
 * @property {Vector} forward
 * @property {number} pixel  mm
 */

/**
 * What a picture says of itself.
 * @typedef {object} PictureAbout
 * @property {SliceName | 'volume'} pane
 * @property {number} number
 * @property {number} request  number of the last request that it shows
 * @property {boolean} exact
 * @property {number} width
 * @property {number} height
 * @property {number} voxel
 * @property {ViewPlane} [plane]
 */

export {};
