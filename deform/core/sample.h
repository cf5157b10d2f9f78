// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <limits>
#include <type_traits>

#include "deform/core/fixed_point.h"

namespace tetwarp {

/// A place in a source volume: a whole voxel and a fraction, 0 <= fraction < 1. They are kept apart, so that no
/// precision is lost far from the origin and whole shifts copy exactly.
struct Place {
  glm::i64vec3 base;
  glm::vec3 fraction;
};

/// The place at an offset from a voxel.
/// @param offset  voxels
TETWARP_INLINE_HD Place place_at(const glm::i64vec3& voxel, const glm::vec3& offset) {
  Place place;
  for (int axis = 0; axis < 3; ++axis) {
    const float whole = std::floor(offset[axis]);
    const float rest = offset[axis] - whole;
    const bool next = rest >= 1.0f;  // a negative offset below half a unit in the last place rounds up to 1
    place.base[axis] = voxel[axis] + static_cast<std::int64_t>(whole) + (next ? 1 : 0);
    place.fraction[axis] = next ? 0.0f : rest;
  }
  return place;
}

/// An offset from a voxel in fixed point, as coarse fields have it: whole voxels, and a fraction, a multiple of 2^-23
/// from 0 to below 1.
struct FixedOffset {
  glm::i32vec3 whole;
  glm::vec3 fraction;
};

/// The offset in double, exact. @param offset  voxels
TETWARP_HD inline glm::dvec3 in_double(const glm::vec3& offset) { return glm::dvec3(offset); }
TETWARP_HD inline glm::dvec3 in_double(const FixedOffset& offset) {
  return glm::dvec3(offset.whole) + glm::dvec3(offset.fraction);
}

/// The place at an offset from a voxel.
TETWARP_INLINE_HD Place place_at(const glm::i64vec3& voxel, const FixedOffset& offset) {
  return {voxel + glm::i64vec3(offset.whole), offset.fraction};
}

/// The place at a continuous source index.
/// @param index  finite and within +-2^62
TETWARP_INLINE_HD Place place_at(const glm::dvec3& index) {
  Place place;
  for (int axis = 0; axis < 3; ++axis) {
    const double whole = std::floor(index[axis]);
    const float rest = static_cast<float>(index[axis] - whole);
    const bool next = rest >= 1.0f;
    place.base[axis] = static_cast<std::int64_t>(whole) + (next ? 1 : 0);
    place.fraction[axis] = next ? 0.0f : rest;
  }
  return place;
}

/// Moves a place that lies up to half a voxel outside the outermost centres onto them.
/// @return false if it lies further out
TETWARP_INLINE_HD bool clamp_to_grid(Place& place, const glm::i64vec3& size) {
  for (int axis = 0; axis < 3; ++axis) {
    const std::int64_t last = size[axis] - 1;
    if (place.base[axis] == -1 && place.fraction[axis] >= 0.5f) {
      place.base[axis] = 0;
      place.fraction[axis] = 0;
    } else if (place.base[axis] == last && place.fraction[axis] <= 0.5f) {
      place.fraction[axis] = 0;
    } else if (place.base[axis] < 0 || place.base[axis] >= last) {
      return false;
    }
  }
  return true;
}

/// The type in which values of type V are computed: float where it holds them all exactly, else double.
template <class V>
using Working = std::conditional_t<(sizeof(V) < 4 || std::is_same_v<V, float>), float, double>;

/// The voxels of a source, or of the part of it that is buffered.
template <class V>
struct SourceVoxels {
  const V* voxels;
  glm::i64vec3 size;    ///< size of the whole grid, to which indices are clamped
  glm::i64vec3 begin;   ///< first voxel that is buffered
  glm::i64vec3 stride;  ///< values from a voxel to the next along i, j, k

  TETWARP_HD V at(std::int64_t i, std::int64_t j, std::int64_t k) const {
    return voxels[(i - begin.x) * stride.x + (j - begin.y) * stride.y + (k - begin.z) * stride.z];
  }
};

/// Values from `low` to `high` are no data.
template <class V>
struct Padding {
  bool present;
  V low, high;

  TETWARP_HD bool holds(V value) const { return value >= low && value <= high; }
};

template <class V>
struct Sample {
  Working<V> value;
  bool padded;
};

/// The voxel at floor(x + 0.5) on every axis.
template <class V>
TETWARP_HD V nearest_voxel(const SourceVoxels<V>& source, const Place& place) {
  return source.at(place.base.x + (place.fraction.x >= 0.5f), place.base.y + (place.fraction.y >= 0.5f),
                   place.base.z + (place.fraction.z >= 0.5f));
}

template <class V>
TETWARP_HD Sample<V> sample_nearest(const SourceVoxels<V>& source, const Place& place, const Padding<V>& padding) {
  const V value = nearest_voxel(source, place);
  return {static_cast<Working<V>>(value), padding.present && padding.holds(value)};
}

/// The corner with the largest linear weight; of equal weights the one of lowest index.
template <class V>
TETWARP_HD V heaviest_corner(const SourceVoxels<V>& source, const Place& place) {
  return source.at(place.base.x + (place.fraction.x > 0.5f), place.base.y + (place.fraction.y > 0.5f),
                   place.base.z + (place.fraction.z > 0.5f));
}

/// The sample where linear interpolation would mix padding into tissue: the voxel of largest weight.
template <class V>
TETWARP_HD Sample<V> heaviest_voxel(const SourceVoxels<V>& source, const Place& place) {
  return {static_cast<Working<V>>(heaviest_corner(source, place)), true};
}

/// How a + t (b - a) is rounded, in types that are computed in float.
enum class Lerp {
  separate,  ///< product and sum each rounded
  fused      ///< fma(t, b - a, a): both rounded once
};

template <class W>
TETWARP_INLINE_HD W lerp(Lerp rounding, W t, W a, W b) {
  if constexpr (std::is_same_v<W, float>) {
    if (rounding == Lerp::fused) return std::fma(t, b - a, a);
  }
  return a + t * (b - a);
}

/// Linear interpolation along x, then y, then z, each a + t (b - a). Voxels of weight zero are not read.
template <class V>
TETWARP_HD Sample<V> sample_linear(const SourceVoxels<V>& source, const Place& place, const Padding<V>& padding,
                                   Lerp rounding = Lerp::separate) {
  using W = Working<V>;
  const W tx = static_cast<W>(place.fraction.x), ty = static_cast<W>(place.fraction.y),
          tz = static_cast<W>(place.fraction.z);
  const int nx = place.fraction.x != 0, ny = place.fraction.y != 0, nz = place.fraction.z != 0;
  W along_z[2] = {};
  for (int z = 0; z <= nz; ++z) {
    W along_y[2] = {};
    for (int y = 0; y <= ny; ++y) {
      const V low = source.at(place.base.x, place.base.y + y, place.base.z + z);
      if (padding.present && padding.holds(low)) return heaviest_voxel(source, place);
      along_y[y] = static_cast<W>(low);
      if (nx) {
        const V high = source.at(place.base.x + 1, place.base.y + y, place.base.z + z);
        if (padding.present && padding.holds(high)) return heaviest_voxel(source, place);
        along_y[y] = lerp(rounding, tx, along_y[y], static_cast<W>(high));
      }
    }
    along_z[z] = ny ? lerp(rounding, ty, along_y[0], along_y[1]) : along_y[0];
  }
  return {nz ? lerp(rounding, tz, along_z[0], along_z[1]) : along_z[0], false};
}

/// Catmull-Rom weights of the voxels -1, 0, 1, 2 around a place (Keys 1981 with a = -1/2). At t = 0 only voxel 0 has
/// weight.
template <class W>
struct CubicTaps {
  /// First and last tap with weight, from -1 to 2.
  int first, last;
  W weight[4];  ///< weights of taps -1 to 2
};

template <class W>
TETWARP_HD CubicTaps<W> cubic_taps(float fraction) {
  const W t = static_cast<W>(fraction);
  if (t == 0) return {0, 0, {0, 1, 0, 0}};
  return {-1,
          2,
          {((W(-0.5) * t + W(1)) * t - W(0.5)) * t, (W(1.5) * t - W(2.5)) * t * t + W(1),
           ((W(-1.5) * t + W(2)) * t + W(0.5)) * t, (W(0.5) * t - W(0.5)) * t * t}};
}

TETWARP_HD inline std::int64_t clamp_index(std::int64_t index, std::int64_t size) {
  return index < 0 ? 0 : (index >= size ? size - 1 : index);
}

/// Catmull-Rom interpolation along x, then y, then z, with indices clamped to the grid. Each sum runs from the lowest
/// tap up.
template <class V>
TETWARP_HD Sample<V> sample_cubic(const SourceVoxels<V>& source, const Place& place, const Padding<V>& padding) {
  using W = Working<V>;
  const CubicTaps<W> x = cubic_taps<W>(place.fraction.x), y = cubic_taps<W>(place.fraction.y),
                     z = cubic_taps<W>(place.fraction.z);
  W sum_z = 0;
  for (int k = z.first; k <= z.last; ++k) {
    W sum_y = 0;
    for (int j = y.first; j <= y.last; ++j) {
      W sum_x = 0;
      for (int i = x.first; i <= x.last; ++i) {
        const V value =
            source.at(clamp_index(place.base.x + i, source.size.x), clamp_index(place.base.y + j, source.size.y),
                      clamp_index(place.base.z + k, source.size.z));
        if (padding.present && padding.holds(value)) return heaviest_voxel(source, place);
        const W term = x.weight[i + 1] * static_cast<W>(value);
        sum_x = i == x.first ? term : sum_x + term;
      }
      const W term = y.weight[j + 1] * sum_x;
      sum_y = j == y.first ? term : sum_y + term;
    }
    const W term = z.weight[k + 1] * sum_y;
    sum_z = k == z.first ? term : sum_z + term;
  }
  return {sum_z, false};
}

/// Whether voxels have the same label. NaN is one label.
template <class V>
TETWARP_HD bool is_same_label(V a, V b) {
  if constexpr (std::is_floating_point_v<V>) return a == b || (a != a && b != b);
  return a == b;
}

/// Order of labels; NaN is larger than all others.
template <class V>
TETWARP_HD bool is_smaller_label(V a, V b) {
  if constexpr (std::is_floating_point_v<V>) return a < b || (a == a && b != b);
  return a < b;
}

/// A copy of a voxel of the source.
template <class V>
struct Label {
  V value;
  bool padded;
};

/// The label with the largest sum of weights. Weights are those of linear interpolation: the weight of corner c = x +
/// 2y + 4z is the product of its factors along x, y and z, in this order, in float. Weights of one label are summed
/// from corner 0 up, the largest sum wins, and among equal sums the smallest label. The result has the bits of the
/// first corner with that label.
///
/// Interpolating one 0/1 volume for each label linearly and taking the largest gives the same label. Voxels of weight
/// zero do not count.
template <class V>
TETWARP_HD Label<V> sample_vote(const SourceVoxels<V>& source, const Place& place, const Padding<V>& padding) {
  const glm::vec3& t = place.fraction;
  V label[8];
  bool uniform = true;
  for (int corner = 0; corner < 8; ++corner) {  // without weight: its neighbour, which has some, once more
    label[corner] =
        source.at(place.base.x + ((corner & 1) != 0 && t.x != 0), place.base.y + ((corner & 2) != 0 && t.y != 0),
                  place.base.z + ((corner & 4) != 0 && t.z != 0));
    uniform = uniform && is_same_label(label[corner], label[0]);
    if (padding.present && padding.holds(label[corner])) return {heaviest_corner(source, place), true};
  }
  if (uniform) return {label[0], false};
  const float along_x[2] = {1.0f - t.x, t.x}, along_y[2] = {1.0f - t.y, t.y}, along_z[2] = {1.0f - t.z, t.z};
  float weight[8];
  for (int corner = 0; corner < 8; ++corner)
    weight[corner] = along_x[corner & 1] * along_y[corner >> 1 & 1] * along_z[corner >> 2];
  V winner = label[0];
  float most = 0;
  for (int corner = 0; corner < 8; ++corner) {
    float sum = weight[corner];  // from a later corner of a label it is no larger than from the first
    for (int other = corner + 1; other < 8; ++other)
      sum += is_same_label(label[other], label[corner]) ? weight[other] : 0.0f;
    if (sum > most || (sum == most && is_smaller_label(label[corner], winner))) {
      winner = label[corner];
      most = sum;
    }
  }
  return {winner, false};
}

/// Turns a working value into a voxel value: integers round to nearest, ties to even, and saturate.
template <class V>
TETWARP_HD V to_voxel(Working<V> value, bool* saturated) {
  using W = Working<V>;
  if constexpr (std::is_floating_point_v<V>) {
    // One NaN for all: which payload arithmetic leaves differs between processors.
    return value == value ? static_cast<V>(value) : std::numeric_limits<V>::quiet_NaN();
  } else {
    constexpr W kLowest = static_cast<W>(std::numeric_limits<V>::lowest()),
                kHighest = static_cast<W>(std::numeric_limits<V>::max());
    if (!(value > kLowest - 1)) {  // NaN too: there is none in integers, but a background may be
      *saturated = true;
      return std::numeric_limits<V>::lowest();
    }
    if (value >= kHighest + 1) {
      *saturated = true;
      return std::numeric_limits<V>::max();
    }
    const W rounded = std::rint(value);
    *saturated = rounded < kLowest || rounded > kHighest;
    return rounded < kLowest ? std::numeric_limits<V>::lowest()
                             : (rounded > kHighest ? std::numeric_limits<V>::max() : static_cast<V>(rounded));
  }
}

}  // namespace tetwarp
