// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>

#include "deform/core/lattice_vertex.h"

namespace tetwarp::cuda_detail {

/// Slices along k, half open: of cells, or of voxels.
struct Slices {
  std::int64_t begin = 0, end = 0;

  bool is_empty() const { return begin >= end; }
  friend bool operator==(const Slices&, const Slices&) = default;
};

/// How far the deformed vertices of one slice reach along k of the output: 2^-12 voxel, both ends included.
struct SliceReach {
  std::int32_t low = INT32_MAX, high = INT32_MIN;
};

/// The frame of a part of a lattice: its vertices, its owners and their order are those of the whole.
/// @param cells  from an even slice on
LatticeFrame part_of(const LatticeFrame& whole, const Slices& cells);

/// The cells that may own voxels of the output slices begin <= k < end: one stretch, from an even slice on, that holds
/// all of them. Empty where none does.
/// @param vertices  of each slice of vertices
Slices cells_reaching(std::span<const SliceReach> vertices, std::int64_t begin, std::int64_t end);

/// Box of output index that voxels owned by these cells may come from.
struct RestBox {
  glm::dvec3 low, high;
};
RestBox rest_box(const LatticeFrame& whole, const Slices& cells);

}  // namespace tetwarp::cuda_detail
