// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <span>

#include "bench/harness/known_fields.h"

namespace tetwarp::bench {

/// How far a result is from the truth.
struct Deviation {
  double rms = 0, mean = 0, largest = 0;  ///< of absolute differences or distances; NaN where nothing was compared
  std::uint64_t compared = 0;
  std::uint64_t missing = 0;  ///< not finite where there is a truth
};

/// The true inverse on a grid along the axes of space: undeformed minus deformed point, mm.
struct TrueInverse {
  const Geometry* grid = nullptr;
  std::span<const glm::vec3> displacement;
};

/// A warped volume, HU, against its source read where the true inverse says, linearly and in double. Voxels whose
/// undeformed place is less than half a voxel inside the volume do not count: at the border filters differ in what they
/// take for outside.
/// @param found  on the grid of source and truth  @throws InputError for another size
Deviation compare_volume(std::span<const std::int16_t> found, std::span<const std::int16_t> source,
                         const TrueInverse& truth);

/// An inverse field, mm, against the true one, on all of the grid whose undeformed place lies in the grid's box.
/// @throws InputError for another size
Deviation compare_inverse_field(std::span<const glm::vec3> found, const TrueInverse& truth);

/// Determinants at deformed places, voxel by voxel of the grid, against the formula's at the undeformed place. Where
/// that is less than a voxel inside the grid nothing counts.
Deviation compare_determinants(std::span<const float> found, const SmoothField& field, const TrueInverse& truth);

/// Determinants at undeformed places against the formula's. The outermost voxels do not count.
Deviation compare_rest_determinants(std::span<const float> found, const SmoothField& field, const Geometry& grid);

/// Displacements of a grid's points against a formula, all of them.
Deviation compare_displacements(std::span<const glm::vec3> found, const PointMap& formula, const Geometry& grid);

}  // namespace tetwarp::bench
