// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/output/coarse_maps.cuh"
#include "deform/core/coarse_map.h"
#include "deform/core/step_lattice.h"

/// The maps of all tetrahedra of a coarse lattice, made once a field, so that a march reads them: in double they take
/// longer than all else that it does. For gather.cu alone.
namespace tetwarp::cuda_detail {

namespace {

/// Entries of a table: ten for two vertices that follow one another, of which one is even and one odd. Eight are the
/// tetrahedra whose D is the even one, by the directions of A, B and C; two are the centres whose D is the odd one.
///
///     entry        10 pair + 0 ... 7       the even vertex: 1 if A lies down, plus 2 if B does, plus 4 if C does
///                  10 pair + 8, + 9        the odd vertex: the centre down from it, and up
///     an entry     `map_axis` of each axis, from voxel (0, 0, 0) on
constexpr int kEntriesOfPair = 10;

/// An entry, in registers.
struct TableMap {
  int4 axes[kMapQuads];

  __device__ FixedU u(const glm::ivec3& voxel) const {
    FixedU of;
#pragma unroll
    for (int axis = 0; axis < 3; ++axis) of.u[axis] = u_on_axis(axes[axis], voxel);
    of.any = axes[0].y != kUnusable;
    return of;
  }
};

__device__ TableMap read_map(const int4* maps, const FloatTetrahedron& t) {
  const unsigned x = __float_as_uint(t.to.x) >> 31, y = __float_as_uint(t.to.y) >> 31,
                 z = __float_as_uint(t.to.z) >> 31;
  const unsigned which = t.centre ? 9 - x : x + 2 * y + 4 * z;
  const int4* entry = maps + (static_cast<unsigned>(t.offset >> 1) * kEntriesOfPair + which) * kMapQuads;
  return {{__ldg(entry), __ldg(entry + 1), __ldg(entry + 2)}};
}

/// How many entries a lattice has.
inline std::int64_t entries_of(const StepLattice& lattice) {
  const std::int64_t vertices = std::int64_t{lattice.slice} * (lattice.cells.z + 1);
  return (vertices + 1) / 2 * kEntriesOfPair;
}

/// Makes the maps of a lattice: a thread an entry. Entries of tetrahedra that the lattice does not have are not
/// written.
///
/// @param entries  how many  @param maps  written, kMapQuads for each
__global__ void map_table_kernel(const __grid_constant__ StepLattice lattice, std::int64_t entries, int4* maps) {
  const std::int64_t n = thread_of_grid();
  if (n >= entries) return;
  const int first = static_cast<int>(n / kEntriesOfPair) * 2, which = static_cast<int>(n % kEntriesOfPair);
  const auto vertex = [&](int number) {
    return glm::ivec3(number % lattice.row, number % lattice.slice / lattice.row, number / lattice.slice);
  };
  const glm::ivec3 one = vertex(first);
  const bool is_odd = ((one.x + one.y + one.z) & 1) != 0, centre = which >= 8;
  const glm::ivec3 d = is_odd == centre ? one : vertex(first + 1);
  const LatticeTetrahedron t = centre ? LatticeTetrahedron{d, glm::ivec3(9 - which), true}
                                      : LatticeTetrahedron{d, {which & 1, which >> 1 & 1, which >> 2}, false};
  const glm::ivec3 cell = t.cell();
  if (cell.x < 0 || cell.y < 0 || cell.z < 0 || cell.x >= lattice.cells.x || cell.y >= lattice.cells.y ||
      cell.z >= lattice.cells.z) {
    return;
  }
  const Tetrahedron of = vertices_of(lattice, t);
  const CoarseMap map(of);
  int4* entry = maps + n * kMapQuads;
#pragma unroll
  for (int axis = 0; axis < 3; ++axis) entry[axis] = map_axis(map, axis);
  if (!is_usable(map, of)) entry[0].y = kUnusable;
}

}  // namespace

}  // namespace tetwarp::cuda_detail
