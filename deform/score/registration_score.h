// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "deform/score/truth.h"

/// How far a registration is off, where the truth is known.
///
/// The moving volume is the original, the fixed volume the deformed one. A registration gives a map T from fixed to
/// moving; the truth is x0(p), the undeformed place of p. The error at a voxel centre p is |T(p) - x0(p)|. In the other
/// direction T leads from moving to fixed, and the truth is the forward map.
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

/// Whether and how a voxel is compared.
enum class Counts : std::uint8_t {
  no,    ///< not at all
  yes,   ///< with the others
  apart  ///< by itself: near a surface along which tissue slips
};

/// What a result is like, voxel by voxel.
struct DenseScore {
  Errors all;    ///< of all voxels that count with the others
  Errors apart;  ///< of those that are compared by themselves
  /// For each map of parts: errors of the voxels of `all`, by their value in the map.
  std::vector<std::map<std::int64_t, Errors>> parts;
  std::array<double, kReadings> readings{};  ///< mean error of each reading, over the voxels of `all`
  /// Determinants of the gradient of T, by central differences between neighbouring voxels, over the voxels of `all`
  /// that have all neighbours.
  std::uint64_t determinants = 0;
  std::uint64_t folded = 0;           ///< determinants that are 0 or below
  double smallest_determinant = 0,    ///< smallest determinant
      largest_determinant = 0;        ///< largest determinant
  double mean_determinant_error = 0;  ///< mean distance of the determinant from the true map's
};

/// The reading that fits much better than the one that was given, if there is one: its mean error is less than half of
/// that as given, and less than half of that of no displacement.
Reading suspected_reading(const DenseScore& score);

/// Scores a displacement field.
/// @param truth   what is true, on the grid of the result
/// @param result  T(p) - p at each voxel of that grid, LPS mm; NaN where the registration says no place
/// @param counts  for each voxel, i fastest. Voxels of which the truth says nothing do not count
/// @param parts   label maps on the same grid, such as organs: errors are told for each label of each of them
/// @param limits  number of threads
/// @param control progress and stop
/// @throws InputError for sizes that do not fit, labels that are not whole numbers, or no voxel that counts with the
///         others; and as `Truth::slab`; Cancelled
DenseScore score_field(Truth& truth, const PullField& result, std::span<const Counts> counts,
                       std::span<const ConstVolumeView> parts = {}, const Limits& limits = {},
                       const Control& control = {});

/// What a result says of a point that need not be a voxel centre: T(p) - p, trilinear between the samples; NaN outside
/// of them, and where one that is needed is NaN.
/// @param result  the displacement field of a registration
/// @param point   LPS mm
glm::dvec3 displacement_at(const PullField& result, const glm::dvec3& point);

/// How far two results are from agreeing: |second(first(p)) - whole(p)| at voxel centres p, where `second` is taken
/// between its samples, trilinearly. With the two directions of a registration, and nothing as the whole, that is its
/// inverse consistency; with the results between three volumes their transitivity.
/// @param first    displacement at each voxel of the grid of `counts`, LPS mm
/// @param second   displacement on any grid of the space to which the first leads
/// @param whole    displacement on the grid of the first; null: none, each point should come back to itself
/// @param counts   for each voxel of the first: those with `Counts::yes` are compared
/// @param limits   number of threads
/// @param control  progress and stop
/// @return errors; missing are voxels of which one of them says no place
/// @throws InputError for sizes that do not fit; Cancelled
Errors consistency(const PullField& first, const PullField& second, const PullField* whole,
                   std::span<const Counts> counts, const Limits& limits = {}, const Control& control = {});

/// Errors of points: distances of each from where it should be.
/// @param found   LPS mm; NaN: no place
/// @param wanted  LPS mm, as many
Errors score_points(std::span<const glm::dvec3> found, std::span<const glm::dvec3> wanted);

}  // namespace tetwarp::score
