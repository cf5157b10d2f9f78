// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <Eigen/Dense>
#include <Eigen/Eigenvalues>
#include <cmath>

#include "tests/support/springs.h"

namespace tetwarp::test {

/// Net forces of displaced springs and the second derivative of their energy, computed from its definition: the sum of
/// k/2 (|x_a - x_b| - r)^2.
struct DenseSprings {
  Eigen::MatrixXd matrix;
  Eigen::VectorXd force;

  DenseSprings(const Model& model, const std::vector<glm::dvec3>& u)
      : matrix(Eigen::MatrixXd::Zero(3 * rows(model), 3 * rows(model))), force(Eigen::VectorXd::Zero(3 * rows(model))) {
    for (int d = 0; d < kDirections; ++d) {
      for (std::size_t a = 0; a < model.nodes(); ++a) {
        const std::size_t link = model.link(d, a);
        if (model.neighbour[link] < 0) continue;
        const auto b = static_cast<std::size_t>(model.neighbour[link]);
        const glm::dvec3 at_rest = rest_of(model, b) - rest_of(model, a), apart = at_rest + u[b] - u[a];
        const Eigen::Vector3d x(apart.x, apart.y, apart.z), r(at_rest.x, at_rest.y, at_rest.z);
        const double k = double{model.stiffness[link]}, length = x.norm(), part = r.norm() / length;
        const Eigen::Matrix3d block =
            k * (1 - part) * Eigen::Matrix3d::Identity() + k * part / (length * length) * x * x.transpose();
        const auto ra = static_cast<Eigen::Index>(3 * a), rb = static_cast<Eigen::Index>(3 * b);
        matrix.block<3, 3>(ra, ra) += block;
        matrix.block<3, 3>(ra, rb) -= block;
        force.segment<3>(ra) += k * (1 - part) * x;
      }
    }
  }

  /// Makes the solution leave a component of a node as it is.
  void fix(Eigen::Index row) {
    matrix.row(row).setZero();
    matrix.col(row).setZero();
    matrix(row, row) = 1;
    force(row) = 0;
  }

 private:
  static Eigen::Index rows(const Model& model) { return static_cast<Eigen::Index>(model.nodes()); }
};

/// Dense springs of which placed nodes, and components that no spring resists, stay as they are.
/// @param part  share of the loads, 0 to 1
inline DenseSprings dense_springs(const Model& model, const Loads& loads, double part,
                                  const std::vector<glm::dvec3>& u) {
  DenseSprings springs(model, u);
  for (std::size_t n = 0; n < model.nodes(); ++n) {
    for (int axis = 0; axis < 3; ++axis) {
      const auto row = static_cast<Eigen::Index>(3 * n) + axis;
      if (!loads.force.empty()) springs.force(row) += part * double{loads.force[n][axis]};
      if (loads.constraint[n] == Constraint::placed || springs.matrix(row, row) == 0) springs.fix(row);
    }
  }
  return springs;
}

/// Finds an equilibrium by Newton's method with a dense matrix. @param part  share of the loads, 0 to 1
inline void find_equilibrium(const Model& model, const Loads& loads, double part, std::vector<glm::dvec3>& u) {
  for (std::size_t n = 0; n < model.nodes(); ++n) {
    if (loads.constraint[n] == Constraint::placed)
      u[n] = part * glm::dvec3(loads.goal[n].x, loads.goal[n].y, loads.goal[n].z);
  }
  for (int step = 0; step < 60; ++step) {
    const DenseSprings springs = dense_springs(model, loads, part, u);
    const Eigen::VectorXd motion = springs.matrix.fullPivLu().solve(springs.force);
    for (std::size_t n = 0; n < model.nodes(); ++n) {
      const auto row = static_cast<Eigen::Index>(3 * n);
      u[n] += glm::dvec3(motion(row), motion(row + 1), motion(row + 2));
    }
    if (motion.norm() < 1e-11) return;
  }
  ADD_FAILURE() << "the dense solve did not converge";
}

/// Displacements in equilibrium, reached from rest in small steps of the loads.
inline std::vector<glm::dvec3> dense_equilibrium(const Model& model, const Loads& loads) {
  std::vector<glm::dvec3> u(model.nodes(), glm::dvec3(0));
  for (const double part : {0.25, 0.5, 0.75, 1.0}) find_equilibrium(model, loads, part, u);
  return u;
}

}  // namespace tetwarp::test
