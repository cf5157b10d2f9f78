// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>

#include "deform/core/lattice_vertex.h"

namespace tetwarp::cuda_detail {

/// A half-open range of slices along k, of cells or of voxels.
struct Slices {
  std::int64_t begin = 0, end = 0;

  bool is_empty() const { return begin >= end; }
  friend bool operator==(const Slices&, const Slices&) = default;
};

/// Range along k of the output that the deformed vertices of one slice of vertices cover: 2^-12 voxel, both ends
/// included.
struct SliceReach {
  std::int32_t low = INT32_MAX, high = INT32_MIN;
};

/// The frame of a part of a lattice. Snapped vertices, owners and the order of tetrahedra are those of the whole
/// lattice.
/// @param cells  begins at an even slice
LatticeFrame part_of(const LatticeFrame& whole, const Slices& cells);

/// The cells that may own voxels of the output slices begin <= k < end: the smallest range that begins at an even slice
/// and contains all of them. It is empty where there are none.
/// @param vertices  reach of each slice of vertices
Slices cells_reaching(std::span<const SliceReach> vertices, std::int64_t begin, std::int64_t end);

/// Box of output index that voxels owned by these cells may come from.
struct RestBox {
  glm::dvec3 low, high;
};
RestBox rest_box(const LatticeFrame& whole, const Slices& cells);

}  // namespace tetwarp::cuda_detail
