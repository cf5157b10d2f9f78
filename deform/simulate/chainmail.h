// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>
#include <span>
#include <vector>

#include "deform/simulate/simulation.h"

namespace tetwarp::simulate {

/// ChainMail (S. F. Gibson, "3D ChainMail: a fast algorithm for deforming volumetric objects", 1997), in which each
/// link has limits of its own, by an algorithm whose result depends on no order.
///
/// For each link along an axis and each component c along the lattice's axes, the displacements u of its two ends must
/// keep lo_c <= u_upper - u_lower <= hi_c, where lo_c <= 0 <= hi_c. These are difference constraints, and components
/// are independent. Displacements and limits are whole numbers of 2^-16 mm, and limits are rounded towards 0, so that
/// no sum is ever rounded. Two steps are made:
///
/// 1. The chain. Let d(f, v) be the length of the shortest path from node f to node v, where a link costs hi upwards
///    and -lo downwards. Placed nodes f leave a node v the displacements from L = max_f (u_f - d(v, f)) to U = min_f
///    (u_f + d(f, v)). No cost is negative, so lowering U (and raising L) link by link until nothing changes comes to
///    an end, and gives the same numbers in every order: U is the largest state within the limits that does not exceed
///    its start (Bellman-Ford). A free node then goes to max(L, min(u, U)): only as far as it is forced to. The
///    node-wise largest and smallest of two states within the limits are within the limits, and so is this state.
///    Gibson's queue ends here for one pulled element and equal limits, and Schill's (2001) aims here for unequal ones.
///    Where placed nodes contradict each other, L exceeds U. Then the state is max(U, min(u, L)), which is within the
///    limits for placed nodes too; these are shown at their goals, so only links at them are broken
///    (`links_beyond_limits` lists them).
/// 2. Relaxation. Each node moves towards the mean of its neighbours, weighted by one over the squared length of the
///    link, plus a part of its last motion (second-order Richardson iteration, Golub and Varga 1961: about N steps
///    instead of N^2 for N nodes in a row), and is kept between L and U. Weights ignore the tissue: limits tell tissues
///    apart, and moduli that differ by a factor of a million would never converge. The outcome y is brought back within
///    the limits. Let V be the largest state within them that does not exceed y, and W the smallest that is not below
///    y, found as U and L are. Nodes go to (V + W) / 2, rounded towards 0. This is within the limits and exactly at the
///    goals, and equals y where y is within the limits.
///
/// Every number depends on numbers of the step before alone, so any number of threads and any backend give the same
/// bits, and a mirrored lattice gives the mirrored bits. With `StoppingRule::steps` = 0 there is only the chain, and
/// `Convergence::reached` is false. Nodes that no links tie to a placed node stay. Displacements reach up to 4096 mm
/// along each axis. Forces are refused.
///
/// @param model   must outlive the simulation
/// @param limits  number of threads
/// @throws InputError for a lattice whose axes are not perpendicular, or limits that do not contain 0
std::unique_ptr<Simulation> make_cpu_chainmail(const Model& model, Limits limits = {});

/// A link along an axis whose ends are further apart, nearer or more sheared than its limits allow.
struct BrokenLink {
  std::uint32_t node = 0;  ///< node at the lower end
  int axis = 0;            ///< 0, 1, 2: along i, j, k
  double beyond_mm = 0;    ///< by how much the limit is exceeded, mm, in the component where that is most

  /// Whether all numbers are equal.
  friend bool operator==(const BrokenLink&, const BrokenLink&) = default;
};

/// The links along axes that exceed their limits by more than `tolerance_mm`, ordered by axis, then node.
/// @param model         model whose links are looked at
/// @param displacement  LPS mm of each node, in host memory
/// @param tolerance_mm  mm
std::vector<BrokenLink> links_beyond_limits(const Model& model, std::span<const glm::vec3> displacement,
                                            double tolerance_mm);

}  // namespace tetwarp::simulate
