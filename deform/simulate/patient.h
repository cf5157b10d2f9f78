// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "deform/resampler.h"

namespace tetwarp::simulate {

/// Sides along L, P, S; LPS mm.
struct BodyBox {
  glm::dvec3 low{0}, high{0};
};

/// A volume as a scenario sees it: cell by cell and vertex by vertex.
///
/// Vertices lie on every B-th voxel centre. A voxel belongs to the cell with the same index divided by B; those beyond
/// the last cell, where the lattice ends on voxel centres, belong to the last. HU of a vertex is the mean of the voxels
/// from B/2 before it up to, not with, B/2 after it, as far as there are any, and at least of one: a lattice may
/// overhang its volume. Values below -1024, and those that are no numbers, count as -1024: they are padding.
struct Patient {
  Geometry lattice;
  std::vector<float> cell_hu, vertex_hu;               ///< means, i fastest
  std::vector<std::int64_t> cell_label, vertex_label;  ///< most frequent ones, of several the smallest; or none
  std::vector<std::uint8_t> body;                      ///< of each cell, 1: it is of the body
  std::optional<BodyBox> box;                          ///< of the body's cells; none: no cell is of a body
};

/// Looks at a volume.
///
/// The body is the largest set of cells that are connected by faces and whose mean HU is above `body_above_hu`; of sets
/// of one size that with the first cell. Its box is that of its cells' corners, as far as the volume's voxel centres
/// reach.
///
/// @param ct      values in HU, one component, whole
/// @param labels  on the grid of `ct`, or null
/// @throws InputError for a cell size below 1, fewer than two voxels on an axis, labels on another grid or that are
/// not whole numbers
Patient examine(const ConstVolumeView& ct, const ConstVolumeView* labels, std::int64_t cell_size, double body_above_hu,
                const Control& control = {});

}  // namespace tetwarp::simulate
