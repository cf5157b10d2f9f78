#pragma once

#include "cuda/slab.h"

namespace tetwarp::cuda_detail {

/// A place as whole voxels and the rest, like `place_at`.
__device__ inline void split_place(const glm::ivec3& voxel, const glm::vec3& offset, glm::ivec3& base,
                                   glm::vec3& rest) {
  const glm::ivec3 whole(__float2int_rd(offset.x), __float2int_rd(offset.y), __float2int_rd(offset.z));
  rest = offset - glm::vec3(whole);
  base = voxel + whole;
  if (fmaxf(fmaxf(rest.x, rest.y), rest.z) < 1.0f) return;
#pragma unroll
  for (int axis = 0; axis < 3; ++axis) {  // rounded up to the next voxel
    if (rest[axis] < 1.0f) continue;
    ++base[axis];
    rest[axis] = 0;
  }
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
  glm::ivec3 base;
  glm::vec3 t;
  split_place(voxel, u, base, t);
  const auto is_below = [](int index, int end) { return static_cast<unsigned>(index) < static_cast<unsigned>(end); };
  float value;
  if (is_below(base.x, last.x) && is_below(base.y, last.y) && is_below(base.z, last.z)) {
    value = interpolate(source, base.z * slice + base.y * row + base.x, 1, row, slice, t);
  } else {
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
