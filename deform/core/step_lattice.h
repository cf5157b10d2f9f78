// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <bit>
#include <optional>

#include "deform/core/five_tetrahedra.h"

namespace tetwarp {

/// Packs the displacement of a vertex, three whole numbers of steps, into 64 bits. Each number is stored as its
/// distance from the least number of its axis, in as many bits as its axis needs; together they fill all 64 bits:
///
///     bit 63                     z_at_                      y_at_                    0
///     +--------------------------+--------------------------+------------------------+
///     |      z: 64 - z_at_       |    y: z_at_ - y_at_      |        x: y_at_        |   (by default 22, 21 and 21)
///     +--------------------------+--------------------------+------------------------+
///
/// A number below 2^23 behind the exponent bits of 2^23 is the float 2^23 + that number. So vectors unpack without
/// conversions to floats with something added ("raised"), and differences of raised numbers are exact.
class StepPacking {
 public:
  static constexpr int kMostBits = 23;  ///< the most bits of one axis

  /// The default, which holds displacements from -256 to below 256 voxels along x and y, and twice that along z.
  StepPacking()
      : StepPacking({-(1 << (kDefaultBits[0] - 1)), -(1 << (kDefaultBits[1] - 1)), -(1 << (kDefaultBits[2] - 1))},
                    {kDefaultBits[0], kDefaultBits[1]}) {}

  /// A packing that holds all numbers from `low` to `high`, 2^-12 voxel; nothing where that takes more than 23 bits on
  /// an axis, or 64 in all.
  ///
  /// Room is left below and above, for the next field of a sequence, and because before rounding a number may be half a
  /// step lower, and floats below 2^23 have halves.
  static std::optional<StepPacking> holding(const glm::ivec3& low, const glm::ivec3& high) {
    glm::ivec3 bits(0);
    bool by_default = true;
    for (int axis = 0; axis < 3; ++axis) {
      if (low[axis] < kFarthest + 4 || high[axis] > -kFarthest - 4) return std::nullopt;
      bits[axis] = std::bit_width(static_cast<unsigned>(high[axis] - low[axis] + 4));
      if (bits[axis] > kMostBits) return std::nullopt;
      const int most = 1 << (kDefaultBits[axis] - 1);
      by_default = by_default && low[axis] >= 4 - most && high[axis] < most - 4;
    }
    if (by_default) return StepPacking();
    if (bits.x + bits.y + bits.z > 64) return std::nullopt;
    bits.x = std::max(bits.x, 64 - 2 * kMostBits);
    bits.y = std::max(bits.y, 64 - kMostBits - bits.x);
    bits.z = 64 - bits.x - bits.y;
    glm::ivec3 least(0);
    for (int axis = 0; axis < 3; ++axis) {
      const int room = (1 << bits[axis]) - (high[axis] - low[axis]);  // at least 4
      least[axis] = std::max(low[axis] - room / 2, kFarthest) & ~1;   // even, so that ties are rounded alike
    }
    return StepPacking(least, {bits.x, bits.y});
  }

  /// Number to add to a vector to raise it.
  TETWARP_HD const glm::vec3& lift() const { return lift_; }
  /// Zero if and only if a raised vector can be packed.
  /// @param raised  raised whole numbers, or NaN or infinity
  TETWARP_HD std::uint32_t excess(const glm::vec3& raised) const {
    return ((bits_of(raised.x) ^ kTwoTo23) & ~x_mask_) | ((bits_of(raised.y) ^ kTwoTo23) & ~y_mask_) |
           ((bits_of(raised.z) ^ kTwoTo23) & ~z_mask_);
  }
  /// Packs a raised vector, of which `excess` is zero.
  TETWARP_HD std::uint64_t pack(const glm::vec3& raised) const {
    const std::uint32_t y = bits_of(raised.y) & y_mask_;
    const std::uint32_t low = (bits_of(raised.x) & x_mask_) | y << y_at_,
                        high = y >> (32 - y_at_) | bits_of(raised.z) << (z_at_ - 32);
    return std::uint64_t{high} << 32 | low;
  }
  /// The vector that was packed, raised: each number of steps plus that of `lift`.
  TETWARP_HD glm::vec3 raised(std::uint64_t packed) const {
    const auto low = static_cast<std::uint32_t>(packed), high = static_cast<std::uint32_t>(packed >> 32);
    return {float_of((low & x_mask_) | kTwoTo23), float_of((middle(low, high) & y_mask_) | kTwoTo23),
            float_of(top(high))};
  }
  /// The vector that was packed, in steps.
  TETWARP_HD glm::vec3 unpacked(std::uint64_t packed) const { return raised(packed) - lift_; }
  /// The same as whole numbers, without conversions.
  TETWARP_HD glm::i32vec3 steps(std::uint64_t packed) const {
    const auto low = static_cast<std::uint32_t>(packed), high = static_cast<std::uint32_t>(packed >> 32);
    return least_ + glm::i32vec3(low & x_mask_, middle(low, high) & y_mask_, high >> (z_at_ - 32));
  }

 private:
  static constexpr std::uint32_t kTwoTo23 = 0x4B000000;  ///< the bits of 2^23
  static constexpr int kDefaultBits[3] = {21, 21, 22};
  static constexpr int kFarthest = -(1 << kMostBits);  ///< least number that can be held

  StepPacking(const glm::ivec3& least, const glm::ivec2& bits)
      : y_at_(bits.x),
        z_at_(bits.x + bits.y),
        x_mask_((1u << bits.x) - 1),
        y_mask_((1u << bits.y) - 1),
        z_mask_(~0u >> (z_at_ - 32)),
        above_z_(kTwoTo23 >> (64 - z_at_)),
        lift_(float{1 << kMostBits} - glm::vec3(least)),
        least_(least) {}

#ifdef TETWARP_ON_DEVICE
  __device__ static float float_of(std::uint32_t bits) { return __uint_as_float(bits); }
  __device__ static std::uint32_t bits_of(float value) { return __float_as_uint(value); }
  __device__ std::uint32_t middle(std::uint32_t low, std::uint32_t high) const {
    return __funnelshift_r(low, high, static_cast<unsigned>(y_at_));
  }
  __device__ std::uint32_t top(std::uint32_t high) const {
    return __funnelshift_r(high, above_z_, static_cast<unsigned>(z_at_ - 32));
  }
#else
  static float float_of(std::uint32_t bits) { return std::bit_cast<float>(bits); }
  static std::uint32_t bits_of(float value) { return std::bit_cast<std::uint32_t>(value); }
  std::uint32_t middle(std::uint32_t low, std::uint32_t high) const { return low >> y_at_ | high << (32 - y_at_); }
  std::uint32_t top(std::uint32_t high) const { return high >> (z_at_ - 32) | above_z_ << (64 - z_at_); }
#endif

  int y_at_, z_at_;                         ///< the lowest bits of y and z: 18 to 23, and 41 to 46
  std::uint32_t x_mask_, y_mask_, z_mask_;  ///< as many bits as each axis has
  std::uint32_t above_z_;                   ///< what the bits of 2^23 leave above those of z
  glm::vec3 lift_;
  glm::ivec3 least_;  ///< 2^23 less than `lift_`, with the other sign
};

/// A lattice along the axes of the output grid whose undeformed vertices lie at whole steps; a gather reads it.
///
/// Lattices over a volume with a whole number of voxels a cell are of this kind. Of a vertex only its displacement is
/// stored.
struct StepLattice {
  glm::ivec3 cells{0};          ///< on each axis
  glm::vec3 first{0}, cell{0};  ///< rest place of vertex (0, 0, 0), and from one vertex to the next; 2^-12 voxel
  glm::vec3 voxel{0};           ///< one voxel, in cells
  glm::ivec3 last{0};           ///< cell
  int row = 0, slice = 0;       ///< vertices from one row, and one slice, to the next
  StepPacking packing;
  const std::uint64_t* packed = nullptr;  ///< deformed minus rest of each vertex, 2^-12 voxel, i fastest

  TETWARP_HD std::int64_t offset(const glm::ivec3& vertex) const {
    return std::int64_t{vertex.z} * slice + vertex.y * row + vertex.x;
  }
  TETWARP_HD glm::vec3 moved(std::int64_t offset) const { return packing.unpacked(packed[offset]); }
  TETWARP_HD glm::vec3 raised(std::int64_t offset) const { return packing.raised(packed[offset]); }
  TETWARP_HD Vertex vertex(const glm::ivec3& at) const {
    const glm::vec3 rest = first + glm::vec3(at) * cell, by = moved(offset(at));
    return {glm::ivec3(rest) + glm::ivec3(by), glm::ivec3(-by)};
  }
  /// The deformed place of a vertex alone.
  TETWARP_HD glm::i32vec3 deformed(const glm::ivec3& at) const {
    const int n = at.z * slice + at.y * row + at.x;  // make_step_lattice: fewer than 2^31
    return glm::i32vec3(first) + at * glm::i32vec3(cell) + packing.steps(packed[n]);
  }
  /// The lattice index of an undeformed voxel.
  TETWARP_HD glm::vec3 place(const glm::vec3& voxel_index) const {
    return (voxel_index * float{kStepsPerVoxel} - first) * (voxel * (1.0f / kStepsPerVoxel));
  }
};

/// One tetrahedron of the lattice, named by its corner D, three directions and one flag.
///
/// With alternating parity the corner tetrahedra make up octahedra around the even vertices (i + j + k even): D is an
/// even vertex, and A, B, C are its neighbours along i, j, k, up or down. What is left of each cell is its centre, with
/// odd vertices only: D is the cell's corner 7 (even cells; all directions down) or 0 (odd cells; all up), and A, B, C
/// lie across the faces i, j, k from it. A move across a face on which D lies turns one direction round.
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

/// A tetrahedron of the lattice in the form that float arithmetic uses.
struct FloatTetrahedron {
  glm::vec3 d;   ///< vertex D
  glm::vec3 to;  ///< +1 or -1: where A, B, C lie from D
  int offset;    ///< number of vertex D
  bool centre;
};

TETWARP_HD inline FloatTetrahedron as_float(const StepLattice& lattice, const LatticeTetrahedron& t) {
  return {glm::vec3(t.d), glm::vec3(t.direction()), static_cast<int>(lattice.offset(t.d)), t.centre};
}

TETWARP_HD inline LatticeTetrahedron as_lattice(const FloatTetrahedron& t) {
  return {glm::ivec3(t.d), glm::ivec3(t.to.x < 0, t.to.y < 0, t.to.z < 0), t.centre};
}

namespace detail {

/// The largest whole number that is not above x. NaN gives 0; for x beyond the range of int it is some number as far
/// out.
TETWARP_HD inline int floor_to_int(float x) {
#ifdef TETWARP_ON_DEVICE
  return __float2int_rd(x);
#else
  constexpr float kFar = 1 << 30;
  return x < kFar ? (x > -kFar ? static_cast<int>(std::floor(x)) : -(1 << 30)) : (x >= kFar ? 1 << 30 : 0);
#endif
}

/// x clamped to [0, 1]; NaN gives 0.
TETWARP_HD inline float saturate(float x) {
#ifdef TETWARP_ON_DEVICE
  return __saturatef(x);
#else
  return x > 0 ? (x < 1 ? x : 1.0f) : 0.0f;
#endif
}

/// x clamped to [0, last].
TETWARP_HD inline int clamp_to(int x, int last) {
#ifdef TETWARP_ON_DEVICE
  return __vimin_s32_relu(x, last);
#else
  const int inside = x > 0 ? x : 0;
  return inside < last ? inside : last;
#endif
}

}  // namespace detail

/// The tetrahedron of the undeformed lattice that holds a place, given in cells. Places outside are moved inside.
TETWARP_HD inline FloatTetrahedron tetrahedron_at(const StepLattice& lattice, const glm::vec3& place) {
  const int x = detail::clamp_to(detail::floor_to_int(place.x), lattice.last.x),
            y = detail::clamp_to(detail::floor_to_int(place.y), lattice.last.y),
            z = detail::clamp_to(detail::floor_to_int(place.z), lattice.last.z);
  const glm::vec3 cell(x, y, z);
  const glm::vec3 in(detail::saturate(place.x - cell.x), detail::saturate(place.y - cell.y),
                     detail::saturate(place.z - cell.z));  // at most one of the four corners below is near
  const bool odd = ((x ^ y ^ z) & 1) != 0;
  const float mirrored = odd ? 1.0f - in.x : in.x;  // mirrored, an odd cell is an even one
  const float other = 1.0f - in.y, low = other - in.z, high = other + in.z;
  const bool corner0 = mirrored<low, corner6 = mirrored<-low, corner3 = mirrored> high, corner5 = mirrored> 2.0f - high;
  const bool centre = !(corner0 || corner3 || corner5 || corner6);
  const bool down_x = centre ? !odd : (corner3 || corner5) != odd, down_y = centre ? !odd : corner3 || corner6,
             down_z = centre ? !odd : corner5 || corner6;
  FloatTetrahedron t;
  t.d = {down_x ? cell.x + 1.0f : cell.x, down_y ? cell.y + 1.0f : cell.y, down_z ? cell.z + 1.0f : cell.z};
  t.to = {down_x ? -1.0f : 1.0f, down_y ? -1.0f : 1.0f, down_z ? -1.0f : 1.0f};
  t.offset = z * lattice.slice + y * lattice.row + x;
  if (down_x) t.offset += 1;
  if (down_y) t.offset += lattice.row;
  if (down_z) t.offset += lattice.slice;
  t.centre = centre;
  return t;
}

/// A tetrahedron with its snapped vertices, for exact arithmetic.
///
/// @param lattice  a StepLattice, or any type that gives the snapped vertices of a lattice
template <class Lattice>
TETWARP_HD Tetrahedron vertices_of(const Lattice& lattice, const LatticeTetrahedron& t) {
  return {lattice.vertex(t.a()), lattice.vertex(t.b()), lattice.vertex(t.c()), lattice.vertex(t.d)};
}

}  // namespace tetwarp
