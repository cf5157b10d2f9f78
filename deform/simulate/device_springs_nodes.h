// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>

#include "deform/simulate/rigid_motion.h"
#include "deform/simulate/spring_engine.h"
#include "deform/simulate/spring_step.h"

// What a device does for one node in each sweep of mass-spring. Every node gathers from its 26 links and writes only
// its own values, so no order matters but that of sums, which the machine keeps (device_springs.h).

namespace tetwarp::simulate {

/// The state of conjugate gradients between sweeps, in the device's memory.
struct GradientState {
  SolveEffort effort;
  double rz = 0, least = 0, gained = 0;
  float length = 0, share = 0;
  int iterations = 0;
  bool is_indefinite = false, is_done = false;
};

/// The sum of what a sweep returns.
struct Sum {
  double sum = 0;
  TETWARP_HD void add(const Sum& other) { sum += other.sum; }
};

/// All arrays in a device's memory; vectors have one entry a node.
struct DeviceArrays {
  std::size_t nodes;
  const std::int32_t* neighbour;  ///< see Model::neighbour
  const float* stiffness;
  const std::uint32_t* vertex;
  const SpringRole* role;
  RestLink<double> rest[kDirections];
  RestPlace rest_place;
  /// Displacement, mm: now, at a trial step, and of placed nodes where they come from and go.
  glm::dvec3 *u, *trial, *start, *goal;
  /// Force on free nodes, N: now, at the start, and at the goal.
  glm::dvec3 *load, *load_from, *load_to;
  glm::dvec3 *force, *trial_force;  ///< net force on free nodes at u and at trial, N
  glm::vec3 *x, *r, *z, *p, *q;     ///< the direction that is sought, and vectors of conjugate gradients
  /// At up * nodes + node: the matrix of the link from the node in direction kUp + up.
  SpringMatrix<float>* matrix;
  Symmetric<float>* inverse;  ///< by free node: the inverse of its sum of matrices; 0 for other nodes
  glm::vec3* shown;
  GradientState* state;
  Sums* result;
  Ways* ways;

  TETWARP_HD std::int32_t other(int direction, std::size_t n) const {
    return neighbour[static_cast<std::size_t>(direction) * nodes + n];
  }
  /// The matrix of the link to a neighbour. It is stored at the lower end of the link.
  TETWARP_HD const SpringMatrix<float>& of_link(int direction, std::size_t n, std::int32_t to) const {
    return direction >= kUp
               ? matrix[static_cast<std::size_t>(direction - kUp) * nodes + n]
               : matrix[static_cast<std::size_t>(opposite(direction) - kUp) * nodes + static_cast<std::size_t>(to)];
  }
  TETWARP_HD bool is_free(std::size_t n) const { return role[n] == SpringRole::free; }
};

namespace sweeps {

TETWARP_HD inline glm::vec3 in_float(const glm::dvec3& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}
TETWARP_HD inline glm::dvec3 in_double(const glm::vec3& v) { return {double{v.x}, double{v.y}, double{v.z}}; }
TETWARP_HD inline glm::dvec3 on_the_way(const glm::dvec3& from, const glm::dvec3& to, double part) {
  return part == 1 ? to : from + part * (to - from);
}

/// A sweep that always runs. GradientSweep is skipped once conjugate gradients are done.
struct Sweep {
  DeviceArrays a;
  TETWARP_HD bool is_idle() const { return false; }
};
struct GradientSweep {
  DeviceArrays a;
  TETWARP_HD bool is_idle() const { return a.state->is_done; }
};

/// Takes over new loads; the present ones are where they start. @param force  null: no forces
struct TakeLoads : Sweep {
  const glm::vec3 *goals, *forces;
  TETWARP_HD void operator()(std::size_t n) const {
    a.start[n] = a.u[n];
    a.goal[n] = in_double(goals[n]);
    a.load_from[n] = a.is_free(n) ? a.load[n] : glm::dvec3(0);
    a.load_to[n] = a.is_free(n) && forces ? in_double(forces[n]) : glm::dvec3(0);
  }
};

/// Does what SpringEngine::aim says.
struct Aim : Sweep {
  double part;
  TETWARP_HD Ways operator()(std::size_t n) const {
    a.load[n] = on_the_way(a.load_from[n], a.load_to[n], part);
    a.trial[n] = a.role[n] == SpringRole::placed ? on_the_way(a.start[n], a.goal[n], part) : a.u[n];
    if (a.role[n] != SpringRole::placed) return {};
    return Ways::of(a.rest_place(a.vertex[n]) + a.u[n], a.trial[n] - a.u[n]);
  }
};

/// Does what SpringEngine::carry says.
struct Carry : Sweep {
  RigidMotion motion;
  TETWARP_HD void operator()(std::size_t n) const {
    if (a.role[n] == SpringRole::kept) return;
    a.u[n] += motion.way_of(a.rest_place(a.vertex[n]) + a.u[n]);
    if (a.is_free(n)) a.trial[n] = a.u[n];
  }
};

/// Sets p to how far placed nodes have to go.
struct PlacedMotion : Sweep {
  TETWARP_HD void operator()(std::size_t n) const { a.p[n] = in_float(a.trial[n] - a.u[n]); }
};

/// Computes the matrices of the links up from a node, with springs where they are now.
struct Matrices : Sweep {
  Stiffness kind;
  TETWARP_HD void operator()(std::size_t n) const {
    for (int d = kUp; d < kDirections; ++d) {
      const std::int32_t to = a.other(d, n);
      if (to < 0) continue;
      const double k = double{a.stiffness[static_cast<std::size_t>(d) * a.nodes + n]};
      const Stretched<double> spring = stretched(a.rest[d], a.u[to] - a.u[n]);
      a.matrix[static_cast<std::size_t>(d - kUp) * a.nodes + n] = spring_matrix(spring, k, kind);
    }
  }
};

struct Inverses : Sweep {
  TETWARP_HD void operator()(std::size_t n) const {
    Symmetric<float> sum{};
    for (int d = 0; d < kDirections && a.is_free(n); ++d) {
      const std::int32_t to = a.other(d, n);
      if (to >= 0) sum.add(a.of_link(d, n, to).full());
    }
    a.inverse[n] = a.is_free(n) ? inverse_block(sum) : Symmetric<float>{};
  }
};

TETWARP_HD inline glm::vec3 product(const DeviceArrays& a, std::size_t n) {
  const glm::vec3 own = a.p[n];
  glm::vec3 sum(0);
  for (int d = 0; d < kDirections; ++d) {
    const std::int32_t to = a.other(d, n);
    if (to >= 0) sum += a.of_link(d, n, to) * (own - a.p[to]);
  }
  return sum;
}

/// Sets r to the forces on free nodes if placed nodes alone went their way.
struct PlacedForces : Sweep {
  TETWARP_HD void operator()(std::size_t n) const { a.r[n] = a.is_free(n) ? -product(a, n) : glm::vec3(0); }
};
struct Forces : Sweep {
  TETWARP_HD void operator()(std::size_t n) const { a.r[n] = in_float(a.force[n]); }
};

/// Sets x = 0, p = z = preconditioned r, and sums r.z.
struct Begin : Sweep {
  TETWARP_HD Sum operator()(std::size_t n) const {
    a.x[n] = glm::vec3(0);
    a.p[n] = a.z[n] = a.inverse[n] * a.r[n];
    return {dot3(in_double(a.r[n]), in_double(a.z[n]))};
  }
};
struct AfterBegin {
  GradientState* state;
  SolveEffort effort;
  TETWARP_HD void operator()(const Sum& rz) const {
    *state = {.effort = effort, .rz = rz.sum, .least = kFloatRounding * rz.sum, .is_done = !(rz.sum > 0)};
  }
};

/// Sets q = A p, and sums the curvature p.q over free nodes.
struct Bend : GradientSweep {
  TETWARP_HD Sum operator()(std::size_t n) const {
    if (!a.is_free(n)) return {};
    a.q[n] = product(a, n);
    return {dot3(in_double(a.p[n]), in_double(a.q[n]))};
  }
};
struct AfterBend {
  GradientState* state;
  TETWARP_HD void operator()(const Sum& curvature) const {
    if (curvature.sum > 0) {
      state->length = static_cast<float>(state->rz / curvature.sum);
    } else {
      state->is_indefinite = state->is_done = true;
    }
  }
};

/// Sets x += length p, r -= length q, z = preconditioned r, and sums r.z.
struct Descend : GradientSweep {
  TETWARP_HD Sum operator()(std::size_t n) const {
    if (!a.is_free(n)) return {};
    const float length = a.state->length;
    a.x[n] += length * a.p[n];
    a.r[n] -= length * a.q[n];
    a.z[n] = a.inverse[n] * a.r[n];
    return {dot3(in_double(a.r[n]), in_double(a.z[n]))};
  }
};
struct AfterDescend {
  GradientState* state;
  TETWARP_HD void operator()(const Sum& next) const {
    GradientState& s = *state;
    const double gain = double{s.length} * s.rz / 2;
    s.gained += gain;
    ++s.iterations;
    s.share = static_cast<float>(next.sum / s.rz);
    s.rz = next.sum;
    s.is_done = !(s.rz > s.least) || s.iterations >= s.effort.most || s.effort.is_enough(s.iterations, gain, s.gained);
  }
};

/// Sets p = z + share p.
struct NextDirection : GradientSweep {
  TETWARP_HD void operator()(std::size_t n) const { a.p[n] = a.z[n] + a.state->share * a.p[n]; }
};

/// Sums minus the net forces times the direction, and finds the square of its longest entry.
struct SearchDirection : Sweep {
  TETWARP_HD Sums operator()(std::size_t n) const {
    const glm::dvec3 x = in_double(a.x[n]);
    return {.slope = -dot3(a.force[n], x), .most = dot3(x, x)};
  }
};

/// Adds the direction to the trial displacement, so that free nodes follow the placed ones.
struct Follow : Sweep {
  TETWARP_HD void operator()(std::size_t n) const { a.trial[n] += in_double(a.x[n]); }
};
struct Go : Sweep {
  double part;
  TETWARP_HD void operator()(std::size_t n) const {
    a.trial[n] = part == 0 ? a.u[n] : a.u[n] + part * in_double(a.x[n]);
  }
};

/// Computes the strain at the trial displacement, as SpringEngine::try_step does; forces are squared.
struct StrainOf : Sweep {
  TETWARP_HD Sums operator()(std::size_t n) const {
    glm::dvec3 force = a.load[n];
    Sums sums{.sum = -dot3(a.load[n], a.trial[n])};
    for (int d = 0; d < kDirections; ++d) {
      const std::int32_t to = a.other(d, n);
      if (to < 0) continue;
      const Stretched<double> spring = stretched(a.rest[d], a.trial[to] - a.trial[n]);
      const double pull = double{a.stiffness[static_cast<std::size_t>(d) * a.nodes + n]} * spring.elongation;
      sums.sum += pull * spring.elongation / 4;
      force += pull * spring.unit;
    }
    (a.is_free(n) ? sums.most : sums.most_placed) = a.role[n] == SpringRole::kept ? 0 : dot3(force, force);
    sums.most_load = dot3(a.load[n], a.load[n]);
    a.trial_force[n] = a.is_free(n) ? force : glm::dvec3(0);
    sums.slope = -dot3(a.trial_force[n], in_double(a.x[n]));
    return sums;
  }
};

struct Show : Sweep {
  TETWARP_HD void operator()(std::size_t n) const { a.shown[n] = in_float(a.u[n]); }
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
