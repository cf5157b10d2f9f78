// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/output/coarse_maps.cuh"
#include "deform/core/adjoint.h"

/// What gradients need of the tetrahedra that own voxels: made where a column enters one, or read from a table. For
/// adjoint.cu alone.
namespace tetwarp::cuda_detail {

namespace {

/// A tetrahedron once more. Rarely called, so out of line.
template <class Tetrahedra>
__device__ __noinline__ Tetrahedron again(const Tetrahedra& tetrahedra, std::uint32_t number) {
  return tetrahedra(number).t;
}

/// The maps of tetrahedra, made where a column enters them.
template <bool kIsCoarse, class Tetrahedra>
struct MadeMaps {
  static constexpr bool kCoarse = kIsCoarse;
  using Place = PlaceMap<kCoarse>;
  using Offset = typename Place::Offset;

  Tetrahedra tetrahedra;

  __device__ Place place(std::uint32_t number) const { return Place(tetrahedra(number).t); }
  __device__ Offset offset(const Place& place, std::uint32_t number, const glm::i64vec3& voxel,
                           const glm::i32vec3& signs) const {
    return place.offset(voxel, signs, [&] { return again(tetrahedra, number); });
  }
  __device__ glm::vec3 pull_back(const Place& place, std::uint32_t, const glm::vec3& g) const {
    return place.pull_back(g);
  }
  __device__ WeightMap weight(std::uint32_t number, std::uint32_t (&vertex)[4]) const {
    const NumberedTetrahedron of = tetrahedra(number);
    for (int corner = 0; corner < 4; ++corner) vertex[corner] = of.vertex[corner];
    return WeightMap(of.t);
  }
};

constexpr int kTableQuads = kMapQuads + 5;  ///< groups of four numbers of a record

/// Where a voxel comes from whose owner has no map that may be used, and the gradient there. Rarely called.
template <class Tetrahedra>
__device__ __noinline__ FixedOffset slow_offset(const Tetrahedra& tetrahedra, std::uint32_t number, glm::ivec3 voxel,
                                                glm::i32vec3 signs) {
  return fixed_offset(coarse_u(tetrahedra(number).t, voxel, signs));
}
template <class Tetrahedra>
__device__ __noinline__ glm::vec3 slow_pull_back(const Tetrahedra& tetrahedra, std::uint32_t number, glm::vec3 g) {
  return PlaceMap<true>(tetrahedra(number).t).pull_back(g);
}

/// The maps of the tetrahedra of a coarse field, made once a field: in double they take longer than all else.
///
///     a record    0 ... 2   `map_axis` of each axis, from voxel (0, 0, 0) on; kUnusable in the first
///                 3         origin of the weights                  w: whether float has too few digits for them
///                 4 ... 6   of A, B and C: slopes, and the weight at the origin
///                 7         numbers of the vertices A, B, C and D
template <class Tetrahedra>
struct MapTable {
  static constexpr bool kCoarse = true;
  struct Place {
    int4 axes[kMapQuads];
  };
  using Offset = FixedOffset;

  Tetrahedra tetrahedra;
  int4* records;

  __device__ int4* record(std::uint32_t number) const { return records + std::size_t{number} * kTableQuads; }
  /// Makes the record of a tetrahedron.
  __device__ void make(std::uint32_t number) const {
    const NumberedTetrahedron of = tetrahedra(number);
    const CoarseMap map(of.t);
    int4* const to = record(number);
    for (int axis = 0; axis < kMapQuads; ++axis) to[axis] = map_axis(map, axis);
    if (!is_usable(map, of.t)) to[0].y = kUnusable;
    const WeightMap weight(of.t);
    to[3] = make_int4(weight.origin.x, weight.origin.y, weight.origin.z, weight.is_thin);
    for (int n = 0; n < 3; ++n) {
      to[4 + n] = make_int4(__float_as_int(weight.slope[n].x), __float_as_int(weight.slope[n].y),
                            __float_as_int(weight.slope[n].z), __float_as_int(weight.at_origin[n]));
    }
    to[7] = make_int4(static_cast<int>(of.vertex[0]), static_cast<int>(of.vertex[1]), static_cast<int>(of.vertex[2]),
                      static_cast<int>(of.vertex[3]));
  }

  __device__ Place place(std::uint32_t number) const {
    const int4* const from = record(number);
    return {{__ldg(from), __ldg(from + 1), __ldg(from + 2)}};
  }
  __device__ Offset offset(const Place& place, std::uint32_t number, const glm::i64vec3& voxel,
                           const glm::i32vec3& signs) const {
    const glm::ivec3 at(voxel);
    if (place.axes[0].y == kUnusable) return slow_offset(tetrahedra, number, at, signs);
    return fixed_offset({u_on_axis(place.axes[0], at), u_on_axis(place.axes[1], at), u_on_axis(place.axes[2], at)});
  }
  __device__ glm::vec3 pull_back(const Place& place, std::uint32_t number, const glm::vec3& g) const {
    if (place.axes[0].y == kUnusable) return slow_pull_back(tetrahedra, number, g);
    const auto slopes = [&](int4 axis) {
      return glm::vec3(static_cast<float>(axis.y), static_cast<float>(axis.z), static_cast<float>(axis.w)) * 0x1p-23f;
    };
    const glm::vec3 i = slopes(place.axes[0]), j = slopes(place.axes[1]), k = slopes(place.axes[2]);
    const glm::vec3 steepness[3] = {{i.x, j.x, k.x}, {i.y, j.y, k.y}, {i.z, j.z, k.z}};
    return tetwarp::pull_back(steepness, g);
  }
  __device__ WeightMap weight(std::uint32_t number, std::uint32_t (&vertex)[4]) const {
    const int4* const from = record(number);
    WeightMap map;
    const int4 origin = __ldg(from + 3), vertices = __ldg(from + 7);
    map.origin = {origin.x, origin.y, origin.z};
    map.is_thin = origin.w != 0;
    for (int n = 0; n < 3; ++n) {
      const int4 of = __ldg(from + 4 + n);
      map.slope[n] = {__int_as_float(of.x), __int_as_float(of.y), __int_as_float(of.z)};
      map.at_origin[n] = __int_as_float(of.w);
    }
    vertex[0] = static_cast<std::uint32_t>(vertices.x);
    vertex[1] = static_cast<std::uint32_t>(vertices.y);
    vertex[2] = static_cast<std::uint32_t>(vertices.z);
    vertex[3] = static_cast<std::uint32_t>(vertices.w);
    return map;
  }
};

}  // namespace

}  // namespace tetwarp::cuda_detail
