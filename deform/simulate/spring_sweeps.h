// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/simulate/spring_arrays.h"

// What mass-spring does for one node in each sweep over the nodes. Every node gathers from its links and writes only
// its own values, so no order matters but that of sums, which the machine keeps (spring_solver.h).

namespace tetwarp::simulate {

/// The sums over free nodes of products of vectors of conjugate gradients.
struct Products {
  double rz = 0, zq = 0;
  TETWARP_HD void add(const Products& other) {
    rz += other.rz;
    zq += other.zq;
  }
};

namespace sweeps {

TETWARP_HD inline glm::vec3 in_float(const glm::dvec3& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}
TETWARP_HD inline glm::dvec3 in_double(const glm::vec3& v) { return {double{v.x}, double{v.y}, double{v.z}}; }
TETWARP_HD inline glm::dvec3 on_the_way(const glm::dvec3& from, const glm::dvec3& to, double part) {
  return part == 1 ? to : from + part * (to - from);
}

/// What a sweep does for one node is its function `at`, so that a kernel may do several things with the same arrays.
struct Sweep {
  SpringArrays a;
};

/// Sets the displacement.
struct Start : Sweep {
  const glm::vec3* displacement;
  TETWARP_HD void operator()(std::size_t n) const {
    a.u.set(n, in_double(displacement[n]));
    a.start.set(n, a.u[n]);
  }
};

/// Writes what a state has of each node: its displacement, and the force on it.
struct WriteState : Sweep {
  static constexpr std::size_t kNumbers = 6;
  double* to;
  TETWARP_HD void operator()(std::size_t n) const {
    const glm::dvec3 u = a.u[n], load = a.load[n];
    double* const of = to + kNumbers * n;
    of[0] = u.x;
    of[1] = u.y;
    of[2] = u.z;
    of[3] = load.x;
    of[4] = load.y;
    of[5] = load.z;
  }
};
/// Takes over what `WriteState` wrote.
struct ReadState : Sweep {
  const double* from;
  TETWARP_HD void operator()(std::size_t n) const {
    const double* const of = from + WriteState::kNumbers * n;
    a.u.set(n, {of[0], of[1], of[2]});
    a.start.set(n, {of[0], of[1], of[2]});
    a.load.set(n, {of[3], of[4], of[5]});
  }
};

/// Takes over new loads; the present ones are where they start. @param force  null: no forces
struct TakeLoads : Sweep {
  const glm::vec3 *goals, *forces;
  TETWARP_HD void operator()(std::size_t n) const {
    a.start.set(n, a.u[n]);
    a.goal.set(n, in_double(goals[n]));
    a.load_from.set(n, a.is_free(n) ? a.load[n] : glm::dvec3(0));
    a.load_to.set(n, a.is_free(n) && forces ? in_double(forces[n]) : glm::dvec3(0));
  }
};

/// Does what SpringEngine::aim says.
struct Aim : Sweep {
  double part;
  TETWARP_HD Ways operator()(std::size_t n) const {
    const glm::dvec3 u = a.u[n];
    a.load.set(n, on_the_way(a.load_from[n], a.load_to[n], part));
    if (a.role[n] != SpringRole::placed) {
      a.trial.set(n, u);
      return {};
    }
    const glm::dvec3 to = on_the_way(a.start[n], a.goal[n], part);
    a.trial.set(n, to);
    return Ways::of(a.rest_place(a.vertex[n]) + u, to - u);
  }
};

/// Does what SpringEngine::carry says.
struct Carry : Sweep {
  RigidMotion motion;
  TETWARP_HD void operator()(std::size_t n) const {
    if (a.role[n] == SpringRole::kept) return;
    const glm::dvec3 u = a.u[n], carried = u + motion.way_of(a.rest_place(a.vertex[n]) + u);
    a.u.set(n, carried);
    if (a.is_free(n)) a.trial.set(n, carried);
  }
};

/// Sets q to how far placed nodes have to go.
struct PlacedMotion : Sweep {
  TETWARP_HD static void at(const SpringArrays& a, std::size_t n) { a.q.set(n, in_float(a.trial[n] - a.u[n])); }
  TETWARP_HD void operator()(std::size_t n) const { at(a, n); }
};

/// The matrix of a spring that keeps its direction, a multiple of one: a SpringMatrix with nothing across.
struct EvenSpring {
  float even;
  TETWARP_HD glm::vec3 operator*(const glm::vec3& v) const { return even * v; }
  TETWARP_HD Symmetric<float> full() const { return {even, 0, 0, even, 0, even}; }
};

/// Calls `work(matrix)`, where `matrix(d, n, to)` is that of a link. Of springs that keep their directions the constant
/// is all there is to it, and no other matrix is kept.
template <class Work>
TETWARP_HD auto with_matrices(const SpringArrays& a, Stiffness kind, const Work& work) {
  if (kind == Stiffness::laplacian)
    return work([&](int d, std::size_t n, std::int32_t) { return EvenSpring{a.stiffness_of(d, n)}; });
  return work([&](int d, std::size_t n, std::int32_t to) { return a.of_link(d, n, to); });
}

/// Computes the matrices of the links up from a node, with springs where they are now.
struct Matrices : Sweep {
  Stiffness kind;
  TETWARP_HD void operator()(std::size_t n) const { at(a, kind, n); }
  TETWARP_HD static void at(const SpringArrays& a, Stiffness kind, std::size_t n) {
    if (kind == Stiffness::laplacian) return;
    const glm::dvec3 u = a.u[n];
    for (int d = kUp; d < kDirections; ++d) {
      const std::int32_t to = a.other(d, n);
      if (to < 0) continue;
      const Stretched<double> spring = stretched(a.rest[d], a.u[static_cast<std::size_t>(to)] - u);
      a.matrix.set(static_cast<std::size_t>(d - kUp), n, KeptMatrix(spring_matrix(spring, a.constant(d, n), kind)));
    }
  }
};

/// Inverts each free node's sum of matrices.
struct Inverses : Sweep {
  Stiffness kind;
  TETWARP_HD void operator()(std::size_t n) const { at(a, kind, n); }
  TETWARP_HD static void at(const SpringArrays& a, Stiffness kind, std::size_t n) {
    Symmetric<float> sum{};
    if (a.is_free(n)) {
      sum = with_matrices(a, kind, [&](const auto& matrix) {
        return a.sum_links<Symmetric<float>>(n, [&](int d, std::int32_t to) { return matrix(d, n, to).full(); });
      });
    }
    finish(a, n, sum);
  }
  TETWARP_HD static void finish(const SpringArrays& a, std::size_t n, const Symmetric<float>& sum) {
    a.inverse.set(n, a.is_free(n) ? inverse_block(sum) : Symmetric<float>{});
  }
};

/// The sum over a node's links of the link's matrix times the node's vector minus the neighbour's.
TETWARP_HD inline glm::vec3 product(const SpringArrays& a, Stiffness kind, const NodeVectors<float>& v, std::size_t n) {
  const glm::vec3 own = v[n];
  return with_matrices(a, kind, [&](const auto& matrix) {
    return a.sum_links<glm::vec3>(
        n, [&](int d, std::int32_t to) { return matrix(d, n, to) * (own - v[static_cast<std::size_t>(to)]); });
  });
}

/// Sets r to the forces on free nodes if placed nodes alone went their way.
struct PlacedForces : Sweep {
  Stiffness kind;
  TETWARP_HD void operator()(std::size_t n) const { at(a, kind, n); }
  TETWARP_HD static void at(const SpringArrays& a, Stiffness kind, std::size_t n) {
    finish(a, n, a.is_free(n) ? product(a, kind, a.q, n) : glm::vec3(0));
  }
  /// @param pull  of the node on its links
  TETWARP_HD static void finish(const SpringArrays& a, std::size_t n, const glm::vec3& pull) {
    a.r.set(n, a.is_free(n) ? -pull : glm::vec3(0));
  }
};
struct Forces : Sweep {
  TETWARP_HD void operator()(std::size_t n) const { at(a, n); }
  TETWARP_HD static void at(const SpringArrays& a, std::size_t n) { a.r.set(n, in_float(a.force[n])); }
};

// Conjugate gradients with one sum an iteration (Chronopoulos and Gear 1989, "s-step iterative methods for symmetric
// linear systems"): A is multiplied by the preconditioned residual z, not by the direction p, whose product s with A
// follows as p does.

/// Sets x = p = s = 0, and z = preconditioned r.
struct Begin : Sweep {
  TETWARP_HD void operator()(std::size_t n) const { at(a, n); }
  TETWARP_HD static void at(const SpringArrays& a, std::size_t n) {
    a.x.set(n, glm::vec3(0));
    a.p.set(n, glm::vec3(0));
    a.s.set(n, glm::vec3(0));
    a.z.set(n, a.inverse[n] * a.r[n]);
  }
};

/// Sets q = A z, and sums products over free nodes. Elsewhere z is 0, and q is not used.
struct Bend : Sweep {
  Stiffness kind;
  TETWARP_HD Products operator()(std::size_t n) const { return at(a, kind, n); }
  TETWARP_HD static Products at(const SpringArrays& a, Stiffness kind, std::size_t n) {
    if (!a.is_free(n)) return {};
    const glm::vec3 q = product(a, kind, a.z, n);
    a.q.set(n, q);
    const glm::dvec3 z = in_double(a.z[n]);
    return {.rz = dot3(in_double(a.r[n]), z), .zq = dot3(z, in_double(q))};
  }
};
/// Finds how the next direction is made of z and the one before, and how far it is gone.
struct AfterBend {
  GradientState* state;
  TETWARP_HD void operator()(const Products& sums) const {
    GradientState& s = *state;
    const bool is_first = s.iterations == 0;
    const double share = is_first ? 0 : sums.rz / s.rz;
    const double curvature = is_first ? sums.zq : sums.zq - share * sums.rz / double{s.length};  // p.s
    if (is_first) s.least = kFloatRounding * sums.rz;
    const bool is_left = sums.rz > s.least;
    s.descends = is_left && curvature > 0;
    s.is_indefinite = is_left && !s.descends;
    s.is_done = true;
    if (!s.descends) return;
    s.rz = sums.rz;
    s.share = static_cast<float>(share);
    s.length = static_cast<float>(s.rz / curvature);
    const double gain = double{s.length} * s.rz / 2;
    s.gained += gain;
    ++s.iterations;
    s.is_done = s.iterations >= s.effort.most || s.effort.is_enough(s.iterations, gain, s.gained);
  }
};

/// Sets p = z + share p, s = q + share s, x += length p, r -= length s, z = preconditioned r.
struct Descend : Sweep {
  TETWARP_HD void operator()(std::size_t n) const { at(a, a.state->share, a.state->length, n); }
  TETWARP_HD static void at(const SpringArrays& a, float share, float length, std::size_t n) {
    if (!a.is_free(n)) return;
    const glm::vec3 p = a.z[n] + share * a.p[n], s = a.q[n] + share * a.s[n], r = a.r[n] - length * s;
    a.p.set(n, p);
    a.s.set(n, s);
    a.x.set(n, a.x[n] + length * p);
    a.r.set(n, r);
    a.z.set(n, a.inverse[n] * r);
  }
};

/// Adds the direction to the trial displacement, so that free nodes follow the placed ones.
struct Follow : Sweep {
  TETWARP_HD void operator()(std::size_t n) const { at(a, n); }
  TETWARP_HD static void at(const SpringArrays& a, std::size_t n) {
    if (a.is_free(n)) a.trial.set(n, a.trial[n] + in_double(a.x[n]));
  }
};
struct Go : Sweep {
  double part;
  TETWARP_HD void operator()(std::size_t n) const { at(a, part, n); }
  TETWARP_HD static void at(const SpringArrays& a, double part, std::size_t n) {
    a.trial.set(n, part == 0 ? a.u[n] : a.u[n] + part * in_double(a.x[n]));
  }
};

/// Computes the strain at the trial displacement, as SpringEngine::try_step does, and what Sums says of the direction.
struct StrainOf : Sweep {
  TETWARP_HD Sums operator()(std::size_t n) const { return at(a, n); }
  TETWARP_HD static Sums at(const SpringArrays& a, std::size_t n) {
    const glm::dvec3 own = a.trial[n];
    const auto all = a.sum_links<Pull<double>>(n, [&](int d, std::int32_t to) {
      return Pull<double>(stretched(a.rest[d], a.trial[static_cast<std::size_t>(to)] - own), a.constant(d, n));
    });
    return finish(a, n, all.force, all.energy);
  }
  /// @param force   of the node's springs  @param energy  twice the sum of their energies, of which the node has half
  TETWARP_HD static Sums finish(const SpringArrays& a, std::size_t n, glm::dvec3 force, double energy) {
    const glm::dvec3 load = a.load[n];
    force += load;
    const glm::dvec3 net = a.is_free(n) ? force : glm::dvec3(0), direction = in_double(a.x[n]);
    a.trial_force.set(n, net);
    Sums sums{.energy = energy / 4 - dot3(load, a.trial[n]),
              .slope = -dot3(net, direction),
              .slope_before = -dot3(a.force[n], direction)};
    (a.is_free(n) ? sums.free_force : sums.placed_force) = a.role[n] == SpringRole::kept ? 0 : dot3(force, force);
    sums.load = dot3(load, load);
    sums.length = dot3(direction, direction);
    return sums;
  }
};

struct Show : Sweep {
  float square;  ///< see `shown_of`
  TETWARP_HD void operator()(std::size_t n) const { a.shown[n] = shown_of(a.shown[n], in_float(a.u[n]), square); }
};

/// Keeps the result of a sum where the host fetches it.
template <class T>
struct Keep {
  T* result;
  TETWARP_HD void operator()(const T& sums) const { *result = sums; }
};
template <class T>
Keep(T*) -> Keep<T>;

}  // namespace sweeps

}  // namespace tetwarp::simulate
