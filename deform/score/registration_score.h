// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "deform/resampler.h"

/// How far a registration is off, where the truth is known.
///
/// The moving volume is the original, the fixed volume the deformed one. A registration gives a map T from fixed to
/// moving; the truth is x0(p), the undeformed place of p. The error at a voxel centre p is |T(p) - x0(p)|.
namespace tetwarp::score {

/// Distances, mm. They are the same for any number of threads and any backend.
struct Errors {
  std::uint64_t points = 0;   ///< points that were compared
  std::uint64_t missing = 0;  ///< points of which the result says no place
  double mean = 0;            ///< mean, mm
  double median = 0,          ///< half of the points are no worse; rounded up by at most 1 %, as those below
      percentile_95 = 0,      ///< 95 % of the points are no worse
      percentile_99 = 0;      ///< 99 % of the points are no worse
  double largest = 0;         ///< largest, mm
  glm::dvec3 worst{0};        ///< where that is, LPS mm; the first of several
};

/// How far off another reading of the same numbers would be: what a mistake of sign or frame looks like.
enum class Reading : std::uint8_t {
  as_given,  ///< displacement from fixed to moving, LPS mm
  nothing,   ///< no displacement at all: as far off as before the registration
  negative,  ///< with the other sign, near to the inverse: from moving to fixed
  ras,       ///< along the axes R, A, S
  voxels     ///< in voxels of the grid instead of mm
};
/// Number of readings.
constexpr std::size_t kReadings = 5;
/// Words for a person: "as given", "the inverse" and others.
std::string to_string(Reading reading);

/// What a result is like, voxel by voxel.
struct DenseScore {
  Errors all;                                ///< of all voxels that count
  std::map<std::int64_t, Errors> labels;     ///< of each label, where there are labels
  std::array<double, kReadings> readings{};  ///< mean error of each reading, over the voxels of `all`
  /// Determinants of the gradient of T, by central differences between neighbouring voxels, over the voxels that count
  /// and have all neighbours.
  std::uint64_t determinants = 0;
  std::uint64_t folded = 0;           ///< determinants that are 0 or below
  double smallest_determinant = 0,    ///< smallest determinant
      largest_determinant = 0;        ///< largest determinant
  double mean_determinant_error = 0;  ///< mean of |det T - 1 / J|, where J is the owner's determinant
};

/// The reading that fits much better than the one that was given, if there is one: its mean error is less than half of
/// that as given, and less than half of that of no displacement.
Reading suspected_reading(const DenseScore& score);

/// Scores a displacement field.
/// @param truth   resampler onto the grid of the fixed volume, whose field is the true one
/// @param result  T(p) - p at each voxel of that grid, LPS mm; NaN where the registration says no place
/// @param counts  not 0 for the voxels that count, such as those of the body, i fastest. Voxels onto which the truth
///        maps nothing do not count
/// @param labels  labels of the fixed volume on the same grid, or an empty view
/// @param limits  number of threads
/// @param control progress and stop
/// @throws InputError for sizes that do not fit, labels that are not whole numbers, or no voxel that counts; and as
///         `Resampler::resample`; Cancelled
DenseScore score_field(ForwardResampler& truth, const PullField& result, const std::vector<std::uint8_t>& counts,
                       const ConstVolumeView& labels, const Limits& limits = {}, const Control& control = {});

/// Errors of points: distances of each from where it should be.
/// @param found   LPS mm; NaN: no place
/// @param wanted  LPS mm, as many
Errors score_points(std::span<const glm::dvec3> found, std::span<const glm::dvec3> wanted);

}  // namespace tetwarp::score
