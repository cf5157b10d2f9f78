#pragma once

#include "cuda/slab.h"

namespace tetwarp::cuda_detail {

/// One axis of a sample: moves it onto the grid like `clamp_to_grid`. @return false further out
__device__ bool place_on_axis(int voxel, float offset, int last, int& base, float& fraction) {
  const float whole = floorf(offset);
  const float rest = offset - whole;
  const bool next = rest >= 1.0f;
  base = voxel + static_cast<int>(whole) + (next ? 1 : 0);
  fraction = next ? 0.0f : rest;
  if (static_cast<unsigned>(base) < static_cast<unsigned>(last)) return true;
  const bool low = base == -1 && fraction >= 0.5f, high = base == last && fraction <= 0.5f;
  base = low ? 0 : base;
  fraction = 0;
  return low || high;
}

template <class V>
__device__ bool VoxelSink<V>::write(const glm::ivec3& voxel, const glm::vec3& u) const {
  glm::ivec3 base;
  glm::vec3 t;
  const bool inside = place_on_axis(voxel.x, u.x, last.x, base.x, t.x) &
                      place_on_axis(voxel.y, u.y, last.y, base.y, t.y) &
                      place_on_axis(voxel.z, u.z, last.z, base.z, t.z);
  if (!inside) {
    nothing(voxel);
    return false;
  }
  // With a fraction of 0 the neighbour has no weight: any finite value will do, so the voxel itself stands in for it.
  const int dx = t.x != 0, dy = t.y != 0 ? row : 0, dz = t.z != 0 ? slice : 0;
  const glm::ivec3 held = base - source_begin;
  const V* v = source + ((std::int64_t{held.z} * slice) + (held.y * row + held.x));
  const auto along_x = [&](const V* from) {
    const float a = static_cast<float>(from[0]);
    return a + t.x * (static_cast<float>(from[dx]) - a);
  };
  const auto along_y = [&](const V* from) {
    const float a = along_x(from);
    return a + t.y * (along_x(from + dy) - a);
  };
  const float a = along_y(v);
  const float value = a + t.z * (along_y(v + dz) - a);
  at(voxel) = static_cast<V>(__float2int_rn(value));  // between the corners: never saturates
  return true;
}

}  // namespace tetwarp::cuda_detail
