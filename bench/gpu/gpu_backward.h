// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cmath>
#include <cstdint>

#include "deform/core/host_device.h"

namespace tetwarp::bench {

/// Voxels in plain memory, i fastest; at least two on each axis.
struct PlainVolume {
  const std::int16_t* voxels;
  int nx, ny, nz;
};

namespace detail {

/// The lower of the two samples that a place lies between, and how far it is on the way to the other one.
struct Between {
  int low;
  float t;
};
TETWARP_HD inline Between between(float place, int count) {
  const float clamped = fminf(fmaxf(place, 0.0f), static_cast<float>(count - 1));
  const int floor = static_cast<int>(clamped), low = floor < count - 2 ? floor : count - 2;
  return {low, clamped - static_cast<float>(low)};
}

TETWARP_HD inline float mix(float a, float b, float t) { return a + t * (b - a); }

}  // namespace detail

/// What a backward warp gives a voxel that comes from `place` (continuous index): trilinear in float, clamped up to
/// half a voxel beyond the outermost centres; the background further out.
TETWARP_HD inline std::int16_t sample_backward(const PlainVolume& volume, const glm::vec3& place,
                                               std::int16_t background) {
  using detail::mix;
  const bool inside =
      place.x >= -0.5f && place.y >= -0.5f && place.z >= -0.5f && place.x <= static_cast<float>(volume.nx) - 0.5f &&
      place.y <= static_cast<float>(volume.ny) - 0.5f && place.z <= static_cast<float>(volume.nz) - 0.5f;
  if (!inside) return background;
  const detail::Between x = detail::between(place.x, volume.nx), y = detail::between(place.y, volume.ny),
                        z = detail::between(place.z, volume.nz);
  const std::int64_t row = volume.nx, slice = row * volume.ny;
  const std::int16_t* at = volume.voxels + z.low * slice + y.low * row + x.low;
  const auto along_x = [&](const std::int16_t* two) {
    return mix(static_cast<float>(two[0]), static_cast<float>(two[1]), x.t);
  };
  const float near = mix(along_x(at), along_x(at + row), y.t),
              far = mix(along_x(at + slice), along_x(at + slice + row), y.t);
  return static_cast<std::int16_t>(std::rint(mix(near, far, z.t)));
}

}  // namespace tetwarp::bench
