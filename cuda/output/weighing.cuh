// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <limits>

#include "deform/core/gather.h"

namespace tetwarp::cuda_detail {

/// What the voxels of a tetrahedron need, in the layout of shared memory: factors of their weights by Cramer's rule,
/// and the displacement of the vertices. Six groups of four floats, which a lane reads with one instruction each, and
/// one more float, in an array of its own:
///
///     0    from_d.x    from_d.y    from_d.z    reciprocal
///     1    bc.x        bc.y        bc.z        moved.x
///     2    ca.x        ca.y        ca.z        moved.y
///     3    ab.x        ab.y        ab.z        moved.z
///     4    moved_a.x   moved_a.y   moved_a.z   moved_b.x
///     5    moved_b.y   moved_b.z   moved_c.x   moved_c.y
///     end  moved_c.z
///
/// The weight of A at r is (r . bc) reciprocal, where r is the way from D; of B and C with ca and ab.
struct Weighing {
  float from_d[3];   ///< from D to the first voxel of the tile, 2^-12 voxel
  float reciprocal;  ///< of the determinant; NaN where float cannot compute the weights
  float bc[3], moved_x, ca[3], moved_y, ab[3], moved_z;
  float moved_a[3], moved_b[3], moved_c[3];
};
constexpr int kQuads = 6;  ///< number of groups of four floats that Weighing fills
static_assert(sizeof(Weighing) == (4 * kQuads + 1) * sizeof(float));

constexpr float kNoNumber = std::numeric_limits<float>::quiet_NaN();

/// Displacement of the vertices of a tetrahedron, 2^-12 voxel: of D, and by how much those of A, B, C exceed it.
struct Displaced {
  glm::vec3 d, a, b, c;
};

/// Computes a `Weighing`. All arguments are exact.
/// @param a, b, c  edges from D, 2^-12 voxel
/// @param from_d   from D to the first voxel of the tile, 2^-12 voxel
__device__ inline void prepare_weighing(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c,
                                        const glm::vec3& from_d, const Displaced& moved, float4 (&to)[kQuads],
                                        float& end) {
  const Cramer m(a, b, c);
  const float s = (detail::norm1(a) + detail::norm1(b)) + detail::norm1(c);
  const bool usable = detail::magnitude(m.det) > s * s * detail::multiply_add(detail::kThinSum, s, detail::kSlackSum);
  const auto cross = [](const detail::Cross& v, float w) { return make_float4(v.x, v.y, v.z, w); };
  to[0] = make_float4(from_d.x, from_d.y, from_d.z, usable ? detail::reciprocal(m.det) : kNoNumber);
  to[1] = cross(m.bc, moved.d.x);
  to[2] = cross(m.ca, moved.d.y);
  to[3] = cross(m.ab, moved.d.z);
  to[4] = make_float4(moved.a.x, moved.a.y, moved.a.z, moved.b.x);
  to[5] = make_float4(moved.b.y, moved.b.z, moved.c.x, moved.c.y);
  end = moved.c.z;
}

/// The `Weighing` of the tetrahedron in which the lane's voxel lies, in registers.
struct HeldWeighing {
  float values[4 * kQuads + 1];

  /// Reads the weighing of a slot, unless it is the one that is held.
  __device__ void hold(const float4 (*prepared)[kQuads], const float* ends, unsigned slot, unsigned& held) {
    float(&v)[4 * kQuads + 1] = values;
    const auto from = static_cast<unsigned>(__cvta_generic_to_shared(&prepared[slot][0])),
               end = static_cast<unsigned>(__cvta_generic_to_shared(&ends[slot]));
    asm volatile(
        "{\n\t"
        ".reg .pred p;\n\t"
        "setp.ne.u32 p, %25, %26;\n\t"
        "@p ld.shared.v4.f32 {%0, %1, %2, %3}, [%27];\n\t"
        "@p ld.shared.v4.f32 {%4, %5, %6, %7}, [%27+16];\n\t"
        "@p ld.shared.v4.f32 {%8, %9, %10, %11}, [%27+32];\n\t"
        "@p ld.shared.v4.f32 {%12, %13, %14, %15}, [%27+48];\n\t"
        "@p ld.shared.v4.f32 {%16, %17, %18, %19}, [%27+64];\n\t"
        "@p ld.shared.v4.f32 {%20, %21, %22, %23}, [%27+80];\n\t"
        "@p ld.shared.f32 %24, [%28];\n\t"
        "}"
        : "+f"(v[0]), "+f"(v[1]), "+f"(v[2]), "+f"(v[3]), "+f"(v[4]), "+f"(v[5]), "+f"(v[6]), "+f"(v[7]), "+f"(v[8]),
          "+f"(v[9]), "+f"(v[10]), "+f"(v[11]), "+f"(v[12]), "+f"(v[13]), "+f"(v[14]), "+f"(v[15]), "+f"(v[16]),
          "+f"(v[17]), "+f"(v[18]), "+f"(v[19]), "+f"(v[20]), "+f"(v[21]), "+f"(v[22]), "+f"(v[23]), "+f"(v[24])
        : "r"(slot), "r"(held), "r"(from), "r"(end));
    held = slot;
  }
};

/// Deformed minus undeformed place of a voxel, 2^-12 voxel; NaN where float cannot compute its weights, or the voxel
/// has no owner.
/// @param from_first  from the first voxel of the tile, 2^-12 voxel
__device__ inline glm::vec3 moved_by(const HeldWeighing& m, const glm::vec3& from_first) {
  const float(&v)[4 * kQuads + 1] = m.values;
  const float x = from_first.x + v[0], y = from_first.y + v[1], z = from_first.z + v[2];
  const auto weight = [&](int n) { return ((x * v[n] + y * v[n + 1]) + z * v[n + 2]) * v[3]; };
  return blend({weight(4), weight(8), weight(12)}, {v[7], v[11], v[15]}, {v[16], v[17], v[18]}, {v[19], v[20], v[21]},
               {v[22], v[23], v[24]});
}

/// The weighings of the tetrahedra of a tile of a dense field, in shared memory. The last one is for voxels without an
/// owner. `sample_column` takes them.
struct Weighings {
  using Held = HeldWeighing;
  using From = glm::vec3;  ///< from the first voxel of the tile, 2^-12 voxel

  const float4 (*prepared)[kQuads];
  const float* ends;
  unsigned nobody;  ///< number that stands for no owner, as do all larger numbers

  __device__ void hold(unsigned slot, HeldWeighing& m, unsigned& held) const {
    m.hold(prepared, ends, min(slot, nobody), held);
  }
  __device__ static From from(const glm::ivec3& in_tile) { return glm::vec3(in_tile * kStepsPerVoxel); }
  __device__ static void step(From& from) { from.z += float{kStepsPerVoxel}; }
  __device__ static glm::vec3 moved(const HeldWeighing& m, const From& from) { return moved_by(m, from); }
};

}  // namespace tetwarp::cuda_detail
