#pragma once

#include "cuda/slab.h"

namespace tetwarp::cuda_detail {

/// One axis of a place that was rounded up to the next voxel, like `place_at`.
__device__ inline void carry_on_axis(int& base, float& rest) {
  if (rest < 1.0f) return;
  ++base;
  rest = 0;
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
__device__ float interpolate(const V* v, int at, int dx, int dy, int dz, const glm::vec3& t) {
  const auto along_x = [&](int from) {
    const float a = static_cast<float>(v[from]);
    return a + t.x * (static_cast<float>(v[from + dx]) - a);
  };
  const auto along_y = [&](int from) {
    const float a = along_x(from);
    return a + t.y * (along_x(from + dy) - a);
  };
  const float a = along_y(at);
  return a + t.z * (along_y(at + dz) - a);
}

/// On the border of the source; out of line, so that the common case keeps its simple addresses.
template <class V>
__device__ __noinline__ float interpolate_on_border(const V* v, int at, int dx, int dy, int dz, glm::vec3 t) {
  return interpolate(v, at, dx, dy, dz, t);
}

template <class V>
__device__ bool VoxelSink<V>::write(int place, const glm::ivec3& voxel, const glm::vec3& u) const {
  const glm::ivec3 whole(__float2int_rd(u.x), __float2int_rd(u.y), __float2int_rd(u.z));
  glm::ivec3 base = voxel + whole;
  glm::vec3 t = u - glm::vec3(whole);
  const auto is_below = [](int index, int end) { return static_cast<unsigned>(index) < static_cast<unsigned>(end); };
  float value;
  if (is_below(base.x, last.x) && is_below(base.y, last.y) && is_below(base.z, last.z) &&
      fmaxf(fmaxf(t.x, t.y), t.z) < 1.0f) {
    value = interpolate(source, base.z * slice + base.y * row + base.x, 1, row, slice, t);
  } else {
    for (int axis = 0; axis < 3; ++axis) carry_on_axis(base[axis], t[axis]);
    const bool in_x = clamp_on_axis(last.x, base.x, t.x), in_y = clamp_on_axis(last.y, base.y, t.y);
    if (!clamp_on_axis(last.z, base.z, t.z) || !in_x || !in_y) {
      nothing(place);
      return false;
    }
    value = interpolate_on_border(source, base.z * slice + base.y * row + base.x, t.x != 0 ? 1 : 0, t.y != 0 ? row : 0,
                                  t.z != 0 ? slice : 0, t);
  }
  output[place] = static_cast<V>(__float2int_rn(value));  // between the corners: never saturates
  return true;
}

}  // namespace tetwarp::cuda_detail
