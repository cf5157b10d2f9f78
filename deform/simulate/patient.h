// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "deform/resampler.h"

namespace tetwarp::simulate {

/// The box of a patient's body, with sides along L, P, S.
struct BodyBox {
  glm::dvec3 low{0},  ///< right, front and lower corner, LPS mm
      high{0};        ///< left, back and upper corner, LPS mm
};

/// A volume as scenarios see it: cell by cell and vertex by vertex.
///
/// Vertices lie on every B-th voxel centre, B the cell size. A voxel belongs to the cell whose index is its own divided
/// by B; voxels after the last cell belong to the last cell. The HU of a vertex is the mean of the voxels from B/2
/// before it up to, but not including, B/2 after it, as far as there are any, and of at least one voxel. Values below
/// -1024 and values that are not numbers are padding, and count as -1024.
struct Patient {
  Geometry lattice;            ///< grid of the undeformed vertices
  std::vector<float> cell_hu,  ///< mean HU of each cell, i fastest
      vertex_hu;               ///< mean HU of each vertex, i fastest
  std::vector<std::int64_t>
      cell_label,    ///< most frequent label of each cell, the smallest of several; empty without a label volume
      vertex_label;  ///< most frequent label of each vertex
  std::vector<std::uint8_t> body;  ///< for each cell: 1 if it belongs to the body, else 0
  std::optional<BodyBox> box;      ///< box of the body's cells; empty if no cell belongs to a body
};

/// Makes a patient from a CT volume.
///
/// The body is the largest set of cells that are connected by faces and whose mean HU exceeds `body_above_hu`; of sets
/// of equal size the one with the first cell. Its box is that of its cells' corners, clipped to the volume's voxel
/// centres.
///
/// @param ct             values in HU, one component, the whole volume
/// @param labels         labels on the grid of `ct`, or null
/// @param cell_size      voxels
/// @param body_above_hu  HU
/// @param control        stop
/// @throws InputError for a cell size below 1, fewer than two voxels on an axis, or labels that lie on another grid or
///         are not whole numbers
Patient examine(const ConstVolumeView& ct, const ConstVolumeView* labels, std::int64_t cell_size, double body_above_hu,
                const Control& control = {});

}  // namespace tetwarp::simulate
