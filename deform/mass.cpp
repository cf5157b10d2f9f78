// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/mass.h"

#include <cmath>
#include <limits>

namespace tetwarp {

namespace {

constexpr double kAir = -1000;  ///< HU of what has no mass

template <class V>
V stored(double value, std::uint64_t& saturated) {
  if constexpr (std::is_floating_point_v<V>) {
    return static_cast<V>(value);
  } else {
    const double whole = std::nearbyint(value);
    constexpr auto kLow = static_cast<double>(std::numeric_limits<V>::lowest()),
                   kHigh = static_cast<double>(std::numeric_limits<V>::max());
    saturated += whole < kLow || whole > kHigh;
    return static_cast<V>(whole < kLow ? kLow : whole > kHigh ? kHigh : whole);
  }
}

}  // namespace

VoxelType type_of_mass(VoxelType type) {
  const bool fits = type != VoxelType::i32 && type != VoxelType::u32 && type != VoxelType::f64;
  return fits ? VoxelType::f32 : VoxelType::f64;
}

std::uint64_t preserve_mass(const ConstVolumeView& hu, const Maps& maps, const std::optional<PaddingRange>& padding,
                            const VolumeView& output, const Region& slices) {
  const VolumeView &jacobian = maps.jacobian, &coverage = maps.coverage;
  require(hu.type == VoxelType::f32 || hu.type == VoxelType::f64, "HU are expected as float32 or float64");
  require(jacobian.voxels && jacobian.type == VoxelType::f32, "determinants are expected as float32");
  require(coverage.voxels && coverage.type == VoxelType::u8, "a coverage is expected as uint8");
  const Geometry& grid = *output.geometry;
  require(*hu.geometry == grid && *jacobian.geometry == grid && *coverage.geometry == grid &&
              hu.buffered == whole(grid) && output.buffered == whole(grid),
          "HU and output are expected whole, and maps on their grid");
  Region held = whole(grid);
  held.begin.z = jacobian.buffered.begin.z;
  held.end.z = jacobian.buffered.end.z;
  require(jacobian.buffered == held && coverage.buffered == held && contains(held, slices),
          "maps are expected in whole slices, of those that are scaled");
  const std::int64_t slice = grid.size.x * grid.size.y;
  const auto value_of = [&](std::int64_t n) {
    return hu.type == VoxelType::f64 ? reinterpret_cast<const double*>(hu.voxels)[n]
                                     : double{reinterpret_cast<const float*>(hu.voxels)[n]};
  };
  const auto* determinants = reinterpret_cast<const float*>(jacobian.voxels);
  const auto* covered = reinterpret_cast<const std::uint8_t*>(coverage.voxels);
  const std::int64_t before = held.begin.z * slice;  // number of the maps' first voxel in the whole volume
  std::uint64_t saturated = 0;
  dispatch(output.type, [&](auto voxel) {
    using V = decltype(voxel);
    V* to = reinterpret_cast<V*>(output.voxels);
    for (std::int64_t n = slices.begin.z * slice; n < slices.end.z * slice; ++n) {
      const double value = value_of(n), determinant = std::abs(determinants[n - before]);
      const bool is_padding = padding && value >= padding->low && value <= padding->high;
      const bool is_density = covered[n - before] != 0 && !is_padding && determinant > 0;
      to[n] = stored<V>(is_density ? (value - kAir) / determinant + kAir : value, saturated);
    }
  });
  return saturated;
}

}  // namespace tetwarp
