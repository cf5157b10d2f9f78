// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/lattice/step_pass.cuh"
#include "deform/core/barycentric.h"

/// The volumes of the tetrahedra of a lattice: those around an even vertex, and the centres of cells. For step_pass.cu
/// alone.
///
/// Volumes are six times the deformed volume of a tetrahedron, in steps of 2^-12 voxel, and have the sign of the
/// undeformed tetrahedron taken out: a tetrahedron is inverted where its volume is negative. Float says so where the
/// volume is larger than a bound of its rounding errors; where it is not, the volume is computed once more with the
/// sign that it certainly has.
///
///     around an even vertex v: eight corner         within an even cell: the centre, between the
///     tetrahedra, one in each octant, with an       corners 1, 2, 4, 7, which are odd vertices
///     edge up or down along i, j and k
///
///               +k  +j                                          6-------(7)
///                | /                                           /|       /|
///         -i ----v---- +i                                   (4)-------5  |
///              / |                                            | |      | |
///            -j  -k                                           |(2)-----|-3
///                                                             |/       |/
///     They share cross products: four for eight volumes.      0-------(1)
namespace tetwarp::cuda_detail {

namespace {

/// What is seen of tetrahedra of one kind: their volumes, the sign of the undeformed ones taken out. They share their
/// rest volume, so the division waits.
struct Seen {
  float least = INFINITY, most = -INFINITY;
  unsigned inverted = 0, degenerate = 0;

  __device__ void add(float volume) {
    least = fminf(least, volume);
    most = fmaxf(most, volume);
  }
  __device__ void add(const Seen& other) {
    least = fminf(least, other.least);
    most = fmaxf(most, other.most);
    inverted += other.inverted;
    degenerate += other.degenerate;
  }
};

/// The volume with the sign that it certainly has.
__device__ void add_exactly(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, float turn, Seen& seen) {
  const float volume = detail::edge_determinant(a, b, c) * turn + 0.0f;  // never -0
  seen.add(volume);
  seen.degenerate += volume == 0;
  seen.inverted += volume < 0;
}

/// Three pairs of edges from a vertex, up and down.
struct Edges {
  glm::vec3 x[2], y[2], z[2];
};

/// The corner tetrahedra around an even vertex one by one; those that the lattice has. Out of line, with everything by
/// value, so that nothing of it weighs on the common case.
__device__ __noinline__ Seen around_exactly(const StepPass& pass, glm::ivec3 at, Edges edges) {
  Seen seen;
  const glm::ivec3& cells = pass.lattice.cells;
#pragma unroll 1
  for (int n = 0; n < 8; ++n) {
    const glm::ivec3 down(n & 1, n >> 1 & 1, n >> 2), cell = at - down;
    if (cell.x < 0 || cell.y < 0 || cell.z < 0 || cell.x >= cells.x || cell.y >= cells.y || cell.z >= cells.z) continue;
    const float turn = ((down.x ^ down.y ^ down.z) & 1) != 0 ? -1.0f : 1.0f;
    add_exactly(edges.x[down.x], edges.y[down.y], edges.z[down.z], turn, seen);
  }
  return seen;
}

/// The tetrahedron in the centre of a cell, out of line as `around_exactly` is.
__device__ __noinline__ Seen centre_exactly(glm::vec3 a, glm::vec3 b, glm::vec3 c, float turn) {
  Seen seen;
  add_exactly(a, b, c, turn, seen);
  return seen;
}

constexpr float kError = 8.0f / (1 << 24);  ///< that of `detail::edge_determinant`

/// Six times a signed volume, in two ways: as the Jacobian determinant is defined, and fused, where only its sign
/// counts.
template <bool kRange>
struct VolumeArithmetic;
template <>
struct VolumeArithmetic<true> {
  __device__ static detail::Cross cross(const glm::vec3& a, const glm::vec3& b) { return detail::cross(a, b); }
  __device__ static float dot(const glm::vec3& a, const detail::Cross& n) { return detail::dot(a, n); }
};
template <>
struct VolumeArithmetic<false> {
  __device__ static detail::Cross cross(const glm::vec3& a, const glm::vec3& b) {
    return {fmaf(a.y, b.z, -(a.z * b.y)), fmaf(a.z, b.x, -(a.x * b.z)), fmaf(a.x, b.y, -(a.y * b.x))};
  }
  __device__ static float dot(const glm::vec3& a, const detail::Cross& n) {
    return fmaf(a.z, n.z, fmaf(a.y, n.y, a.x * n.x));
  }
};

/// The eight corner tetrahedra around an even vertex.
template <bool kRange>
struct Around {
  float volumes[8], least = INFINITY, bound;

  __device__ explicit Around(const Edges& edges) {
    const auto both = [](const glm::vec3(&e)[2]) { return detail::norm1(e[0]) + detail::norm1(e[1]); };
    bound = kError * ((both(edges.x) * both(edges.y)) * both(edges.z));
#pragma unroll
    for (int n = 0; n < 4; ++n) {
      const detail::Cross normal = VolumeArithmetic<kRange>::cross(edges.y[n & 1], edges.z[n >> 1]);
      const float sign = (n & 1) != n >> 1 ? -1.0f : 1.0f;
      volumes[2 * n] = sign * VolumeArithmetic<kRange>::dot(edges.x[0], normal);
      volumes[2 * n + 1] = -sign * VolumeArithmetic<kRange>::dot(edges.x[1], normal);
      least = fminf(least, fminf(volumes[2 * n], volumes[2 * n + 1]));
    }
  }
  __device__ bool is_upright() const { return least > bound; }
  __device__ void add_range(Seen& seen) const {
    seen.least = fminf(seen.least, least);
#pragma unroll
    for (const float volume : volumes) seen.most = fmaxf(seen.most, volume);
  }
  /// @param has_all  whether the lattice has all of them
  __device__ void add(const StepPass& pass, const glm::ivec3& at, bool has_all, const Edges& edges, Seen& seen) const {
    float nearest = INFINITY;
    unsigned inverted = 0;
#pragma unroll
    for (const float volume : volumes) {
      nearest = fminf(nearest, fabsf(volume));
      inverted += volume < 0;
    }
    if (!(has_all && nearest > bound)) return seen.add(around_exactly(pass, at, edges));
    seen.inverted += inverted;
    if (kRange) add_range(seen);
  }
};

/// The centre of a cell: D is an even cell's last corner, and A, B, C are beside its first; in an odd one it is the
/// other way round.
template <bool kRange, bool kEvenCell>
struct Centre {
  glm::vec3 a, b, c;  ///< from D
  float volume, bound;

  /// @param a, b, c, d  how far the corners moved
  __device__ Centre(const StepPass& pass, const glm::vec3& to_a, const glm::vec3& to_b, const glm::vec3& to_c,
                    const glm::vec3& d)
      : a(to_a - d), b(to_b - d), c(to_c - d) {
    using detail::norm1;
    const glm::vec3 to = kEvenCell ? -pass.lattice.cell : pass.lattice.cell;
    a.y += to.y;
    a.z += to.z;
    b.x += to.x;
    b.z += to.z;
    c.x += to.x;
    c.y += to.y;
    const float determinant = VolumeArithmetic<kRange>::dot(a, VolumeArithmetic<kRange>::cross(b, c));
    volume = kEvenCell ? -determinant : determinant;
    bound = kError * ((norm1(a) * norm1(b)) * norm1(c));
  }
  __device__ bool is_upright() const { return volume > bound; }
  __device__ void add(Seen& seen) const {
    if (fabsf(volume) > bound) {
      if (kRange) seen.add(volume);
      seen.inverted += volume < 0;
    } else {
      seen.add(centre_exactly(a, b, c, kEvenCell ? -1.0f : 1.0f));
    }
  }
};

}  // namespace

}  // namespace tetwarp::cuda_detail
