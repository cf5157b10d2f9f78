// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/lattice/slab.cuh"

namespace tetwarp::cuda_detail {

constexpr int kMapQuads = 3;  ///< groups of four numbers of a map in shared memory

/// Writes the map of a tetrahedron of a coarse field as shared memory has it, one group of four numbers an axis:
///
///     U at the first voxel of the tile    slope along i    slope along j    slope along k      all modulo 2^32
///
/// @param first  voxel of the tile, counted as the map's origin is
/// @return whether it is usable
__device__ inline bool put_map(const CoarseMap& map, const glm::ivec3& first, float4* quads) {
  const glm::i64vec3 u = map.u(first);
  const auto bits = [](std::int64_t n) { return __int_as_float(static_cast<int>(n)); };
#pragma unroll
  for (int axis = 0; axis < 3; ++axis)
    quads[axis] =
        make_float4(bits(u[axis]), bits(map.slope[0][axis]), bits(map.slope[1][axis]), bits(map.slope[2][axis]));
  return !map.is_thin;
}

/// The map of the tetrahedron in which the lane's voxel lies, in registers.
struct HeldMap {
  int values[4 * kMapQuads];
  unsigned usable;

  /// Reads the map of a slot, unless it is the one that is held.
  template <int kQuadsOfSlot>
  __device__ void hold(const float4 (*prepared)[kQuadsOfSlot], const unsigned* usables, unsigned slot, unsigned& held) {
    int(&v)[4 * kMapQuads] = values;
    const auto from = static_cast<unsigned>(__cvta_generic_to_shared(&prepared[slot][0])),
               end = static_cast<unsigned>(__cvta_generic_to_shared(&usables[slot]));
    asm volatile(
        "{\n\t"
        ".reg .pred p;\n\t"
        "setp.ne.u32 p, %13, %14;\n\t"
        "@p ld.shared.v4.u32 {%0, %1, %2, %3}, [%15];\n\t"
        "@p ld.shared.v4.u32 {%4, %5, %6, %7}, [%15+16];\n\t"
        "@p ld.shared.v4.u32 {%8, %9, %10, %11}, [%15+32];\n\t"
        "@p ld.shared.u32 %12, [%16];\n\t"
        "}"
        : "+r"(v[0]), "+r"(v[1]), "+r"(v[2]), "+r"(v[3]), "+r"(v[4]), "+r"(v[5]), "+r"(v[6]), "+r"(v[7]), "+r"(v[8]),
          "+r"(v[9]), "+r"(v[10]), "+r"(v[11]), "+r"(usable)
        : "r"(slot), "r"(held), "r"(from), "r"(end));
    held = slot;
  }
};

/// The maps of the tetrahedra of a tile of a coarse field, in shared memory. The last one is for voxels without an
/// owner. `sample_column` takes them.
template <int kQuadsOfSlot>
struct CoarseMaps {
  using Held = HeldMap;
  using From = glm::ivec3;  ///< from the first voxel of the tile, voxels

  const float4 (*prepared)[kQuadsOfSlot];
  const unsigned* usable;
  unsigned nobody;  ///< number that stands for no owner, as do all larger numbers

  __device__ void hold(unsigned slot, HeldMap& m, unsigned& held) const {
    m.hold(prepared, usable, min(slot, nobody), held);
  }
  __device__ static From from(const glm::ivec3& in_tile) { return in_tile; }
  __device__ static void step(From& from) { ++from.z; }
  __device__ static FixedU moved(const HeldMap& m, const From& from) {
    FixedU of;
#pragma unroll
    for (int axis = 0; axis < 3; ++axis) {
      const auto at = [&](int n) { return static_cast<unsigned>(m.values[4 * axis + n]); };
      of.u[axis] = static_cast<int>(at(0) + at(1) * static_cast<unsigned>(from.x) +
                                    at(2) * static_cast<unsigned>(from.y) + at(3) * static_cast<unsigned>(from.z));
    }
    of.any = m.usable != 0;
    return of;
  }
  __device__ static bool is_any(const FixedU& of) { return of.any; }
  __device__ static FixedOffset offset(const FixedU& of) { return of.offset(); }
};

}  // namespace tetwarp::cuda_detail
