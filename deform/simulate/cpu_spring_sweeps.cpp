// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <span>

#include "deform/simulate/spring_grid.h"

// Highway compiles this file once for each instruction set.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "deform/simulate/cpu_spring_sweeps.cpp"
#include <hwy/foreach_target.h>
// Highway wants this include after that one.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();

namespace tetwarp::simulate::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// All instruction sets give the same bits, for every lane is a node of its own and no operations are fused.
using Doubles = hn::CappedTag<double, 8>;
using Halves = hn::Rebind<float, Doubles>;
using Floats = hn::CappedTag<float, 16>;

/// Springs in one direction at some displacement.
struct Springs {
  hn::Vec<Doubles> x, y, z;  ///< from a node to its neighbour
  hn::Vec<Doubles> length, tension;

  /// Computes what `stretched` computes, with the same operations.
  HWY_INLINE Springs(const RestLink<double>& rest, const NodeVectors<double>& u, std::size_t n,
                     std::ptrdiff_t distance) {
    const Doubles d;
    const auto apart = [&](std::size_t axis) HWY_ATTR {
      const double* at = u.axis(axis) + n;
      return hn::Sub(hn::LoadU(d, at + distance), hn::LoadU(d, at));
    };
    const auto ex = apart(0), ey = apart(1), ez = apart(2);
    const auto rx = hn::Set(d, rest.along.x), ry = hn::Set(d, rest.along.y), rz = hn::Set(d, rest.along.z);
    const auto across = hn::Add(hn::Add(hn::Mul(rx, ex), hn::Mul(ry, ey)), hn::Mul(rz, ez));
    const auto square = hn::Add(hn::Add(hn::Mul(ex, ex), hn::Mul(ey, ey)), hn::Mul(ez, ez));
    const auto grown = hn::Add(hn::Add(across, across), square);
    const double at_rest = rest.length * rest.length;
    length = hn::Sqrt(hn::Max(hn::Add(hn::Set(d, at_rest), grown), hn::Set(d, 1e-12 * at_rest)));
    tension = hn::Mul(grown, hn::Div(hn::Set(d, 1), hn::Mul(length, hn::Add(length, hn::Set(d, rest.length)))));
    x = hn::Add(rx, ex);
    y = hn::Add(ry, ey);
    z = hn::Add(rz, ez);
  }
};

/// Whether a direction leads up or down, and at which end of a link its number is kept: the lower one.
struct LinkSide {
  std::size_t up;
  std::ptrdiff_t distance, kept;

  HWY_INLINE LinkSide(const SpringArrays& a, int direction) {
    const bool is_up = direction >= kUp;
    up = static_cast<std::size_t>(is_up ? direction : opposite(direction)) - kUp;
    distance = a.distance[direction];
    kept = is_up ? 0 : distance;
  }
};

/// Sums, over the regular links of each node, of the forces and twice the energies of StrainOf.
void pulls(const SpringGrid& grid, NodeRange range, const SpringArrays& a, double* energies) {
  const Doubles d;
  const Halves df;
  const std::size_t lanes = hn::Lanes(d);
  for (std::size_t n = range.begin; n < range.end; n += lanes) {
    auto fx = hn::Zero(d), fy = hn::Zero(d), fz = hn::Zero(d), energy = hn::Zero(d);
    for (int direction = 0; direction < kDirections; ++direction) {
      const LinkSide way(a, direction);
      const Springs springs(a.rest[direction], a.trial, n, way.distance);
      const auto k = hn::PromoteTo(d, hn::LoadU(df, grid.constants(way.up) + n + way.kept));
      const auto share = hn::Mul(k, springs.tension), elongation = hn::Mul(springs.tension, springs.length);
      energy = hn::Add(energy, hn::Mul(k, hn::Mul(elongation, elongation)));
      fx = hn::Add(fx, hn::Mul(share, springs.x));
      fy = hn::Add(fy, hn::Mul(share, springs.y));
      fz = hn::Add(fz, hn::Mul(share, springs.z));
    }
    hn::StoreU(fx, d, a.trial_force.axis(0) + n);
    hn::StoreU(fy, d, a.trial_force.axis(1) + n);
    hn::StoreU(fz, d, a.trial_force.axis(2) + n);
    hn::StoreU(energy, d, energies + (n - range.begin));
  }
}

/// Numbers of the CPU's vectors that KeptMatrix keeps.
using Kept = hn::Rebind<std::uint16_t, Floats>;

/// Computes what Bfloat16 makes of a float.
HWY_INLINE void keep(hn::Vec<Halves> value, Bfloat16* to) {
  const hn::RebindToUnsigned<Halves> d;
  const auto whole = hn::BitCast(d, value);
  const auto odd = hn::And(hn::ShiftRight<16>(whole), hn::Set(d, 1));
  const auto upper = hn::ShiftRight<16>(hn::Add(whole, hn::Add(hn::Set(d, 0x7fff), odd)));
  const hn::Rebind<std::uint16_t, Halves> kept;
  hn::StoreU(hn::TruncateTo(kept, upper), kept, reinterpret_cast<std::uint16_t*>(to));
}
HWY_INLINE hn::Vec<Floats> kept_at(const Bfloat16* from) {
  const hn::RebindToUnsigned<Floats> d;
  const auto upper = hn::PromoteTo(d, hn::LoadU(Kept(), reinterpret_cast<const std::uint16_t*>(from)));
  return hn::BitCast(Floats(), hn::ShiftLeft<16>(upper));
}

/// @param kind  not `laplacian`, for which no matrices are kept
void matrices(const SpringGrid& grid, NodeRange range, const SpringArrays& a, Stiffness kind) {
  const Doubles d;
  const Halves df;
  for (std::size_t up = 0; up < kUp; ++up) {
    for (std::size_t n = range.begin; n < range.end; n += hn::Lanes(d)) {
      const Springs springs(a.rest[up + kUp], a.u, n, a.distance[up + kUp]);
      const auto k = hn::PromoteTo(d, hn::LoadU(df, grid.constants(up) + n));
      auto t = springs.tension;
      if (kind == Stiffness::projected) t = hn::Max(t, hn::Zero(d));
      const auto even = hn::Mul(k, t);
      const auto root = hn::Div(hn::Sqrt(hn::Max(hn::Sub(k, even), hn::Zero(d))), springs.length);
      const auto store = [&](std::size_t e, hn::Vec<Doubles> value)
                             HWY_ATTR { keep(hn::DemoteTo(df, value), a.matrix.entry(up, e) + n); };
      store(0, hn::Mul(root, springs.x));
      store(1, hn::Mul(root, springs.y));
      store(2, hn::Mul(root, springs.z));
      store(3, even);
    }
  }
}

/// Sums, over the regular links of each node, of their matrices.
/// @param sums  by node from the first of the range on
void matrix_sums(NodeRange range, const SpringArrays& a, const NodeMatrices& sums) {
  const Floats d;
  for (std::size_t n = range.begin; n < range.end; n += hn::Lanes(d)) {
    auto xx = hn::Zero(d), xy = hn::Zero(d), xz = hn::Zero(d), yy = hn::Zero(d), yz = hn::Zero(d), zz = hn::Zero(d);
    for (int direction = 0; direction < kDirections; ++direction) {
      const LinkSide way(a, direction);
      const auto entry = [&](std::size_t e) HWY_ATTR { return kept_at(a.matrix.entry(way.up, e) + n + way.kept); };
      const auto x = entry(0), y = entry(1), z = entry(2), even = entry(3);
      xx = hn::Add(xx, hn::Add(hn::Mul(x, x), even));
      xy = hn::Add(xy, hn::Mul(x, y));
      xz = hn::Add(xz, hn::Mul(x, z));
      yy = hn::Add(yy, hn::Add(hn::Mul(y, y), even));
      yz = hn::Add(yz, hn::Mul(y, z));
      zz = hn::Add(zz, hn::Add(hn::Mul(z, z), even));
    }
    const auto store = [&](std::size_t e, hn::Vec<Floats> sum)
                           HWY_ATTR { hn::StoreU(sum, d, sums.entry(e) + (n - range.begin)); };
    store(0, xx), store(1, xy), store(2, xz), store(3, yy), store(4, yz), store(5, zz);
  }
}

/// `matrix_sums` of springs that keep their directions.
void constant_sums(const SpringGrid& grid, NodeRange range, const SpringArrays& a, const NodeMatrices& sums) {
  const Floats d;
  for (std::size_t n = range.begin; n < range.end; n += hn::Lanes(d)) {
    auto sum = hn::Zero(d);
    for (int direction = 0; direction < kDirections; ++direction) {
      const LinkSide way(a, direction);
      sum = hn::Add(sum, hn::LoadU(d, grid.constants(way.up) + n + way.kept));
    }
    for (std::size_t e = 0; e < NodeMatrices::kEntries; ++e) {
      const bool is_diagonal = e == 0 || e == 3 || e == 5;
      hn::StoreU(is_diagonal ? sum : hn::Zero(d), d, sums.entry(e) + (n - range.begin));
    }
  }
}

/// A float vector of each of several nodes.
struct Vectors {
  hn::Vec<Floats> x, y, z;
};
HWY_INLINE Vectors vectors_at(const NodeVectors<float>& v, std::size_t n) {
  const Floats d;
  return {hn::LoadU(d, v.axis(0) + n), hn::LoadU(d, v.axis(1) + n), hn::LoadU(d, v.axis(2) + n)};
}
HWY_INLINE Vectors difference(const Vectors& a, const Vectors& b) {
  return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)};
}
HWY_INLINE void put(const Vectors& v, const NodeVectors<float>& to, std::size_t n) {
  const Floats d;
  hn::StoreU(v.x, d, to.axis(0) + n);
  hn::StoreU(v.y, d, to.axis(1) + n);
  hn::StoreU(v.z, d, to.axis(2) + n);
}

/// Sums, over the regular links of each node, of the link's matrix times the node's vector minus the neighbour's.
void product(NodeRange range, const SpringArrays& a, const NodeVectors<float>& v, const NodeVectors<float>& result) {
  const Floats d;
  for (std::size_t n = range.begin; n < range.end; n += hn::Lanes(d)) {
    const Vectors own = vectors_at(v, n);
    Vectors sum{hn::Zero(d), hn::Zero(d), hn::Zero(d)};
    for (int direction = 0; direction < kDirections; ++direction) {
      const LinkSide way(a, direction);
      const auto entry = [&](std::size_t e) HWY_ATTR { return kept_at(a.matrix.entry(way.up, e) + n + way.kept); };
      const Vectors by = difference(own, vectors_at(v, n + way.distance));
      const auto ax = entry(0), ay = entry(1), az = entry(2), even = entry(3);
      const auto along = hn::Add(hn::Add(hn::Mul(ax, by.x), hn::Mul(ay, by.y)), hn::Mul(az, by.z));
      sum.x = hn::Add(sum.x, hn::Add(hn::Mul(ax, along), hn::Mul(even, by.x)));
      sum.y = hn::Add(sum.y, hn::Add(hn::Mul(ay, along), hn::Mul(even, by.y)));
      sum.z = hn::Add(sum.z, hn::Add(hn::Mul(az, along), hn::Mul(even, by.z)));
    }
    put(sum, result, n);
  }
}

/// `product` of springs that keep their directions.
void constant_product(const SpringGrid& grid, NodeRange range, const SpringArrays& a, const NodeVectors<float>& v,
                      const NodeVectors<float>& result) {
  const Floats d;
  for (std::size_t n = range.begin; n < range.end; n += hn::Lanes(d)) {
    const Vectors own = vectors_at(v, n);
    Vectors sum{hn::Zero(d), hn::Zero(d), hn::Zero(d)};
    for (int direction = 0; direction < kDirections; ++direction) {
      const LinkSide way(a, direction);
      const auto even = hn::LoadU(d, grid.constants(way.up) + n + way.kept);
      const Vectors by = difference(own, vectors_at(v, n + way.distance));
      sum.x = hn::Add(sum.x, hn::Mul(even, by.x));
      sum.y = hn::Add(sum.y, hn::Mul(even, by.y));
      sum.z = hn::Add(sum.z, hn::Mul(even, by.z));
    }
    put(sum, result, n);
  }
}

/// The products of two vectors of each node, in double.
void dots(NodeRange range, const NodeVectors<float>& one, const NodeVectors<float>& other, double* result) {
  const Doubles d;
  const Halves df;
  for (std::size_t n = range.begin; n < range.end; n += hn::Lanes(d)) {
    const auto product = [&](std::size_t axis) HWY_ATTR {
      const auto at = [&](const NodeVectors<float>& v)
                          HWY_ATTR { return hn::PromoteTo(d, hn::LoadU(df, v.axis(axis) + n)); };
      return hn::Mul(at(one), at(other));
    };
    hn::StoreU(hn::Add(hn::Add(product(0), product(1)), product(2)), d, result + (n - range.begin));
  }
}

void descend(NodeRange range, const SpringArrays& a) {
  const Floats d;
  const hn::RebindToSigned<Floats> di;
  const hn::Rebind<std::uint8_t, Floats> du;
  const auto length = hn::Set(d, a.state->length), share = hn::Set(d, a.state->share);
  const auto* role = reinterpret_cast<const std::uint8_t*>(a.role);
  for (std::size_t n = range.begin; n < range.end; n += hn::Lanes(d)) {
    const auto roles = hn::PromoteTo(di, hn::LoadU(du, role + n));
    const auto is_free = hn::RebindMask(d, hn::Eq(roles, hn::Set(di, static_cast<std::int32_t>(SpringRole::free))));
    // Where a node is not free z is 0, and with s, x, r and p stay so.
    const auto step = [&](std::size_t axis) HWY_ATTR {
      const auto at = [&](const NodeVectors<float>& v) HWY_ATTR { return hn::LoadU(d, v.axis(axis) + n); };
      const auto put = [&](hn::Vec<Floats> value, const NodeVectors<float>& v)
                           HWY_ATTR { hn::StoreU(value, d, v.axis(axis) + n); };
      const auto p = hn::Add(at(a.z), hn::Mul(share, at(a.p)));
      const auto s = hn::IfThenElseZero(is_free, hn::Add(at(a.q), hn::Mul(share, at(a.s))));
      const auto r = hn::Sub(at(a.r), hn::Mul(length, s));
      put(p, a.p);
      put(s, a.s);
      put(hn::Add(at(a.x), hn::Mul(length, p)), a.x);
      put(r, a.r);
      return r;
    };
    const auto x = step(0), y = step(1), z = step(2);
    const auto entry = [&](std::size_t e) HWY_ATTR { return hn::LoadU(d, a.inverse.entry(e) + n); };
    const auto row = [&](std::size_t axis, std::size_t ex, std::size_t ey, std::size_t ez) HWY_ATTR {
      const auto sum = hn::Add(hn::Add(hn::Mul(entry(ex), x), hn::Mul(entry(ey), y)), hn::Mul(entry(ez), z));
      hn::StoreU(sum, d, a.z.axis(axis) + n);
    };
    row(0, 0, 1, 2), row(1, 1, 3, 4), row(2, 2, 4, 5);
  }
}

}  // namespace tetwarp::simulate::HWY_NAMESPACE

HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace tetwarp::simulate {

HWY_EXPORT(pulls);
HWY_EXPORT(matrices);
HWY_EXPORT(matrix_sums);
HWY_EXPORT(constant_sums);
HWY_EXPORT(product);
HWY_EXPORT(constant_product);
HWY_EXPORT(dots);
HWY_EXPORT(descend);

namespace {

/// Calls `visit(link, number)` for the odd links from the nodes of a block.
template <class Visit>
void for_odd_links(const SpringGrid& grid, NodeRange range, Visit&& visit) {
  const std::size_t block = range.begin / SpringGrid::kBlock;
  for (std::size_t number = grid.first_odd[block]; number < grid.first_odd[block + 1]; ++number) {
    visit(grid.odd[number], number);
  }
}

Stretched<double> odd_spring(const SpringArrays& a, const OddLink& link, const NodeVectors<double>& u) {
  return stretched(a.rest[link.direction], u[link.other] - u[link.node]);
}

/// Sets `result` to what `sweeps::product` gives of each node.
void whole_product(const SpringGrid& grid, NodeRange range, const SpringArrays& a, Stiffness kind,
                   const NodeVectors<float>& v, const NodeVectors<float>& result) {
  if (kind == Stiffness::laplacian) {
    HWY_DYNAMIC_DISPATCH(constant_product)(grid, range, a, v, result);
  } else {
    HWY_DYNAMIC_DISPATCH(product)(range, a, v, result);
  }
  for_odd_links(grid, range, [&](const OddLink& link, std::size_t number) {
    const glm::vec3 share = grid.odd_matrix[number] * (v[link.node] - v[link.other]);
    result.set(link.node, result[link.node] + share);
  });
}

}  // namespace

void sweep(SpringGrid& grid, NodeRange range, const sweeps::Matrices& matrices) {
  if (matrices.kind != Stiffness::laplacian) HWY_DYNAMIC_DISPATCH(matrices)(grid, range, matrices.a, matrices.kind);
  for_odd_links(grid, range, [&](const OddLink& link, std::size_t number) {
    if (matrices.kind == Stiffness::laplacian) {
      grid.odd_matrix[number] = {glm::vec3(0), link.stiffness};
      return;
    }
    const Stretched<double> spring = odd_spring(matrices.a, link, matrices.a.u);
    grid.odd_matrix[number] = KeptMatrix(spring_matrix(spring, double{link.stiffness}, matrices.kind)).in_float();
  });
}

void sweep(const SpringGrid& grid, NodeRange range, const sweeps::Inverses& inverses) {
  float room[NodeMatrices::kEntries * SpringGrid::kBlock];
  const NodeMatrices sums{room, SpringGrid::kBlock};
  if (inverses.kind == Stiffness::laplacian) {
    HWY_DYNAMIC_DISPATCH(constant_sums)(grid, range, inverses.a, sums);
  } else {
    HWY_DYNAMIC_DISPATCH(matrix_sums)(range, inverses.a, sums);
  }
  for_odd_links(grid, range, [&](const OddLink& link, std::size_t number) {
    Symmetric<float> sum = sums[link.node - range.begin];
    sum = sum + grid.odd_matrix[number].full();
    sums.set(link.node - range.begin, sum);
  });
  for (std::size_t n = range.begin; n < range.end; ++n) inverses.finish(inverses.a, n, sums[n - range.begin]);
}

void sweep(const SpringGrid& grid, NodeRange range, const sweeps::PlacedForces& forces) {
  whole_product(grid, range, forces.a, forces.kind, forces.a.q, forces.a.r);
  for (std::size_t n = range.begin; n < range.end; ++n) forces.finish(forces.a, n, forces.a.r[n]);
}

void sweep(const SpringGrid& grid, NodeRange range, const sweeps::Bend& bend, Products* sums) {
  const SpringArrays& a = bend.a;
  whole_product(grid, range, a, bend.kind, a.z, a.q);
  double rz[SpringGrid::kBlock], zq[SpringGrid::kBlock];
  HWY_DYNAMIC_DISPATCH(dots)(range, a.r, a.z, rz);
  HWY_DYNAMIC_DISPATCH(dots)(range, a.z, a.q, zq);
  for (std::size_t n = range.begin; n < range.end; ++n) {
    const std::size_t of = n - range.begin;
    sums[of] = a.is_free(n) ? Products{rz[of], zq[of]} : Products{};
  }
}

void sweep(const SpringGrid&, NodeRange range, const sweeps::Descend& descend) {
  HWY_DYNAMIC_DISPATCH(descend)(range, descend.a);
}

void sweep(const SpringGrid& grid, NodeRange range, const sweeps::StrainOf& strain, Sums* sums) {
  double energies[SpringGrid::kBlock];
  const NodeVectors<double>& force = strain.a.trial_force;
  HWY_DYNAMIC_DISPATCH(pulls)(grid, range, strain.a, energies);
  for_odd_links(grid, range, [&](const OddLink& link, std::size_t) {
    const Pull<double> pull(odd_spring(strain.a, link, strain.a.trial), double{link.stiffness});
    force.set(link.node, force[link.node] + pull.force);
    energies[link.node - range.begin] += pull.energy;
  });
  for (std::size_t n = range.begin; n < range.end; ++n) {
    sums[n - range.begin] = strain.finish(strain.a, n, force[n], energies[n - range.begin]);
  }
}

}  // namespace tetwarp::simulate

#endif  // HWY_ONCE
