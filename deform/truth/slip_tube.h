// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <glm/vec2.hpp>
#include <vector>

#include "deform/simulate/cut.h"
#include "deform/truth/bands.h"
#include "deform/truth/subject.h"

namespace tetwarp::truth {

/// The surface along which tissue slips: a tube along the third axis of a lattice, around the convex hull of the lungs
/// seen along that axis, half a cell outside of it.
class SlipTube {
 public:
  /// @param subject  with the role lung
  /// @throws InputError for lungs too small, or a third axis that does not lead from feet to head
  explicit SlipTube(const Subject& subject);

  /// How deep a column of the lattice lies inside the tube, mm; below 0 outside.
  /// @param at  continuous index along i and j
  double depth_mm(const glm::dvec2& at) const;
  /// The tube, through the whole lattice.
  simulate::Cut cut() const;

 private:
  Geometry lattice_;
  std::vector<glm::dvec2> corners_;  ///< continuous index along i and j, turning left
};

/// The voxels of a volume by their distance from the tube. The first band reaches a cell's diagonal: inside cells that
/// the tube divides it is rounded at its bends, and what samples of a field say across it is no truth. Two more bands
/// reach 10 mm and 20 mm further.
/// @param subject  as of `SlipTube`
/// @param volume   grid of the volume over which the subject's lattice lies
Bands slip_bands(const Subject& subject, const Geometry& volume);

}  // namespace tetwarp::truth
