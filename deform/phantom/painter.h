// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>

#include "deform/phantom/anatomy.h"

namespace tetwarp::phantom {

/// One row of voxels along x, in body space. The body is a little bent, so that it looks less regular: the places of
/// voxels are bent before the anatomy is painted.
struct PaintedRow {
  std::span<const float> straight_x;  ///< x of each voxel before bending, for the table
  float straight_y;
  std::span<const Point> points;  ///< the bent places of voxels, x rising
  Bounds box;                     ///< around `points`
  /// Millimetres over which one tissue blends into the next: about one voxel.
  float edge;
  std::span<float> hu;            ///< HU of the voxels, over which is painted
  std::span<PhantomLabel> label;  ///< what the voxels belong to

  /// Paints over a voxel: `share` of it, 0 to 1, is filled. Where that is half of it or more, it takes the label.
  void blend(std::size_t i, float with, float share, PhantomLabel is) const {
    hu[i] += share * (with - hu[i]);
    if (share >= 0.5f) label[i] = is;
  }
};

/// Paints air and the table.
void paint_surroundings(const PaintedRow& row);

/// Paints skin, fat, muscles, what fills the cage, lungs, diaphragm and ribs.
void paint_trunk(const PaintedRow& row, const Trunk& trunk);

/// Paints one organ over what is there. Where the row does not meet it, nothing changes.
void paint_organ(const PaintedRow& row, const Organ& organ, const Trunk& trunk);

/// The box outside of which the organ paints nothing, for edges of `edge` mm.
Bounds reach(const Organ& organ, float edge);

inline bool overlap(const Bounds& a, const Bounds& b) {
  return a.low.x <= b.high.x && b.low.x <= a.high.x && a.low.y <= b.high.y && b.low.y <= a.high.y &&
         a.low.z <= b.high.z && b.low.z <= a.high.z;
}

}  // namespace tetwarp::phantom
