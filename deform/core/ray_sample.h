#pragma once

#include <cstdint>

#include "deform/core/host_device.h"

// Values of a volume between its voxels, in float, and how they change: what rays see.
namespace tetwarp::ray {

TETWARP_INLINE_HD float smaller(float a, float b) { return a < b ? a : b; }
TETWARP_INLINE_HD float larger(float a, float b) { return a > b ? a : b; }
TETWARP_INLINE_HD float clamped(float value, float low, float high) { return smaller(larger(value, low), high); }
TETWARP_INLINE_HD int at_most(int value, int most) { return value < most ? value : most; }
TETWARP_INLINE_HD float dot(const glm::vec3& a, const glm::vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

/// The eight voxels around a place and what lies between them; beyond the outermost centres theirs.
template <class V>
struct Cell {
  const V* corner;  ///< of least indices
  glm::vec3 fraction;
  std::int64_t next[3];    ///< values to the neighbour along an axis; 0 at the end of the volume
  std::int64_t before[3];  ///< values back to the one before; 0 at its beginning
  std::int64_t beyond[3];  ///< values to the one after the neighbour, or to the last one
};

/// @param index  continuous index; beyond the outermost centres it is theirs
template <class V>
TETWARP_INLINE_HD Cell<V> cell_at(const V* voxels, const glm::ivec3& size, const glm::vec3& index) {
  Cell<V> cell;
  cell.corner = voxels;
  std::int64_t stride = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const int last = size[axis] - 1;
    const float place = clamped(index[axis], 0, static_cast<float>(last));
    const int whole = static_cast<int>(place);
    cell.fraction[axis] = place - static_cast<float>(whole);
    cell.corner += whole * stride;
    cell.before[axis] = whole > 0 ? stride : 0;
    cell.next[axis] = whole < last ? stride : 0;
    cell.beyond[axis] = whole + 1 < last ? 2 * stride : cell.next[axis];
    stride *= size[axis];
  }
  return cell;
}

template <class V>
TETWARP_INLINE_HD float between(const V& a, const V& b, float share) {
  const float from = static_cast<float>(a);
  return from + (static_cast<float>(b) - from) * share;
}

/// Linear between the four corners of a side; `at` gives the value of one.
template <class At>
TETWARP_INLINE_HD float over_side(const At& at, std::int64_t right, std::int64_t up, float share_right,
                                  float share_up) {
  const float low = at(0) + (at(right) - at(0)) * share_right, high = at(up) + (at(up + right) - at(up)) * share_right;
  return low + (high - low) * share_up;
}

/// The value, linear between voxels.
template <class V>
TETWARP_INLINE_HD float value_in(const Cell<V>& cell) {
  const auto along_i = [&](std::int64_t offset) {
    return between(cell.corner[offset], cell.corner[offset + cell.next[0]], cell.fraction.x);
  };
  return over_side(along_i, cell.next[1], cell.next[2], cell.fraction.y, cell.fraction.z);
}

/// Differences of the values a voxel further and a voxel before along each axis, halved: central differences, linear
/// between voxels.
template <class V>
TETWARP_INLINE_HD glm::vec3 differences_in(const Cell<V>& cell) {
  glm::vec3 difference;
  for (int axis = 0; axis < 3; ++axis) {
    const int right = axis == 0 ? 1 : 0, up = axis == 2 ? 1 : 2;
    const auto along = [&](std::int64_t offset) {
      const V* const v = cell.corner + offset;
      const float here = static_cast<float>(v[cell.next[axis]]) - static_cast<float>(v[-cell.before[axis]]),
                  there = static_cast<float>(v[cell.beyond[axis]]) - static_cast<float>(v[0]);
      return here + (there - here) * cell.fraction[axis];
    };
    difference[axis] =
        0.5f * over_side(along, cell.next[right], cell.next[up], cell.fraction[right], cell.fraction[up]);
  }
  return difference;
}

}  // namespace tetwarp::ray
