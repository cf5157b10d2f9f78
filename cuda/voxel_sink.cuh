#pragma once

#include "cuda/slab.h"

namespace tetwarp::cuda_detail {

/// One axis of a place: whole voxel and the rest, like `place_at`.
__device__ inline void place_on_axis(int voxel, float offset, int& base, float& fraction) {
  const float whole = floorf(offset);
  const float rest = offset - whole;
  const bool next = rest >= 1.0f;
  base = voxel + static_cast<int>(whole) + (next ? 1 : 0);
  fraction = next ? 0.0f : rest;
}

/// Moves it onto the grid like `clamp_to_grid`. @return false further out
__device__ inline bool clamp_on_axis(int last, int& base, float& fraction) {
  if (static_cast<unsigned>(base) < static_cast<unsigned>(last)) return true;
  const bool low = base == -1 && fraction >= 0.5f, high = base == last && fraction <= 0.5f;
  base = low ? 0 : base;
  fraction = 0;
  return low || high;
}

/// Along x, then y, then z. Neighbours without weight may be any voxels: their finite values do not count.
template <class V>
__device__ float interpolate(const V* v, int dx, int dy, int dz, const glm::vec3& t) {
  const auto along_x = [&](const V* from) {
    const float a = static_cast<float>(from[0]);
    return a + t.x * (static_cast<float>(from[dx]) - a);
  };
  const auto along_y = [&](const V* from) {
    const float a = along_x(from);
    return a + t.y * (along_x(from + dy) - a);
  };
  const float a = along_y(v);
  return a + t.z * (along_y(v + dz) - a);
}

template <class V>
__device__ bool VoxelSink<V>::write(const glm::ivec3& voxel, const glm::vec3& u) const {
  glm::ivec3 base;
  glm::vec3 t;
  place_on_axis(voxel.x, u.x, base.x, t.x);
  place_on_axis(voxel.y, u.y, base.y, t.y);
  place_on_axis(voxel.z, u.z, base.z, t.z);
  const auto is_below = [](int index, int end) { return static_cast<unsigned>(index) < static_cast<unsigned>(end); };
  float value;
  if (is_below(base.x, last.x) && is_below(base.y, last.y) && is_below(base.z, last.z)) {
    value = interpolate(source + (base.z * slice + base.y * row + base.x), 1, row, slice, t);
  } else {
    const bool in_x = clamp_on_axis(last.x, base.x, t.x), in_y = clamp_on_axis(last.y, base.y, t.y);
    if (!clamp_on_axis(last.z, base.z, t.z) || !in_x || !in_y) {
      nothing(voxel);
      return false;
    }
    value = interpolate(source + (base.z * slice + base.y * row + base.x), t.x != 0 ? 1 : 0, t.y != 0 ? row : 0,
                        t.z != 0 ? slice : 0, t);
  }
  at(voxel) = static_cast<V>(__float2int_rn(value));  // between the corners: never saturates
  return true;
}

}  // namespace tetwarp::cuda_detail
