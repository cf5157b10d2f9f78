// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// The methods that the paper compares, as it describes them: a floating-point test that is closed on all sides, every
// tetrahedron its own box, everything about a voxel computed from nothing. They are what Tetwarp is measured against,
// so they are never improved.
#include <cmath>
#include <cstdint>

#include "bench/paper/fields.h"
#include "bench/paper/inverse.h"
#include "bench/paper/method.h"
#include "deform/core/five_tetrahedra.h"
#include "deform/errors.h"
#include "deform/geometry.h"

namespace tetwarp::bench {

/// Voxels of the volume, vertices of the lattice over it, and voxels from one vertex to the next.
struct Grid {
  int nx, ny, nz;
  int vertices_x, vertices_y, vertices_z;
  int cell_size;

  TETWARP_HD std::int64_t offset(int x, int y, int z) const { return (std::int64_t{z} * ny + y) * nx + x; }
  /// Where a vertex rests, continuous index of the volume.
  TETWARP_HD glm::vec3 rest(int i, int j, int k) const {
    return {static_cast<float>(cell_size * i), static_cast<float>(cell_size * j), static_cast<float>(cell_size * k)};
  }
};

inline Grid make_grid(const Geometry& volume, const Geometry& lattice, std::int64_t cell_size) {
  const glm::ivec3 voxels(volume.size), vertices(lattice.size);
  return {voxels.x, voxels.y, voxels.z, vertices.x, vertices.y, vertices.z, static_cast<int>(cell_size)};
}

/// The paper's struct of a vertex: where it is now, and where it rests (texture coordinates, voxels).
struct CellVertex {
  float x, y, z;
  float tx, ty, tz;
};

/// Whether a point with these coordinates lies in the tetrahedron: closed, in the method's own precision (the paper's
/// test).
template <class Real>
TETWARP_HD bool is_inside(const Barycentric<Real>& at) {
  return at.a >= 0 && at.a <= 1 && at.b >= 0 && at.b <= 1 && at.c >= 0 && at.c <= 1 && at.d >= 0 && at.d <= 1;
}

TETWARP_HD inline std::int16_t to_short(float value) { return static_cast<std::int16_t>(std::rint(value)); }
TETWARP_HD inline std::int16_t to_short(double value) { return static_cast<std::int16_t>(std::rint(value)); }

/// Table 2 (a): Eq. 6 in double. The paper timed it with the inverse computed for every candidate voxel: the method
/// `inverse4x4-double-per-voxel`; as a compiler leaves it, `inverse4x4-double`.
struct Inverse4x4Double {
  using Real = double;
  static constexpr bool kInterpolatesValues = true;
  TETWARP_HD static Barycentric<Real> compute(const Corners<Real>& t, const Point<Real>& p) {
    return barycentric_4x4(t, p);
  }
};
/// Table 2 (b): Eq. 13, about D, in double.
struct Inverse3x3Double {
  using Real = double;
  static constexpr bool kInterpolatesValues = true;
  TETWARP_HD static Barycentric<Real> compute(const Corners<Real>& t, const Point<Real>& p) {
    return barycentric_about_d(t, p);
  }
};
/// Table 2 (c) and Table 3 (a): Eq. 13 in float.
struct Inverse3x3Float {
  using Real = float;
  static constexpr bool kInterpolatesValues = true;
  TETWARP_HD static Barycentric<Real> compute(const Corners<Real>& t, const Point<Real>& p) {
    return barycentric_about_d(t, p);
  }
};
/// Table 3 (b), Algorithm 2: Eq. 13 in float; places are interpolated, not values.
struct Paper {
  using Real = float;
  static constexpr bool kInterpolatesValues = false;
  TETWARP_HD static Barycentric<Real> compute(const Corners<Real>& t, const Point<Real>& p) {
    return barycentric_about_d(t, p);
  }
};

namespace detail {
/// The same value, of which the compiler no longer knows where it comes from.
TETWARP_HD inline float opaque(float value) {
#ifdef __CUDA_ARCH__
  asm volatile("" : "+f"(value));
#else
  asm volatile("" : "+m"(value));
#endif
  return value;
}
}  // namespace detail

template <InverseIn kWhen>
TETWARP_HD CellVertex seen_by_compiler(CellVertex v) {
  if constexpr (kWhen == InverseIn::every_voxel) {
    v.x = detail::opaque(v.x);
    v.y = detail::opaque(v.y);
    v.z = detail::opaque(v.z);
  }
  return v;
}

/// Voxels that the closed box of a tetrahedron holds, first and last; empty where last < first.
struct Candidates {
  int first[3], last[3];

  TETWARP_HD int count(int axis) const { return last[axis] < first[axis] ? 0 : last[axis] - first[axis] + 1; }
};

namespace detail {
TETWARP_HD inline void candidates(float a, float b, float c, float d, int size, int* first, int* last) {
  const float low = fminf(fminf(a, b), fminf(c, d)), high = fmaxf(fmaxf(a, b), fmaxf(c, d));
  const int least = static_cast<int>(std::ceil(low)), most = static_cast<int>(std::floor(high));
  *first = least < 0 ? 0 : least;
  *last = most < size ? most : size - 1;
}
}  // namespace detail

TETWARP_HD inline Candidates candidates(const Grid& grid, const CellVertex& a, const CellVertex& b, const CellVertex& c,
                                        const CellVertex& d) {
  Candidates box;
  detail::candidates(a.x, b.x, c.x, d.x, grid.nx, &box.first[0], &box.last[0]);
  detail::candidates(a.y, b.y, c.y, d.y, grid.ny, &box.first[1], &box.last[1]);
  detail::candidates(a.z, b.z, c.z, d.z, grid.nz, &box.first[2], &box.last[2]);
  return box;
}

/// A vertex of the lattice. `field(i, j, k, rest)` is its displacement, voxels.
template <class Field>
TETWARP_HD CellVertex make_vertex(const Grid& grid, const Field& field, int i, int j, int k) {
  const glm::vec3 rest = grid.rest(i, j, k);
  const glm::vec3 place = deformed_place(rest, field(i, j, k, rest));
  return {place.x, place.y, place.z, rest.x, rest.y, rest.z};
}

template <class Real, InverseIn kWhen>
TETWARP_HD Corners<Real> corners_of(const CellVertex& vertex_a, const CellVertex& vertex_b, const CellVertex& vertex_c,
                                    const CellVertex& vertex_d) {
  const CellVertex a = seen_by_compiler<kWhen>(vertex_a), b = seen_by_compiler<kWhen>(vertex_b),
                   c = seen_by_compiler<kWhen>(vertex_c), d = seen_by_compiler<kWhen>(vertex_d);
  return {{Real(a.x), Real(a.y), Real(a.z)},
          {Real(b.x), Real(b.y), Real(b.z)},
          {Real(c.x), Real(c.y), Real(c.z)},
          {Real(d.x), Real(d.y), Real(d.z)}};
}

/// One fetch at the rest place that the coordinates interpolate (Algorithm 2).
template <class Texture>
TETWARP_HD float fetch_between(const Texture& texture, const Barycentric<float>& at, const CellVertex& a,
                               const CellVertex& b, const CellVertex& c, const CellVertex& d) {
  return texture(at.a * a.tx + at.b * b.tx + at.c * c.tx + at.d * d.tx,
                 at.a * a.ty + at.b * b.ty + at.c * c.ty + at.d * d.ty,
                 at.a * a.tz + at.b * b.tz + at.c * c.tz + at.d * d.tz);
}

/// What one thread does: the cell (i, j, k), five tetrahedra, the voxels in the box of each.
///
/// @param texture  `texture(x, y, z)`: the value at a continuous index, linear, clamped
/// @param write    `write(x, y, z, value)` for every voxel that a tetrahedron contains, as often as that happens
template <class Method, InverseIn kWhen, class Field, class Texture, class Write>
TETWARP_HD void deform_cell(const Grid& grid, int i, int j, int k, const Field& field, const Texture& texture,
                            const Write& write) {
  using Real = typename Method::Real;
  CellVertex corner[8];
  float value[8];
  for (int c = 0; c < 8; ++c) {
    corner[c] = make_vertex(grid, field, i + (c & 1), j + (c >> 1 & 1), k + (c >> 2));
    if constexpr (Method::kInterpolatesValues) value[c] = texture(corner[c].tx, corner[c].ty, corner[c].tz);
  }
  const bool odd = ((i + j + k) & 1) != 0;
  for (int t = 0; t < kTetrahedraPerCell; ++t) {
    const TetrahedronCorners of = tetrahedron_corners(t, odd);
    const CellVertex &a = corner[of.a], &b = corner[of.b], &c = corner[of.c], &d = corner[of.d];
    const Candidates box = candidates(grid, a, b, c, d);
    for (int z = box.first[2]; z <= box.last[2]; ++z) {
      for (int y = box.first[1]; y <= box.last[1]; ++y) {
        for (int x = box.first[0]; x <= box.last[0]; ++x) {
          const Barycentric<Real> at =
              Method::compute(corners_of<Real, kWhen>(a, b, c, d), {Real(x), Real(y), Real(z)});
          if (!is_inside(at)) continue;
          if constexpr (Method::kInterpolatesValues) {
            write(x, y, z, at.a * value[of.a] + at.b * value[of.b] + at.c * value[of.c] + at.d * value[of.d]);
          } else {
            write(x, y, z, fetch_between(texture, at, a, b, c, d));
          }
        }
      }
    }
  }
}

/// Calls `run.template operator()<M, kWhen>()` with what a method of one thread a cell is made of.
template <class Run>
void with_cell_method(Method method, const Run& run) {
  constexpr InverseIn kCompiled = InverseIn::loop_as_compiled, kEvery = InverseIn::every_voxel;
  switch (method) {
    case Method::inverse4x4_double: return run.template operator()<Inverse4x4Double, kCompiled>();
    case Method::inverse3x3_double: return run.template operator()<Inverse3x3Double, kCompiled>();
    case Method::inverse3x3_float: return run.template operator()<Inverse3x3Float, kCompiled>();
    case Method::paper: return run.template operator()<Paper, kCompiled>();
    case Method::inverse4x4_double_per_voxel: return run.template operator()<Inverse4x4Double, kEvery>();
    case Method::inverse3x3_double_per_voxel: return run.template operator()<Inverse3x3Double, kEvery>();
    case Method::inverse3x3_float_per_voxel: return run.template operator()<Inverse3x3Float, kEvery>();
    case Method::paper_per_voxel: return run.template operator()<Paper, kEvery>();
    default: throw InputError(name_of(method) + " is no baseline of one thread a cell");
  }
}

/// `gascon`: one of the threads that share a tetrahedron takes every `step`-th voxel of its box, from `first` on.
template <InverseIn kWhen, class Texture, class Write>
TETWARP_HD void walk_tetrahedron(const Grid& grid, const CellVertex (&t)[4], std::int64_t first, std::int64_t step,
                                 const Texture& texture, const Write& write) {
  const Candidates box = candidates(grid, t[0], t[1], t[2], t[3]);
  const int nx = box.count(0), ny = box.count(1), nz = box.count(2);
  const std::int64_t count = std::int64_t{nx} * ny * nz;
  for (std::int64_t n = first; n < count; n += step) {
    const int voxel = static_cast<int>(n);
    const int x = box.first[0] + voxel % nx, y = box.first[1] + voxel / nx % ny, z = box.first[2] + voxel / (nx * ny);
    const Barycentric<float> at =
        barycentric_about_d(corners_of<float, kWhen>(t[0], t[1], t[2], t[3]), {float(x), float(y), float(z)});
    if (is_inside(at)) write(x, y, z, fetch_between(texture, at, t[0], t[1], t[2], t[3]));
  }
}

/// Vertex `which` (A, B, C, D) of tetrahedron t of a cell.
template <class Field>
TETWARP_HD CellVertex make_tetrahedron_vertex(const Grid& grid, const Field& field, int i, int j, int k, int t,
                                              int which) {
  const TetrahedronCorners of = tetrahedron_corners(t, ((i + j + k) & 1) != 0);
  const int c = which == 0 ? of.a : (which == 1 ? of.b : (which == 2 ? of.c : of.d));
  return make_vertex(grid, field, i + (c & 1), j + (c >> 1 & 1), k + (c >> 2));
}

/// Field source `kernel`: every thread evaluates the formula for its vertices (the paper's set-up).
struct FormulaField {
  Formula formula;

  TETWARP_HD glm::vec3 operator()(int, int, int, const glm::vec3& rest) const { return displacement_at(formula, rest); }
};

/// Field source `memory`: displacements of all vertices, i fastest, voxels, 12 bytes each.
struct MemoryField {
  const glm::vec3* displacement;
  int vertices_x, vertices_y;

  TETWARP_HD glm::vec3 operator()(int i, int j, int k, const glm::vec3&) const {
    return displacement[(std::int64_t{k} * vertices_y + j) * vertices_x + i];
  }
};

}  // namespace tetwarp::bench
