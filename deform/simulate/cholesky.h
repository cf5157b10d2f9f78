// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>
#include <span>

#include "deform/simulate/spring_roles.h"

namespace tetwarp::simulate {

/// The factored Laplacian of the springs between free nodes: L = sum of k (e_a - e_b)(e_a - e_b)^T, without the rows
/// and columns of nodes that are not free. It is factored by Eigen's simplicial Cholesky, with columns in approximate
/// minimum degree order.
class LaplacianFactor {
 public:
  LaplacianFactor(const Model& model, std::span<const SpringRole> roles);
  ~LaplacianFactor();

  /// Solves L x = b in place, with x, y and z of each node as three right-hand sides. Values of nodes that are not free
  /// stay.
  void solve(std::span<glm::dvec3> values) const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace tetwarp::simulate
