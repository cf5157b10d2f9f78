#pragma once

#include "deform/core/five_tetrahedra.h"

namespace tetwarp {

/// A lattice along the axes of the output grid, whose undeformed vertices lie at whole steps: what a gather reads.
///
/// Lattices over a volume with cells of B voxels are such. All that is held of a vertex is how far it moved, as whole
/// numbers in float: exact below 2^24 steps (4096 voxels), and a difference of two needs no conversion.
struct StepLattice {
  glm::ivec3 cells{0};               ///< on each axis
  glm::vec3 first{0}, cell{0};       ///< rest place of vertex (0, 0, 0), and from one vertex to the next; 2^-12 voxel
  glm::vec3 voxel{0};                ///< one voxel, in cells
  glm::ivec3 last{0};                ///< cell
  int row = 0, slice = 0;            ///< vertices from one row, and one slice, to the next
  const glm::vec3* moved = nullptr;  ///< deformed minus rest of each vertex, 2^-12 voxel, i fastest, 12 bytes each

  TETWARP_HD std::int64_t offset(const glm::ivec3& vertex) const {
    return std::int64_t{vertex.z} * slice + vertex.y * row + vertex.x;
  }
  TETWARP_HD Vertex vertex(const glm::ivec3& at) const {
    const glm::vec3 rest = first + glm::vec3(at) * cell, by = moved[offset(at)];
    return {glm::ivec3(rest + by), glm::ivec3(-by)};
  }
  /// The deformed place of a vertex alone.
  TETWARP_HD glm::i32vec3 deformed(const glm::ivec3& at) const {
    const int n = at.z * slice + at.y * row + at.x;  // make_step_lattice: fewer than 2^31
    return glm::i32vec3(first) + at * glm::i32vec3(cell) + glm::i32vec3(moved[n]);
  }
  /// The lattice index of an undeformed voxel.
  TETWARP_HD glm::vec3 place(const glm::vec3& voxel_index) const {
    return (voxel_index * float{kStepsPerVoxel} - first) * (voxel * (1.0f / kStepsPerVoxel));
  }
};

/// One tetrahedron of the lattice, by its corner D.
///
/// With alternating parity the corner tetrahedra are octahedra around the even vertices (i + j + k even): D is an even
/// vertex, and A, B, C are its neighbours along i, j, k, up or down. What is left in each cell is its centre, with odd
/// vertices only: D is the cell's corner 7 (even cells; all directions down) or 0 (odd cells; up), and A, B, C are
/// across the faces i, j, k from it. So vertex, three directions and one flag name a tetrahedron, and a step across a
/// face that D lies on turns one direction round.
struct LatticeTetrahedron {
  glm::ivec3 d;     ///< vertex
  glm::ivec3 down;  ///< 1 where A, B, C lie down from D on that axis, else 0
  bool centre;

  TETWARP_HD glm::ivec3 direction() const { return 1 - 2 * down; }
  TETWARP_HD glm::ivec3 cell() const { return d - down; }
  TETWARP_HD glm::ivec3 a() const { return corner(0); }
  TETWARP_HD glm::ivec3 b() const { return corner(1); }
  TETWARP_HD glm::ivec3 c() const { return corner(2); }

  /// The centre tetrahedron of a cell.
  TETWARP_HD static LatticeTetrahedron centre_of(const glm::ivec3& cell) {
    const int even = (cell.x + cell.y + cell.z + 1) & 1;
    return {cell + even, glm::ivec3(even), true};
  }

  /// The tetrahedron of a cell with this number, 0 to 4 (`tetrahedron_corners`).
  TETWARP_HD static LatticeTetrahedron of_cell(const glm::ivec3& cell, int number) {
    if (number == 0) return centre_of(cell);
    const int corner = tetrahedron_corners(number, ((cell.x + cell.y + cell.z) & 1) != 0).d;
    const glm::ivec3 down(corner & 1, corner >> 1 & 1, corner >> 2);
    return {cell + down, down, false};
  }

  /// The tetrahedron across the face opposite A, B, C or D (face 0 to 3). Its cell may lie outside the lattice.
  TETWARP_HD LatticeTetrahedron across(int face) const {
    if (!centre) {
      if (face == 3) return centre_of(cell());
      LatticeTetrahedron next = *this;
      next.down[face] ^= 1;
      return next;
    }
    const glm::ivec3 towards = direction();
    if (face == 3) return {d + towards, 1 - down, false};
    LatticeTetrahedron next{d, down, false};
    next.d[face] += towards[face];
    next.down[face] ^= 1;
    return next;
  }

  /// 0 to 4 within its cell (`tetrahedron_corners`).
  TETWARP_HD int number() const {
    if (centre) return 0;
    const int corner = down.x + 2 * down.y + 4 * down.z;
    const bool odd = ((d.x + d.y + d.z + down.x + down.y + down.z) & 1) != 0;
    for (int t = 1; t < kTetrahedraPerCell; ++t) {
      if (tetrahedron_corners(t, odd).d == corner) return t;
    }
    return -1;
  }

 private:
  TETWARP_HD glm::ivec3 corner(int axis) const {
    const glm::ivec3 towards = direction();
    if (centre) {
      glm::ivec3 vertex = d + towards;
      vertex[axis] -= towards[axis];
      return vertex;
    }
    glm::ivec3 vertex = d;
    vertex[axis] += towards[axis];
    return vertex;
  }
};

/// A tetrahedron of the lattice as float arithmetic wants it.
struct FloatTetrahedron {
  glm::vec3 d;   ///< vertex D
  glm::vec3 to;  ///< +1 or -1: where A, B, C lie from D
  int offset;    ///< of D among the vertices
  bool centre;
};

TETWARP_HD inline FloatTetrahedron as_float(const StepLattice& lattice, const LatticeTetrahedron& t) {
  return {glm::vec3(t.d), glm::vec3(t.direction()), static_cast<int>(lattice.offset(t.d)), t.centre};
}

TETWARP_HD inline LatticeTetrahedron as_lattice(const FloatTetrahedron& t) {
  return {glm::ivec3(t.d), glm::ivec3(t.to.x < 0, t.to.y < 0, t.to.z < 0), t.centre};
}

namespace detail {

/// The largest whole number not above x; NaN: 0, and too large or small ones are any large or small ones.
TETWARP_HD inline int floor_to_int(float x) {
#ifdef __CUDA_ARCH__
  return __float2int_rd(x);
#else
  constexpr float kFar = 1 << 30;
  return x < kFar ? (x > -kFar ? static_cast<int>(std::floor(x)) : -(1 << 30)) : (x >= kFar ? 1 << 30 : 0);
#endif
}

/// x moved into [0, 1]; NaN: 0.
TETWARP_HD inline float saturate(float x) {
#ifdef __CUDA_ARCH__
  return __saturatef(x);
#else
  return x > 0 ? (x < 1 ? x : 1.0f) : 0.0f;
#endif
}

TETWARP_HD inline int clamp_to(int x, int last) {
  const int inside = x > 0 ? x : 0;
  return inside < last ? inside : last;
}

}  // namespace detail

/// The tetrahedron of the undeformed lattice that holds a place, in cells; places outside are moved inside.
TETWARP_HD inline FloatTetrahedron tetrahedron_at(const StepLattice& lattice, const glm::vec3& place) {
  const int x = detail::clamp_to(detail::floor_to_int(place.x), lattice.last.x),
            y = detail::clamp_to(detail::floor_to_int(place.y), lattice.last.y),
            z = detail::clamp_to(detail::floor_to_int(place.z), lattice.last.z);
  const glm::vec3 cell(x, y, z);
  const glm::vec3 in(detail::saturate(place.x - cell.x), detail::saturate(place.y - cell.y),
                     detail::saturate(place.z - cell.z));  // at most one of the four corners below is near
  const bool odd = ((x ^ y ^ z) & 1) != 0;
  const float mirrored = odd ? 1.0f - in.x : in.x;  // mirrored, an odd cell is an even one
  const float more = in.y + in.z, less = in.y - in.z;
  const bool corner0 = mirrored + more<1.0f, corner3 = mirrored + less> 1.0f, corner5 = mirrored - less > 1.0f,
             corner6 = more - mirrored > 1.0f;
  const bool centre = !(corner0 || corner3 || corner5 || corner6);
  const bool down_x = centre ? !odd : (corner3 || corner5) != odd, down_y = centre ? !odd : corner3 || corner6,
             down_z = centre ? !odd : corner5 || corner6;
  FloatTetrahedron t;
  t.d = {down_x ? cell.x + 1.0f : cell.x, down_y ? cell.y + 1.0f : cell.y, down_z ? cell.z + 1.0f : cell.z};
  t.to = {down_x ? -1.0f : 1.0f, down_y ? -1.0f : 1.0f, down_z ? -1.0f : 1.0f};
  t.offset = (z + down_z) * lattice.slice + (y + down_y) * lattice.row + (x + down_x);
  t.centre = centre;
  return t;
}

/// With its snapped vertices, for exact arithmetic.
TETWARP_HD inline Tetrahedron vertices_of(const StepLattice& lattice, const LatticeTetrahedron& t) {
  return {lattice.vertex(t.a()), lattice.vertex(t.b()), lattice.vertex(t.c()), lattice.vertex(t.d)};
}

}  // namespace tetwarp
