// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/cpu/block_scan.h"

#include <algorithm>
#include <cmath>
#include <limits>

// Highway compiles this file once for each instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "deform/cpu/block_scan.cpp"
#include <hwy/foreach_target.h>
// Highway wants this include after that one.
#include <hwy/cache_control.h>
#include <hwy/highway.h>

#include "deform/cpu/vector_snap-inl.h"

HWY_BEFORE_NAMESPACE();

namespace tetwarp::cpu::HWY_NAMESPACE {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// The least and the largest value that was seen, lane by lane.
struct Range {
  Float least, most;

  HWY_INLINE Range() : least(set(kInfinity)), most(set(-kInfinity)) {}
  HWY_INLINE void add(Float value) {
    least = hn::Min(least, value);
    most = hn::Max(most, value);
  }
  HWY_INLINE float lowest() const { return hn::GetLane(hn::MinOfLanes(Floats(), least)); }
  HWY_INLINE float highest() const { return hn::GetLane(hn::MaxOfLanes(Floats(), most)); }
};

HWY_INLINE Float determinant(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Float x = hn::Sub(hn::Mul(b.y, c.z), hn::Mul(b.z, c.y)), y = hn::Sub(hn::Mul(b.z, c.x), hn::Mul(b.x, c.z)),
              z = hn::Sub(hn::Mul(b.x, c.y), hn::Mul(b.y, c.x));
  return hn::Add(hn::Add(hn::Mul(a.x, x), hn::Mul(a.y, y)), hn::Mul(a.z, z));
}

HWY_INLINE Vec3 blend(FloatMask mask, const Vec3& yes, const Vec3& no) {
  return {hn::IfThenElse(mask, yes.x, no.x), hn::IfThenElse(mask, yes.y, no.y), hn::IfThenElse(mask, yes.z, no.z)};
}

/// One plane of vertices: how far each moved, in steps.
struct VertexPlane {
  static constexpr int kRoom = 16;  ///< lanes of the widest vectors
  static constexpr int kRow = 2 * kRoom + 1;

  float x[kMostScanned.y + 1][kRow], y[kMostScanned.y + 1][kRow], z[kMostScanned.y + 1][kRow];
  bool at_rest;

  HWY_INLINE Vec3 at(int i, int j) const {
    const Floats df;
    return {hn::LoadU(df, x[j] + i), hn::LoadU(df, y[j] + i), hn::LoadU(df, z[j] + i)};
  }
  HWY_INLINE void put(int i, int j, const Vec3& moved) {
    const Floats df;
    hn::StoreU(moved.x, df, x[j] + i);
    hn::StoreU(moved.y, df, y[j] + i);
    hn::StoreU(moved.z, df, z[j] + i);
  }
};

class Scanner {
 public:
  Scanner(const VectorField& field, const glm::ivec3& first, const glm::ivec3& cells)
      : field_(field),
        first_(first),
        cells_(cells),
        lanes_(static_cast<int>(hn::Lanes(Floats()))),
        smallest_(set(kInfinity)),
        usable_(hn::Eq(hn::Zero(Floats()), hn::Zero(Floats()))) {}

  bool run(BlockScan& scan) {
    VertexPlane planes[2];
    with_snapping(field_, [&](auto snapping) {
      constexpr Snapping kSnapping = decltype(snapping)::value;
      read<kSnapping>(0, planes[0]);
      for (int k = 0; k < cells_.z; ++k) {
        read<kSnapping>(k + 1, planes[(k + 1) & 1]);
        look_at(k, planes[k & 1], planes[(k + 1) & 1]);
      }
    });
    return report(scan);
  }

 private:
  /// The vertices to prefetch while a row of plane k is snapped: the same row of the next plane or, at the last plane,
  /// of the first plane of the neighbouring block.
  std::int64_t ahead(int k) const {
    const std::int64_t slice = field_.lattice.slice;
    return k < cells_.z ? slice : cells_.x - cells_.z * slice;
  }

  /// Snaps plane k of the block.
  template <Snapping kSnapping>
  void read(int k, VertexPlane& plane) {
    const Floats df;
    const StepLattice& lattice = field_.lattice;
    const int count = cells_.x + 1;
    FloatMask still = hn::Eq(hn::Zero(df), hn::Zero(df));
    for (int j = 0; j <= cells_.y; ++j) {
      const glm::ivec3 row(first_.x, first_.y + j, first_.z + k);
      const glm::vec3* given = field_.displacement + lattice.offset(row);
      prefetch(given + ahead(k));
      glm::vec3 padded[VertexPlane::kRoom];
      if (count < lanes_) {  // the last vertex is repeated
        for (int n = 0; n < lanes_; ++n) padded[n] = given[std::min(n, count - 1)];
        given = padded;
      }
      for (int i = 0; i < count; i += lanes_) {
        const int from = std::max(std::min(i, count - lanes_), 0);  // the last vectors may overlap
        Vec3 displacement;
        hn::LoadInterleaved3(df, &given[from].x, displacement.x, displacement.y, displacement.z);
        const Float in_row = hn::Min(hn::ConvertTo(df, numbers_from(from)), set(static_cast<float>(cells_.x)));
        const Vec3 at{hn::Add(set(static_cast<float>(row.x)), in_row), set(static_cast<float>(row.y)),
                      set(static_cast<float>(row.z))};
        FloatMask certain = hn::Eq(hn::Zero(df), hn::Zero(df));
        Vec3 moved = moved_steps<kSnapping>(field_, displacement, at, certain);
        if (kSnapping == Snapping::in_float && !hn::AllTrue(df, certain))
          moved = moved_steps<Snapping::in_double>(field_, displacement, at, certain);
        plane.put(from, j, moved);
        const Float zero = hn::Zero(df);
        still = hn::And(still, hn::And(hn::And(hn::Eq(moved.x, zero), hn::Eq(moved.y, zero)), hn::Eq(moved.z, zero)));
        x_.add(hn::MulAdd(in_row, set(lattice.cell.x), moved.x));
        y_.add(hn::Add(set(static_cast<float>(j) * lattice.cell.y), moved.y));
        z_.add(hn::Add(set(static_cast<float>(k) * lattice.cell.z), moved.z));
        moved_x_.add(moved.x);
        moved_y_.add(moved.y);
        moved_z_.add(moved.z);
        const Float most = set(VectorField::kMostMoved);  // without Min and Max, which may lose a NaN
        usable_ = hn::And(usable_, hn::And(hn::Le(hn::Abs(moved.x), most),
                                           hn::And(hn::Le(hn::Abs(moved.y), most), hn::Le(hn::Abs(moved.z), most))));
      }
    }
    plane.at_rest = hn::AllTrue(df, still);
    at_rest_ = at_rest_ && plane.at_rest;
  }

  /// Prefetches a row of vertices.
  void prefetch(const glm::vec3* vertex) const {
    constexpr std::size_t kLine = 64;
    const auto* line = reinterpret_cast<const char*>(vertex);
    const std::size_t bytes = static_cast<std::size_t>(cells_.x + 1) * sizeof *vertex;
    for (std::size_t n = 0; n < bytes; n += kLine) hwy::Prefetch(line + n);
  }

  /// Looks at the cells between two planes.
  void look_at(int k, const VertexPlane& low, const VertexPlane& high) {
    if (low.at_rest && high.at_rest) {
      any_rests_ = true;
      return;
    }
    for (int j = 0; j < cells_.y; ++j) {
      for (int i = 0; i < cells_.x; i += lanes_) look_at(glm::ivec3(i, j, k), low, high);
    }
  }

  /// Looks at cells of a row, one in each lane. Mirrored along i, an odd cell becomes an even one.
  HWY_INLINE void look_at(const glm::ivec3& in, const VertexPlane& low, const VertexPlane& high) {
    const Floats df;
    const Ints di;
    const glm::vec3& cell = field_.lattice.cell;
    const glm::ivec3 at = first_ + in;
    const FloatMask odd = hn::RebindMask(df, hn::TestBit(numbers_from(at.x + at.y + at.z), hn::Set(di, 1)));
    const FloatMask here =
        hn::RebindMask(df, hn::FirstN(di, static_cast<std::size_t>(std::min(cells_.x - in.x, lanes_))));
    const Vec3 c0 = low.at(in.x, in.y), c1 = low.at(in.x + 1, in.y), c2 = low.at(in.x, in.y + 1),
               c3 = low.at(in.x + 1, in.y + 1), c4 = high.at(in.x, in.y), c5 = high.at(in.x + 1, in.y),
               c6 = high.at(in.x, in.y + 1), c7 = high.at(in.x + 1, in.y + 1);
    const Vec3 m0 = blend(odd, c1, c0), m1 = blend(odd, c0, c1), m2 = blend(odd, c3, c2), m3 = blend(odd, c2, c3),
               m4 = blend(odd, c5, c4), m5 = blend(odd, c4, c5), m6 = blend(odd, c7, c6), m7 = blend(odd, c6, c7);
    const Float x = hn::IfThenElse(odd, set(-cell.x), set(cell.x)), y = set(cell.y), z = set(cell.z);
    const auto corner = [&](const Vec3& d, const Vec3& a, Float ax, const Vec3& b, Float by, const Vec3& c, Float cz) {
      Vec3 to_a = a - d, to_b = b - d, to_c = c - d;
      to_a.x = hn::Add(to_a.x, ax);
      to_b.y = hn::Add(to_b.y, by);
      to_c.z = hn::Add(to_c.z, cz);
      const Float volume = determinant(to_a, to_b, to_c);
      add(hn::IfThenElse(odd, hn::Neg(volume), volume), here, 0);
    };
    const Float back_x = hn::Neg(x), back_y = set(-cell.y), back_z = set(-cell.z);
    corner(m0, m1, x, m2, y, m4, z);
    corner(m3, m2, back_x, m1, back_y, m7, z);
    corner(m5, m4, back_x, m7, y, m1, back_z);
    corner(m6, m7, x, m4, back_y, m2, back_z);

    const Vec3 d = blend(odd, c0, c7);
    Vec3 a = blend(odd, c6, c1) - d, b = blend(odd, c5, c2) - d, c = blend(odd, c3, c4) - d;
    const Float to_x = hn::Neg(x), to_y = hn::IfThenElse(odd, y, back_y), to_z = hn::IfThenElse(odd, z, back_z);
    a.y = hn::Add(a.y, to_y);
    a.z = hn::Add(a.z, to_z);
    b.x = hn::Add(b.x, to_x);
    b.z = hn::Add(b.z, to_z);
    c.x = hn::Add(c.x, to_x);
    c.y = hn::Add(c.y, to_y);
    const Float volume = determinant(a, b, c);
    add(hn::IfThenElse(odd, volume, hn::Neg(volume)), here, 1);
  }

  /// Takes note of a volume. @param volume  positive where the tetrahedron is not inverted
  HWY_INLINE void add(Float volume, FloatMask here, int kind) {
    const Floats df;
    volumes_[kind].least = hn::Min(volumes_[kind].least, hn::IfThenElse(here, volume, set(kInfinity)));
    volumes_[kind].most = hn::Max(volumes_[kind].most, hn::IfThenElse(here, volume, set(-kInfinity)));
    smallest_ = hn::Min(smallest_, hn::IfThenElse(here, hn::Abs(volume), set(kInfinity)));
    inverted_ += hn::CountTrue(df, hn::And(here, hn::Lt(volume, hn::Zero(df))));
  }

  bool report(BlockScan& scan) const {
    if (!hn::AllTrue(Floats(), usable_)) return false;
    const glm::vec3 low(x_.lowest(), y_.lowest(), z_.lowest()), high(x_.highest(), y_.highest(), z_.highest());
    constexpr float kExact = 1 << 24;  // floats hold all whole numbers up to here
    if (std::max({high.x, high.y, high.z}) > kExact) return false;
    const glm::i32vec3 rest = glm::i32vec3(field_.lattice.first) + first_ * glm::i32vec3(field_.lattice.cell);
    scan.box = {rest + glm::i32vec3(low), rest + glm::i32vec3(high)};
    const glm::vec3 least(moved_x_.lowest(), moved_y_.lowest(), moved_z_.lowest()),
        most(moved_x_.highest(), moved_y_.highest(), moved_z_.highest());
    // Edges are whole numbers below 2^24, since cells have up to 2^22 steps. No edge has a larger sum norm than this;
    // the error of determinants is that of `edge_determinant`.
    const glm::vec3 longest = field_.lattice.cell + (most - least);
    const float norm = (longest.x + longest.y) + longest.z;
    constexpr float kError = 9.0f / (1 << 24);
    const float smallest = hn::GetLane(hn::MinOfLanes(Floats(), smallest_));
    if (!(smallest > kError * ((norm * norm) * norm))) return false;
    scan.at_rest = at_rest_;
    scan.inverted = inverted_;
    scan.most_moved = 0;
    for (int axis = 0; axis < 3; ++axis)
      scan.most_moved = std::max({scan.most_moved, static_cast<int>(-least[axis]), static_cast<int>(most[axis])});
    for (int kind = 0; kind < 2; ++kind) {
      scan.least[kind] = volumes_[kind].lowest();
      scan.most[kind] = volumes_[kind].highest();
      const float at_rest = rest_volume(field_.lattice, kind);
      if (!any_rests_) continue;
      scan.least[kind] = std::min(scan.least[kind], at_rest);
      scan.most[kind] = std::max(scan.most[kind], at_rest);
    }
    return true;
  }

  const VectorField& field_;
  glm::ivec3 first_, cells_;
  int lanes_;
  /// Deformed vertices, from the block's first vertex at rest.
  Range x_, y_, z_;
  Range moved_x_, moved_y_, moved_z_;
  Range volumes_[2];  ///< of corner tetrahedra, of centres
  Float smallest_;    ///< the smallest volume, without its sign
  FloatMask usable_;
  std::uint64_t inverted_ = 0;
  bool at_rest_ = true, any_rests_ = false;
};

bool scan(const VectorField& field, const glm::ivec3& first_cell, const glm::ivec3& cells, BlockScan& found) {
  return Scanner(field, first_cell, cells).run(found);
}

}  // namespace tetwarp::cpu::HWY_NAMESPACE

HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace tetwarp::cpu {

HWY_EXPORT(scan);

bool scan_block(const VectorField& field, const glm::ivec3& first_cell, const glm::ivec3& cells, BlockScan& found) {
  return HWY_DYNAMIC_DISPATCH(scan)(field, first_cell, cells, found);
}

}  // namespace tetwarp::cpu

#endif
