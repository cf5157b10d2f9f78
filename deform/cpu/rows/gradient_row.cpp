// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/cpu/rows/gradient_row.h"

#include <algorithm>
#include <cmath>
#include <glm/matrix.hpp>

// Highway compiles this file once for each instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "deform/cpu/rows/gradient_row.cpp"
#include <hwy/foreach_target.h>
// Highway wants this include after that one.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();

namespace tetwarp::cpu::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<double, 8>;
using V = hn::Vec<D>;

struct Vector {
  V x, y, z;
};
struct Matrix {
  Vector column[3];
};

HWY_INLINE Vector sub(const Vector& a, const Vector& b) {
  return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}
HWY_INLINE Vector add(const Vector& a, const Vector& b) {
  return {hn::Add(a.x, b.x), hn::Add(a.y, b.y), hn::Add(a.z, b.z)};
}
HWY_INLINE Vector mul(V by, const Vector& a) { return {hn::Mul(by, a.x), hn::Mul(by, a.y), hn::Mul(by, a.z)}; }
HWY_INLINE V dot(const Vector& a, const Vector& b) {
  return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z));
}

/// As glm::determinant has it, term by term.
HWY_INLINE V determinant(const Matrix& m) {
  const auto minor = [](V a, V b, V c, V d) HWY_ATTR { return hn::Sub(hn::Mul(a, b), hn::Mul(c, d)); };
  const Vector &a = m.column[0], &b = m.column[1], &c = m.column[2];
  return hn::Add(hn::Sub(hn::Mul(a.x, minor(b.y, c.z, c.y, b.z)), hn::Mul(b.x, minor(a.y, c.z, c.y, a.z))),
                 hn::Mul(c.x, minor(a.y, b.z, b.y, a.z)));
}

/// Whether no eigenvalue of transpose(f) f exceeds a limit: by Gershgorin's bound or, where that is not enough for all
/// lanes, by the characteristic polynomial and its derivatives, which are not negative above the largest root (Budan's
/// theorem).
HWY_INLINE hn::Mask<D> is_within(const Matrix& f, V limit) {
  const D d;
  const Vector &a = f.column[0], &b = f.column[1], &c = f.column[2];
  const V xx = dot(a, a), yy = dot(b, b), zz = dot(c, c), xy = dot(a, b), xz = dot(a, c), yz = dot(b, c);
  const V sum_x = hn::Add(hn::Add(xx, hn::Abs(xy)), hn::Abs(xz)),
          sum_y = hn::Add(hn::Add(yy, hn::Abs(xy)), hn::Abs(yz)),
          sum_z = hn::Add(hn::Add(zz, hn::Abs(xz)), hn::Abs(yz));
  const auto by_sums = hn::Le(hn::Max(hn::Max(sum_x, sum_y), sum_z), limit);
  if (hn::AllTrue(d, by_sums)) return by_sums;
  const V zero = hn::Zero(d), trace = hn::Add(hn::Add(xx, yy), zz), thrice = hn::Mul(hn::Set(d, 3.0), limit);
  const auto minor = [](V p, V q, V r) HWY_ATTR { return hn::Sub(hn::Mul(p, q), hn::Mul(r, r)); };
  const V minors = hn::Add(hn::Add(minor(xx, yy, xy), minor(xx, zz, xz)), minor(yy, zz, yz));
  const V value = hn::Sub(hn::Mul(hn::Add(hn::Mul(hn::Sub(limit, trace), limit), minors), limit),
                          determinant({{{xx, xy, xz}, {xy, yy, yz}, {xz, yz, zz}}}));
  const V slope = hn::Add(hn::Mul(hn::Sub(thrice, hn::Add(trace, trace)), limit), minors);
  return hn::Or(by_sums, hn::And(hn::And(hn::Ge(value, zero), hn::Ge(slope, zero)), hn::Ge(thrice, trace)));
}

/// Adds the steps of the lattice to differences of displacements. Where only the diagonal is not 0, the rest is left.
template <bool kDiagonal>
HWY_INLINE Matrix deformed_steps(const glm::dmat3& step, const Matrix& apart) {
  const D d;
  Matrix sum = apart;
  if constexpr (kDiagonal) {
    sum.column[0].x = hn::Add(hn::Set(d, step[0][0]), apart.column[0].x);
    sum.column[1].y = hn::Add(hn::Set(d, step[1][1]), apart.column[1].y);
    sum.column[2].z = hn::Add(hn::Set(d, step[2][2]), apart.column[2].z);
  } else {
    for (int c = 0; c < 3; ++c) {
      const Vector of{hn::Set(d, step[c][0]), hn::Set(d, step[c][1]), hn::Set(d, step[c][2])};
      sum.column[c] = add(of, apart.column[c]);
    }
  }
  return sum;
}

template <bool kDiagonal>
HWY_INLINE Matrix gradient(const glm::dmat3& inverse, const Matrix& steps) {
  const D d;
  Matrix f;
  for (int c = 0; c < 3; ++c) {
    if constexpr (kDiagonal) {
      f.column[c] = mul(hn::Set(d, inverse[c][c]), steps.column[c]);
    } else {
      f.column[c] =
          add(add(mul(hn::Set(d, inverse[c][0]), steps.column[0]), mul(hn::Set(d, inverse[c][1]), steps.column[1])),
              mul(hn::Set(d, inverse[c][2]), steps.column[2]));
    }
  }
  return f;
}

template <bool kDiagonal, bool kOdd>
HWY_INLINE void measure_cells(const LatticeSteps& steps, const GradientRun& run, double limit, RunGradients& found) {
  const D d;
  const std::size_t lanes = hn::Lanes(d), whole = run.count / lanes * lanes;  // cells in whole vectors
  const V zero = hn::Zero(d), half = hn::Set(d, kOdd ? 0.5 : -0.5);
  V least = hn::Set(d, HUGE_VAL), most = hn::Set(d, -HUGE_VAL);
  for (std::size_t n = 0; n < run.count; n += lanes) {
    Vector u[8];
    V moved = zero;
    for (std::size_t corner = 0; corner < 8; ++corner) {
      const std::size_t right = corner & 1, vertex = run.rest + right;
      const auto component = [&](std::size_t axis) HWY_ATTR {
        return hn::LoadU(d, run.rows[corner >> 1]->component(vertex & 1, axis) + run.first + (vertex >> 1) + n);
      };
      u[corner] = {component(0), component(1), component(2)};
      moved = hn::Max(moved, hn::Max(hn::Max(hn::Abs(u[corner].x), hn::Abs(u[corner].y)), hn::Abs(u[corner].z)));
    }
    const auto moves = hn::Ne(moved, zero);
    if (hn::AllFalse(d, moves)) {
      for (auto& of_tetrahedron : found.determinant) hn::StoreU(hn::Set(d, 1.0), d, of_tetrahedron.data() + n);
      std::fill_n(found.kind.begin() + n, std::min(lanes, run.count - n), RunGradients::Kind::at_rest);
      least = hn::Min(least, hn::Set(d, 1.0));
      most = hn::Max(most, hn::Set(d, 1.0));
      continue;
    }
    auto within = hn::Eq(zero, zero);
    const auto take = [&](std::size_t t, const Matrix& apart) HWY_ATTR {
      const Matrix deformed = deformed_steps<kDiagonal>(steps.step, apart);
      const V of = hn::Mul(determinant(deformed), hn::Set(d, steps.over_volume));
      hn::StoreU(of, d, found.determinant[t].data() + n);
      if (n < whole) {
        least = hn::Min(least, of);
        most = hn::Max(most, of);
      }
      within = hn::And(within, is_within(gradient<kDiagonal>(steps.inverse, deformed), hn::Set(d, limit)));
    };
    {
      constexpr TetrahedronCorners of = tetrahedron_corners(0, kOdd);
      const Vector a = mul(half, sub(u[of.a], u[of.d])), b = mul(half, sub(u[of.b], u[of.d])),
                   c = mul(half, sub(u[of.c], u[of.d]));
      take(0, {{sub(add(b, c), a), sub(add(a, c), b), sub(add(a, b), c)}});
    }
    for (int t = 1; t < kTetrahedraPerCell; ++t) {
      const TetrahedronCorners of = tetrahedron_corners(t, kOdd);
      const auto along = [&](int neighbour, int axis) HWY_ATTR {
        return ((of.d >> axis) & 1) != 0 ? sub(u[of.d], u[neighbour]) : sub(u[neighbour], u[of.d]);
      };
      take(static_cast<std::size_t>(t), {{along(of.a, 0), along(of.b, 1), along(of.c, 2)}});
    }
    std::uint8_t moving[8] = {}, inside[8] = {};
    hn::StoreMaskBits(d, moves, moving);
    hn::StoreMaskBits(d, within, inside);
    for (std::size_t i = 0; i < std::min(lanes, run.count - n); ++i) {
      using Kind = RunGradients::Kind;
      found.kind[n + i] = (moving[0] >> i & 1) == 0   ? Kind::at_rest
                          : (inside[0] >> i & 1) != 0 ? Kind::within
                                                      : Kind::beyond;
    }
  }
  found.least = hn::GetLane(hn::MinOfLanes(d, least));
  found.most = hn::GetLane(hn::MaxOfLanes(d, most));
  for (const auto& of_tetrahedron : found.determinant) {
    for (std::size_t n = whole; n < run.count; ++n) {
      found.least = std::min(found.least, of_tetrahedron[n]);
      found.most = std::max(found.most, of_tetrahedron[n]);
    }
  }
}

void measure(const LatticeSteps& steps, const GradientRun& run, double limit, RunGradients& found) {
  if (steps.is_diagonal) {
    run.odd ? measure_cells<true, true>(steps, run, limit, found)
            : measure_cells<true, false>(steps, run, limit, found);
  } else {
    run.odd ? measure_cells<false, true>(steps, run, limit, found)
            : measure_cells<false, false>(steps, run, limit, found);
  }
}

}  // namespace tetwarp::cpu::HWY_NAMESPACE

HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace tetwarp::cpu {

HWY_EXPORT(measure);

namespace {

constexpr std::size_t kLanes = 8;

bool is_diagonal(const glm::dmat3& m) {
  for (int c = 0; c < 3; ++c) {
    for (int r = 0; r < 3; ++r) {
      if (c != r && m[c][r] != 0) return false;
    }
  }
  return true;
}

}  // namespace

SplitRow::SplitRow(std::size_t vertices) : vertices_(vertices) {
  for (auto& components : of_) components.fill(std::vector<double>((vertices + 1) / 2 + kLanes, 0));
}

void SplitRow::set(const glm::vec3* row) {
  for (std::size_t rest = 0; rest < 2; ++rest) {
    double *x = of_[rest][0].data(), *y = of_[rest][1].data(), *z = of_[rest][2].data();
    for (std::size_t n = rest, m = 0; n < vertices_; n += 2, ++m) {
      x[m] = double{row[n].x};
      y[m] = double{row[n].y};
      z[m] = double{row[n].z};
    }
  }
}

LatticeSteps::LatticeSteps(const glm::dmat3& of)
    : step(of), inverse(glm::inverse(of)), over_volume(1 / glm::determinant(of)), is_diagonal(cpu::is_diagonal(of)) {}

void measure_gradients(const LatticeSteps& steps, const GradientRun& run, double limit, RunGradients& found) {
  HWY_DYNAMIC_DISPATCH(measure)(steps, run, limit, found);
}

}  // namespace tetwarp::cpu

#endif  // HWY_ONCE
