// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>
#include <span>
#include <vector>

#include "deform/simulate/simulation.h"

namespace tetwarp::simulate {

/// ChainMail (S. F. Gibson, "3D ChainMail: a fast algorithm for deforming volumetric objects", 1997), with limits of
/// each link its own, by an algorithm that knows no order.
///
/// For each link along an axis and each component c along the lattice's axes, the displacements u of its ends must keep
/// lo_c <= u_upper - u_lower <= hi_c, lo_c <= 0 <= hi_c: difference constraints, each component by itself.
/// Displacements and limits are whole numbers of 2^-16 mm, limits rounded towards 0, so that no sum is ever rounded.
///
/// 1. The chain. Let d(f, v) be the length of the shortest path from f to v, where a link costs hi upwards and -lo
///    downwards. Placed nodes f leave a node v the displacements from L = max_f (u_f - d(v, f)) to U = min_f (u_f +
///    d(f, v)). No cost is negative, so lowering U (raising L) link by link until nothing changes ends, and ends at the
///    same numbers whatever the order: U is the largest of all that keep the limits below its start (Bellman-Ford). A
///    free node then goes to max(L, min(u, U)): as far as it is forced to. The largest and the smallest of two states
///    within the limits, node by node, are within them, and so is this one. This is where Gibson's queue ends for one
///    pulled element and equal limits, and where Schill's (2001) tries to for unequal ones. Where placed nodes
///    contradict each other, L > U: then it is max(U, min(u, L)), also within the limits, of the placed nodes too;
///    these are shown at their goals, so that only links at them are broken: see links_beyond_limits.
/// 2. Relaxation. Each node goes towards the mean of its neighbours, weighed by one over the squared length of the link
///    (whatever the tissue: limits tell tissues apart, and moduli a million times apart would not settle in any number
///    of steps), plus a part of its last motion (second-order Richardson, Golub & Varga 1961: of the order of N steps
///    instead of N^2 for N nodes in a row), kept between L and U. This y is brought back within the limits: with V the
///    largest state within them and nowhere above y, and W the smallest nowhere below, found as U and L are, to
///    (V + W) / 2 rounded towards 0. It is within the limits, and at the goals, exactly; a y within them stays.
///
/// Every number is a function of the numbers of the step before: any order, any number of threads and any backend give
/// the same bits; a mirrored lattice gives the mirrored ones. With rule.steps = 0 there is only the chain, and
/// `reached` is false. Nodes without links to a placed one stay. Displacements go to 4096 mm along each axis. Forces
/// are refused.
///
/// The model must outlive the simulation. @throws InputError for a lattice whose axes are not at right angles, or
/// limits without 0
std::unique_ptr<Simulation> make_cpu_chainmail(const Model& model, Limits limits = {});

/// The same on a CUDA device: the same bits. @throws DeviceError without a device, NotCompiled in a build without CUDA
std::unique_ptr<Simulation> make_cuda_chainmail(const Model& model, int device = 0);

/// A link along an axis whose ends are further apart, nearer or more sheared than its limits allow.
struct BrokenLink {
  std::uint32_t node = 0;  ///< lower end
  int axis = 0;
  double beyond_mm = 0;  ///< by how much, in the component where that is most

  friend bool operator==(const BrokenLink&, const BrokenLink&) = default;
};

/// Walks all links along axes. @param displacement  LPS mm, one a node, host memory @return those beyond their limits
/// by more than `tolerance_mm`, by rising axis, then node
std::vector<BrokenLink> links_beyond_limits(const Model& model, std::span<const glm::vec3> displacement,
                                            double tolerance_mm);

}  // namespace tetwarp::simulate
