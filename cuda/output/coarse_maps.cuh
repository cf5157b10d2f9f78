// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/lattice/slab.cuh"

namespace tetwarp::cuda_detail {

constexpr int kMapQuads = 3;  ///< groups of four numbers of a map
/// The first slope of a map in a table that is not to be used; others are smaller than 2^30.
constexpr int kUnusable = INT32_MIN;

/// One axis of the map of a tetrahedron of a coarse field, from some voxel on:
///
///     U at that voxel    slope along i    slope along j    slope along k      all modulo 2^32
///
/// U on an axis. @param from  from that voxel
__device__ inline int u_on_axis(const int4& m, const glm::ivec3& from) {
  return static_cast<int>(static_cast<unsigned>(m.x) + static_cast<unsigned>(m.y) * static_cast<unsigned>(from.x) +
                          static_cast<unsigned>(m.z) * static_cast<unsigned>(from.y) +
                          static_cast<unsigned>(m.w) * static_cast<unsigned>(from.z));
}
/// An axis from voxel (0, 0, 0) on.
__device__ inline int4 map_axis(const CoarseMap& map, int axis) {
  int4 of =
      make_int4(static_cast<int>(map.at_origin[axis]), map.slope[0][axis], map.slope[1][axis], map.slope[2][axis]);
  of.x = u_on_axis(of, -map.origin);
  return of;
}
/// Whether a map is to be used: it is not thin, and 32 bits hold U.
__device__ inline bool is_usable(const CoarseMap& map, const Tetrahedron& t) {
  bool usable = !map.is_thin;
  for (const Vertex* v : {&t.a, &t.b, &t.c, &t.d}) {
#pragma unroll
    for (int axis = 0; axis < 3; ++axis) usable &= v->u[axis] > -kFarForInt32 && v->u[axis] < kFarForInt32;
  }
  return usable;
}

/// The map of the tetrahedron in which the lane's voxel lies, in registers.
struct HeldMap {
  int values[4 * kMapQuads];
  unsigned usable;

  /// Reads the map of a slot, unless it is the one that is held.
  __device__ void hold(const float4 (*prepared)[kMapQuads], unsigned slot, unsigned& held) {
    int(&v)[4 * kMapQuads] = values;
    const auto from = static_cast<unsigned>(__cvta_generic_to_shared(&prepared[slot][0]));
    asm volatile(
        "{\n\t"
        ".reg .pred p;\n\t"
        "setp.ne.u32 p, %12, %13;\n\t"
        "@p ld.shared.v4.u32 {%0, %1, %2, %3}, [%14];\n\t"
        "@p ld.shared.v4.u32 {%4, %5, %6, %7}, [%14+16];\n\t"
        "@p ld.shared.v4.u32 {%8, %9, %10, %11}, [%14+32];\n\t"
        "}"
        : "+r"(v[0]), "+r"(v[1]), "+r"(v[2]), "+r"(v[3]), "+r"(v[4]), "+r"(v[5]), "+r"(v[6]), "+r"(v[7]), "+r"(v[8]),
          "+r"(v[9]), "+r"(v[10]), "+r"(v[11])
        : "r"(slot), "r"(held), "r"(from));
    held = slot;
  }
  /// The same, and whether it is usable.
  __device__ void hold(const float4 (*prepared)[kMapQuads], const unsigned* usables, unsigned slot, unsigned& held) {
    const auto from = static_cast<unsigned>(__cvta_generic_to_shared(&usables[slot]));
    asm volatile(
        "{\n\t"
        ".reg .pred p;\n\t"
        "setp.ne.u32 p, %1, %2;\n\t"
        "@p ld.shared.u32 %0, [%3];\n\t"
        "}"
        : "+r"(usable)
        : "r"(slot), "r"(held), "r"(from));
    hold(prepared, slot, held);
  }
};

/// The maps of the tetrahedra of a tile of a coarse field, in shared memory. The last one is for voxels without an
/// owner. `sample_column` takes them.
/// @tparam kAllUsable  whether all voxels have owners with usable maps
template <bool kAllUsable>
struct CoarseMaps {
  using Held = HeldMap;
  using From = glm::ivec3;  ///< from the first voxel of the tile, voxels

  const float4 (*prepared)[kMapQuads];
  const unsigned* usable;

  __device__ void hold(unsigned slot, HeldMap& m, unsigned& held) const {
    if constexpr (kAllUsable) {
      m.hold(prepared, slot, held);
    } else {
      m.hold(prepared, usable, slot, held);
    }
  }
  __device__ static From from(const glm::ivec3& in_tile) { return in_tile; }
  __device__ static void step(From& from) { ++from.z; }
  __device__ static FixedU moved(const HeldMap& m, const From& from) {
    FixedU of;
#pragma unroll
    for (int axis = 0; axis < 3; ++axis) {
      const int* v = m.values + 4 * axis;
      of.u[axis] = u_on_axis(make_int4(v[0], v[1], v[2], v[3]), from);
    }
    of.any = kAllUsable || m.usable != 0;
    return of;
  }
};

}  // namespace tetwarp::cuda_detail
