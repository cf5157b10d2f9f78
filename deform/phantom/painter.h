// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>

#include "deform/phantom/anatomy.h"

namespace tetwarp::phantom {

/// One row of voxels along x, in body space. The body is a little uneven: `x`, and y and z of each voxel, are bent.
struct Row {
  std::span<const float> straight_x;  ///< before bending: where the table is
  float straight_y;
  std::span<const Point> points;  ///< bent, x rising
  Box box;                        ///< around `points`
  float edge;                     ///< mm over which an edge goes from one tissue to the next: about one voxel
  std::span<float> hu;            ///< painted on
};

/// Air and the table.
void paint_surroundings(const Row& row);

/// Skin, fat, muscles, what fills the cage, lungs, diaphragm, ribs.
void paint_trunk(const Row& row, const Trunk& trunk);

/// One organ over what is there. Nothing happens where the row does not meet it.
void paint_organ(const Row& row, const Organ& organ, const Trunk& trunk);

/// Box outside of which the organ paints nothing, for edges of `edge` mm.
Box reach(const Organ& organ, float edge);

inline bool overlap(const Box& a, const Box& b) {
  return a.low.x <= b.high.x && b.low.x <= a.high.x && a.low.y <= b.high.y && b.low.y <= a.high.y &&
         a.low.z <= b.high.z && b.low.z <= a.high.z;
}

}  // namespace tetwarp::phantom
