// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cmath>
#include <cstdint>

#include "deform/core/host_device.h"

namespace tetwarp {

/// Vertices are integers in steps of 2^-12 voxel of the output grid (docs/design/definition.md, "Input"). 2^18 voxels
/// on an axis fit, with room for differences. Everything that decides ownership is integer arithmetic on them.
constexpr int kStepsPerVoxel = 1 << 12;
constexpr double kLargestIndex = 1 << 18;
constexpr float kVoxelsPerStep = 1.0f / kStepsPerVoxel;

/// The nearest multiple of 2^-12 voxel, ties to even, in steps.
/// @param index  finite, |index| < kLargestIndex
TETWARP_HD inline std::int32_t snap(double index) {
  return static_cast<std::int32_t>(std::rint(index * kStepsPerVoxel));
}

TETWARP_HD inline glm::i32vec3 snap(const glm::dvec3& index) { return {snap(index.x), snap(index.y), snap(index.z)}; }

/// The nudge: a voxel p is owned by the tetrahedron around p + d, d = (15 sx, 7 sy, 4 sz) / 65536 voxel, each sign
/// pointing to the middle of the undeformed lattice.
///
/// Voxel centres exactly on faces are the common case (any field that keeps a coordinate plane in place), and three
/// unequal small steps leave hardly any of them on a face. What still is exactly on one is settled as if the point were
/// p + d + (sx e, sy e^2, sz e^3), e > 0 infinitesimal. All three steps are shorter than 2^-12 voxel, so a box of
/// snapped vertices contains p + d just when it contains p and is closed only on the side that the nudge points away
/// from.
constexpr int kNudgeSteps = 16;  ///< nudge units (2^-16 voxel) in a step of 2^-12
constexpr int kNudgeX = 15, kNudgeY = 7, kNudgeZ = 4;

/// In which direction each voxel is nudged on each axis: +1 below the middle of the undeformed lattice, else -1.
struct Nudge {
  glm::i64vec3 low_plus_high{0};  ///< twice the middle of the undeformed lattice's box of snapped vertices, 2^-12 voxel

  TETWARP_HD int sign(int axis, std::int64_t voxel) const {
    return 2 * kStepsPerVoxel * voxel < low_plus_high[axis] ? 1 : -1;
  }
  TETWARP_HD glm::i32vec3 signs(const glm::i64vec3& voxel) const {
    return {sign(0, voxel.x), sign(1, voxel.y), sign(2, voxel.z)};
  }
  /// The first voxel on an axis that is nudged downwards.
  TETWARP_HD std::int64_t first_down(int axis) const {
    const std::int64_t voxel = low_plus_high[axis] >> 13;  // floor of the middle
    return sign(axis, voxel) < 0 ? voxel : voxel + 1;
  }
};

/// The directions of `Nudge` in 32 bits, for grids that fit them: voxels from `first_down` on are nudged downwards.
struct NudgeTurns {
  glm::ivec3 first_down{0};

  NudgeTurns() = default;
  explicit NudgeTurns(const Nudge& nudge)
      : first_down(static_cast<int>(nudge.first_down(0)), static_cast<int>(nudge.first_down(1)),
                   static_cast<int>(nudge.first_down(2))) {}
  TETWARP_HD int sign(int axis, int voxel) const { return voxel < first_down[axis] ? 1 : -1; }
  TETWARP_HD glm::i32vec3 signs(const glm::ivec3& voxel) const {
    return {sign(0, voxel.x), sign(1, voxel.y), sign(2, voxel.z)};
  }
};

/// Where tiles begin on an axis, so that all voxels of a tile are nudged in the same direction.
/// @param begin, end  half-open range of voxels
/// @param turn        `Nudge::first_down` of the axis
/// @param size        voxels of a tile
inline std::int64_t tile_origin(std::int64_t begin, std::int64_t end, std::int64_t turn, std::int64_t size) {
  return turn > begin && turn < end ? turn - (turn - begin + size - 1) / size * size : begin;
}

/// The nudge d in units of 2^-16 voxel, from its signs.
TETWARP_HD inline glm::i32vec3 nudge_steps(const glm::i32vec3& signs) {
  return {kNudgeX * signs.x, kNudgeY * signs.y, kNudgeZ * signs.z};
}

/// Wide exact integer. It holds products of three coordinates of any tetrahedron that fits the grid (below 2^100).
__extension__ typedef __int128 Wide;

namespace detail {

// Whole numbers and doubles, on a device by additions: it has four times as many of them a second as conversions.

#ifdef TETWARP_ON_DEVICE
constexpr double kLiftToWhole = 3.0 * (std::int64_t{1} << 51);  // doubles from 2^52 to 2^53 are the whole numbers
#endif

/// A whole number as double.
TETWARP_HD inline double whole_in_double(std::int32_t value) {
#ifdef TETWARP_ON_DEVICE
  constexpr double kLift = 4503601774854144.0;  // 2^52 + 2^31
  return __hiloint2double(0x43300000, static_cast<int>(static_cast<unsigned>(value) ^ 0x80000000u)) - kLift;
#else
  return static_cast<double>(value);
#endif
}
/// The largest whole number that is not above a value below 2^51, either way from 0.
TETWARP_HD inline double floor_to_whole(double value) {
#ifdef TETWARP_ON_DEVICE
  return __dadd_rd(value, kLiftToWhole) - kLiftToWhole;
#else
  return std::floor(value);
#endif
}
/// The nearest whole number, an even one between two, of a value below 2^51 either way from 0.
TETWARP_HD inline std::int64_t nearest_whole(double value) {
#ifdef TETWARP_ON_DEVICE
  return __double_as_longlong(value + kLiftToWhole) - __double_as_longlong(kLiftToWhole);
#else
  return static_cast<std::int64_t>(std::rint(value));
#endif
}

}  // namespace detail

/// The value as double, rounded in two steps, with the same bits on host and device.
TETWARP_HD inline double to_double(Wide value) {
  const bool negative = value < 0;
  const Wide size = negative ? -value : value;
  const double high = static_cast<double>(static_cast<std::uint64_t>(size >> 64));
  const double low = static_cast<double>(static_cast<std::uint64_t>(size));
  const double result = high * 18446744073709551616.0 + low;
  return negative ? -result : result;
}

TETWARP_HD inline double to_double(double value) { return value; }
TETWARP_HD inline double to_double(std::int64_t value) { return static_cast<double>(value); }

}  // namespace tetwarp
