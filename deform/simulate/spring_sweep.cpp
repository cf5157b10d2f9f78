// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>

#include "deform/simulate/spring_grid.h"

// Highway compiles this file once for each instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "deform/simulate/spring_sweep.cpp"
#include <hwy/foreach_target.h>
// Highway wants this include after that one.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();

namespace tetwarp::simulate::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// All instruction sets give the same bits, for vectors have the same length and no operations are fused.
using Doubles = hn::CappedTag<double, 8>;
using Halves = hn::Rebind<float, Doubles>;
using Floats = hn::CappedTag<float, 16>;

/// Springs in one direction at the present displacement.
struct Springs {
  hn::Vec<Doubles> x, y, z;  ///< unit vector from a node to its neighbour
  hn::Vec<Doubles> length, elongation;

  /// Computes what `stretched` computes, with the same operations.
  HWY_INLINE Springs(const RestLink<double>& rest, const PaddedVectors<double>& u, std::size_t n,
                     std::ptrdiff_t distance) {
    const Doubles d;
    const auto apart = [&](std::size_t axis) {
      const double* at = u[axis].data() + n;
      return hn::Sub(hn::LoadU(d, at + distance), hn::LoadU(d, at));
    };
    const auto ex = apart(0), ey = apart(1), ez = apart(2);
    const auto rx = hn::Set(d, rest.along.x), ry = hn::Set(d, rest.along.y), rz = hn::Set(d, rest.along.z);
    const auto across = hn::Add(hn::Add(hn::Mul(rx, ex), hn::Mul(ry, ey)), hn::Mul(rz, ez));
    const auto square = hn::Add(hn::Add(hn::Mul(ex, ex), hn::Mul(ey, ey)), hn::Mul(ez, ez));
    const auto grown = hn::Add(hn::Add(across, across), square);
    const double at_rest = rest.length * rest.length;
    length = hn::Sqrt(hn::Max(hn::Add(hn::Set(d, at_rest), grown), hn::Set(d, 1e-12 * at_rest)));
    elongation = hn::Div(grown, hn::Add(length, hn::Set(d, rest.length)));
    x = hn::Add(rx, ex);
    y = hn::Add(ry, ey);
    z = hn::Add(rz, ez);
  }
};

/// Whether a direction leads up or down, and at which end of a link its number is kept: the lower one.
struct LinkSide {
  std::size_t up;
  std::ptrdiff_t distance, kept;

  HWY_INLINE LinkSide(const SpringGrid& grid, int direction) {
    const bool is_up = direction >= kUp;
    up = static_cast<std::size_t>(is_up ? direction : opposite(direction)) - kUp;
    distance = is_up ? grid.distance[up] : -grid.distance[up];
    kept = is_up ? 0 : distance;
  }
};

double forces(const SpringGrid& grid, NodeRange range, const PaddedVectors<double>& u, PaddedVectors<double>& force) {
  const Doubles d;
  const Halves df;
  const std::size_t lanes = hn::Lanes(d);
  double sum = 0;
  for (std::size_t n = range.begin; n < range.end; n += lanes) {
    auto fx = hn::Zero(d), fy = hn::Zero(d), fz = hn::Zero(d), energy = hn::Zero(d);
    for (int direction = 0; direction < kDirections; ++direction) {
      const LinkSide way(grid, direction);
      const Springs springs(grid.rest[static_cast<std::size_t>(direction)], u, n, way.distance);
      const auto k = hn::PromoteTo(d, hn::LoadU(df, grid.stiffness[way.up].data() + n + way.kept));
      const auto pull = hn::Mul(k, springs.elongation), share = hn::Div(pull, springs.length);
      energy = hn::Add(energy, hn::Mul(pull, springs.elongation));
      fx = hn::Add(fx, hn::Mul(share, springs.x));
      fy = hn::Add(fy, hn::Mul(share, springs.y));
      fz = hn::Add(fz, hn::Mul(share, springs.z));
    }
    hn::StoreU(fx, d, force[0].data() + n);
    hn::StoreU(fy, d, force[1].data() + n);
    hn::StoreU(fz, d, force[2].data() + n);
    HWY_ALIGN double energies[8];
    hn::Store(energy, d, energies);
    for (std::size_t i = 0; i < std::min(lanes, range.end - n); ++i) sum += energies[i];
  }
  return sum / 4;
}

void matrices(const SpringGrid& grid, NodeRange range, const PaddedVectors<double>& u, Stiffness kind,
              SpringMatrices& result) {
  const Doubles d;
  const Halves df;
  for (std::size_t up = 0; up < kUp; ++up) {
    const std::ptrdiff_t distance = grid.distance[up];
    for (std::size_t n = range.begin; n < range.end; n += hn::Lanes(d)) {
      const Springs springs(grid.rest[up + kUp], u, n, distance);
      const auto k = hn::PromoteTo(d, hn::LoadU(df, grid.stiffness[up].data() + n));
      auto t = hn::Div(springs.elongation, springs.length);
      if (kind == Stiffness::laplacian) t = hn::Set(d, 1.0);
      if (kind == Stiffness::projected) t = hn::Max(t, hn::Zero(d));
      const auto even = hn::Mul(k, t);
      const auto root = hn::Div(hn::Sqrt(hn::Max(hn::Sub(k, even), hn::Zero(d))), springs.length);
      const auto store = [&](std::size_t i, hn::Vec<Doubles> value)
                             HWY_ATTR { hn::StoreU(hn::DemoteTo(df, value), df, result.up[up][i].data() + n); };
      store(0, hn::Mul(root, springs.x));
      store(1, hn::Mul(root, springs.y));
      store(2, hn::Mul(root, springs.z));
      store(3, even);
    }
  }
}

void product(const SpringGrid& grid, NodeRange range, const SpringMatrices& matrix, const PaddedVectors<float>& vector,
             PaddedVectors<float>& result) {
  const Floats d;
  float* const out[3] = {result[0].data(), result[1].data(), result[2].data()};
  for (float* values : out) std::fill(values + range.begin, values + range.end, 0.0f);
  for (int direction = 0; direction < kDirections; ++direction) {
    const LinkSide way(grid, direction);
    const float* entry[4];
    for (std::size_t i = 0; i < 4; ++i) entry[i] = matrix.up[way.up][i].data() + way.kept;
    const float* const in[3] = {vector[0].data(), vector[1].data(), vector[2].data()};
    for (std::size_t n = range.begin; n < range.end; n += hn::Lanes(d)) {
      const auto less = [&](const float* v)
                            HWY_ATTR { return hn::Sub(hn::LoadU(d, v + n), hn::LoadU(d, v + n + way.distance)); };
      const auto x = less(in[0]), y = less(in[1]), z = less(in[2]);
      const auto ax = hn::LoadU(d, entry[0] + n), ay = hn::LoadU(d, entry[1] + n), az = hn::LoadU(d, entry[2] + n);
      const auto even = hn::LoadU(d, entry[3] + n);
      const auto along = hn::Add(hn::Add(hn::Mul(ax, x), hn::Mul(ay, y)), hn::Mul(az, z));
      const auto add = [&](float* to, auto across, auto apart) HWY_ATTR {
        const auto sum = hn::Add(hn::Mul(across, along), hn::Mul(even, apart));
        hn::StoreU(hn::Add(hn::LoadU(d, to + n), sum), d, to + n);
      };
      add(out[0], ax, x);
      add(out[1], ay, y);
      add(out[2], az, z);
    }
  }
}

}  // namespace tetwarp::simulate::HWY_NAMESPACE

HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace tetwarp::simulate {

HWY_EXPORT(forces);
HWY_EXPORT(matrices);
HWY_EXPORT(product);

namespace {

std::span<const OddLink> odd_links(const SpringGrid& grid, NodeRange range) {
  const std::size_t block = range.begin / SpringGrid::kBlock, first = grid.first_odd[block];
  return std::span(grid.odd).subspan(first, grid.first_odd[block + 1] - first);
}

Stretched<double> odd_spring(const SpringGrid& grid, const OddLink& link, const PaddedVectors<double>& u) {
  const auto at = [&](std::uint32_t n) { return glm::dvec3(u[0][n], u[1][n], u[2][n]); };
  return stretched(grid.rest[static_cast<std::size_t>(link.direction)], at(link.other) - at(link.node));
}

}  // namespace

double sweep_forces(const SpringGrid& grid, NodeRange range, const PaddedVectors<double>& displacement,
                    PaddedVectors<double>& force) {
  double energy = HWY_DYNAMIC_DISPATCH(forces)(grid, range, displacement, force);
  for (const OddLink& link : odd_links(grid, range)) {
    const Stretched<double> spring = odd_spring(grid, link, displacement);
    const double pull = double{link.stiffness} * spring.elongation;
    energy += pull * spring.elongation / 4;
    for (int axis = 0; axis < 3; ++axis) force[static_cast<std::size_t>(axis)][link.node] += pull * spring.unit[axis];
  }
  return energy;
}

void sweep_matrices(const SpringGrid& grid, NodeRange range, const PaddedVectors<double>& displacement, Stiffness kind,
                    SpringMatrices& result) {
  HWY_DYNAMIC_DISPATCH(matrices)(grid, range, displacement, kind, result);
  for (const OddLink& link : odd_links(grid, range)) {
    result.odd[static_cast<std::size_t>(&link - grid.odd.data())] =
        spring_matrix(odd_spring(grid, link, displacement), double{link.stiffness}, kind);
  }
}

void sweep_product(const SpringGrid& grid, NodeRange range, const SpringMatrices& matrix,
                   const PaddedVectors<float>& vector, PaddedVectors<float>& result) {
  HWY_DYNAMIC_DISPATCH(product)(grid, range, matrix, vector, result);
  for (const OddLink& link : odd_links(grid, range)) {
    const auto at = [&](std::uint32_t n) { return glm::vec3(vector[0][n], vector[1][n], vector[2][n]); };
    const glm::vec3 share =
        matrix.odd[static_cast<std::size_t>(&link - grid.odd.data())] * (at(link.node) - at(link.other));
    for (int axis = 0; axis < 3; ++axis) result[static_cast<std::size_t>(axis)][link.node] += share[axis];
  }
}

}  // namespace tetwarp::simulate

#endif  // HWY_ONCE
