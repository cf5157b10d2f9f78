// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cmath>
#include <cstdint>
#include <type_traits>

#include "deform/core/host_device.h"

// Values of a volume between its voxels, in float, and how they change: what rays see.
namespace tetwarp::ray {

// On the device an instruction each; of equal zeros either may come out.
#ifdef TETWARP_ON_DEVICE
TETWARP_INLINE_HD float smaller(float a, float b) { return fminf(a, b); }
TETWARP_INLINE_HD float larger(float a, float b) { return fmaxf(a, b); }
#else
TETWARP_INLINE_HD float smaller(float a, float b) { return a < b ? a : b; }
TETWARP_INLINE_HD float larger(float a, float b) { return a > b ? a : b; }
#endif
TETWARP_INLINE_HD float clamped(float value, float low, float high) { return smaller(larger(value, low), high); }
TETWARP_INLINE_HD int smaller(int a, int b) { return a < b ? a : b; }
TETWARP_INLINE_HD int larger(int a, int b) { return a > b ? a : b; }
TETWARP_INLINE_HD int clamped(int value, int low, int high) { return smaller(larger(value, low), high); }
/// a b + c, rounded once: an instruction wherever there is one, and the same bits elsewhere.
TETWARP_INLINE_HD float fused(float a, float b, float c) { return std::fma(a, b, c); }
TETWARP_INLINE_HD float dot(const glm::vec3& a, const glm::vec3& b) {
  return fused(a.z, b.z, fused(a.y, b.y, a.x * b.x));
}

/// Whether what was sampled among voxels of a type is a number: among whole numbers it always is.
template <class V>
TETWARP_INLINE_HD bool is_number(float value) {
  return std::is_integral_v<V> || value == value;
}

/// A continuous index among the voxels, as whole voxel and fraction. Places beyond the outermost centres are moved onto
/// them.
struct RayPlace {
  glm::ivec3 whole;
  glm::vec3 fraction;
};

TETWARP_INLINE_HD RayPlace place_among(const glm::ivec3& size, const glm::vec3& index) {
  RayPlace place;
  for (int axis = 0; axis < 3; ++axis) {
    const float at = clamped(index[axis], 0.0f, static_cast<float>(size[axis] - 1));
    place.whole[axis] = static_cast<int>(at);
    place.fraction[axis] = at - static_cast<float>(place.whole[axis]);
  }
  return place;
}

/// 64-bit product. On the device it is one instruction; compilers would move the conversion of one factor out of a loop
/// and take five.
TETWARP_INLINE_HD std::int64_t wide_product(int a, int b) {
#ifdef TETWARP_ON_DEVICE
  std::int64_t product;
  asm("mul.wide.s32 %0, %1, %2;" : "=l"(product) : "r"(a), "r"(b));
  return product;
#else
  return std::int64_t{a} * b;
#endif
}

/// Number of an element of a grid, i fastest.
/// @param size  elements on each axis; a slice has fewer than 2^31
TETWARP_INLINE_HD std::int64_t number_in(const glm::ivec3& size, const glm::ivec3& element) {
  return wide_product(element.z * size.y + element.y, size.x) + element.x;
}

/// In which voxels are subtracted: int where it holds all differences, else float.
template <class V>
using RayNumber = std::conditional_t<std::is_integral_v<V> && sizeof(V) <= 2, int, float>;

/// A voxel as a number to be subtracted. On the device a word is converted to float faster than half of one, and
/// compilers are kept from seeing that it is half of one.
template <class V>
TETWARP_INLINE_HD RayNumber<V> number_of(const V& voxel) {
  auto number = static_cast<RayNumber<V>>(voxel);
#ifdef TETWARP_ON_DEVICE
  if constexpr (std::is_same_v<RayNumber<V>, int>) asm("" : "+r"(number));
#endif
  return number;
}

/// The voxels of a volume, i fastest.
template <class V>
struct RayVolume {
  const V* voxels = nullptr;
  glm::ivec3 size{0};
  glm::ivec3 strides{0};  ///< values from one voxel to the next along each axis, fewer than 2^31; 1 along i

  TETWARP_INLINE_HD const V* at(const glm::ivec3& voxel) const {
    return voxels + wide_product(voxel.z, strides.z) + (voxel.y * strides.y + voxel.x);
  }
};

/// The eight voxels around a place, and the place between them.
template <class V>
struct EightVoxels {
  const V* corner;  ///< the voxel of least indices
  glm::vec3 fraction;
  int next[3];    ///< values to the neighbour along an axis; 0 at the end of the volume
  int before[3];  ///< values back to the one before; 0 at its beginning
  int beyond[3];  ///< values to the one after the neighbour, or to the last one
};

template <class V>
TETWARP_INLINE_HD EightVoxels<V> voxels_at(const RayVolume<V>& volume, const RayPlace& place) {
  EightVoxels<V> eight;
  eight.corner = volume.at(place.whole);
  eight.fraction = place.fraction;
  for (int axis = 0; axis < 3; ++axis) {
    const int last = volume.size[axis] - 1, whole = place.whole[axis], stride = volume.strides[axis];
    eight.before[axis] = whole > 0 ? stride : 0;
    eight.next[axis] = whole < last ? stride : 0;
    eight.beyond[axis] = whole + 1 < last ? 2 * stride : eight.next[axis];
  }
  return eight;
}

/// The eight voxels around a place, none of which lies beyond an end of the volume. Distances along i are then
/// constants that the compiler knows.
template <class V>
TETWARP_INLINE_HD EightVoxels<V> inner_voxels_at(const RayVolume<V>& volume, const RayPlace& place) {
  const int row = volume.strides.y, slice = volume.strides.z;
  return {volume.at(place.whole), place.fraction, {1, row, slice}, {1, row, slice}, {2, 2 * row, 2 * slice}};
}

template <class V>
TETWARP_INLINE_HD float between(const V& a, const V& b, float share) {
  const RayNumber<V> from = number_of(a);
  return fused(static_cast<float>(number_of(b) - from), share, static_cast<float>(from));
}

/// Linear between the four corners of a side; `at` gives the value of one.
template <class At>
TETWARP_INLINE_HD float over_side(const At& at, int right, int up, float share_right, float share_up) {
  const float low = fused(at(right) - at(0), share_right, at(0)),
              high = fused(at(up + right) - at(up), share_right, at(up));
  return fused(high - low, share_up, low);
}

/// The value at the place, linear between voxels.
template <class V>
TETWARP_INLINE_HD float value_in(const EightVoxels<V>& eight) {
  const auto along_i = [&](int offset) {
    return between(eight.corner[offset], eight.corner[offset + eight.next[0]], eight.fraction.x);
  };
  return over_side(along_i, eight.next[1], eight.next[2], eight.fraction.y, eight.fraction.z);
}

/// `value_in` of the eight voxels around a place.
template <class V>
TETWARP_INLINE_HD float value_at(const RayVolume<V>& volume, const RayPlace& place) {
  bool inner = true;
  for (int axis = 0; axis < 3; ++axis) inner = inner && place.whole[axis] < volume.size[axis] - 1;
  return inner ? value_in(inner_voxels_at(volume, place)) : value_in(voxels_at(volume, place));
}

/// Differences at the place: of the values one voxel further and one voxel before, along each axis, linear between
/// voxels.
template <class V>
TETWARP_INLINE_HD glm::vec3 differences_in(const EightVoxels<V>& eight) {
  glm::vec3 difference;
  for (int axis = 0; axis < 3; ++axis) {
    const int right = axis == 0 ? 1 : 0, up = axis == 2 ? 1 : 2;
    const auto along = [&](int offset) {
      const V* const v = eight.corner + offset;
      const RayNumber<V> here = number_of(v[eight.next[axis]]) - number_of(v[-eight.before[axis]]),
                         change = number_of(v[eight.beyond[axis]]) - number_of(v[0]) - here;
      return fused(static_cast<float>(change), eight.fraction[axis], static_cast<float>(here));
    };
    difference[axis] = over_side(along, eight.next[right], eight.next[up], eight.fraction[right], eight.fraction[up]);
  }
  return difference;
}

/// `differences_in` of the eight voxels around a place.
template <class V>
TETWARP_INLINE_HD glm::vec3 differences_at(const RayVolume<V>& volume, const RayPlace& place) {
  bool inner = true;
  for (int axis = 0; axis < 3; ++axis)
    inner = inner && place.whole[axis] > 0 && place.whole[axis] < volume.size[axis] - 2;
  return inner ? differences_in(inner_voxels_at(volume, place)) : differences_in(voxels_at(volume, place));
}

}  // namespace tetwarp::ray
