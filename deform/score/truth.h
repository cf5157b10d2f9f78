// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>
#include <vector>

#include "deform/points.h"
#include "deform/resampler.h"

namespace tetwarp::score {

/// What the truth says of the voxels of some slices, i fastest.
struct TruthSlab {
  std::vector<std::uint8_t> is_known;   ///< whether it says something: 1 or 0
  std::vector<glm::vec3> displacement;  ///< from the voxel's centre to its true place, LPS mm
  std::vector<float> determinant;       ///< of the gradient of the true map
};

/// The true map from the grid of one volume of a registration to the space of the other.
class Truth {
 public:
  virtual ~Truth() = default;
  /// The grid at whose voxel centres the truth is known.
  virtual const Geometry& grid() const = 0;
  /// What it says of some slices.
  /// @throws Error as `Resampler::resample`; Cancelled
  virtual TruthSlab slab(const Region& slices, const Control& control) = 0;
};

/// The exact inverse: from fixed to moving.
/// @param resampler  onto the grid of the fixed volume, whose field is the true one; outlives what is returned. A voxel
///         is known if the field leads something onto it.
std::unique_ptr<Truth> exact_inverse(ForwardResampler& resampler);
/// The exact forward map: from moving to fixed. A voxel is known if the field holds it and leads it into the fixed
/// volume.
/// @param mover   of the true field; outlives what is returned
/// @param moving  grid of the moving volume
/// @param fixed   grid of the fixed volume
/// @param limits  number of threads
std::unique_ptr<Truth> exact_forward(const PointMover& mover, const Geometry& moving, const Geometry& fixed,
                                     const Limits& limits = {});

}  // namespace tetwarp::score
