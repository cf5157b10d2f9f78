// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>
#include <span>

#include "deform/simulate/spring_roles.h"

namespace tetwarp::simulate {

/// The Laplacian of the springs between free nodes, factored: L = sum of k (e_a - e_b)(e_a - e_b)^T, with the rows and
/// columns of nodes that are not free struck out. Eigen's simplicial Cholesky, columns in approximate minimum degree
/// order.
class LaplacianFactor {
 public:
  LaplacianFactor(const Model& model, std::span<const Role> roles);
  ~LaplacianFactor();

  /// x, y and z of each node are three right-hand sides; solved in place for free nodes, others are left alone.
  void solve(std::span<glm::dvec3> values) const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace tetwarp::simulate
