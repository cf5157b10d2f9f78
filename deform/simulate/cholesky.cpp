// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/simulate/cholesky.h"

#include <Eigen/SparseCholesky>
#include <vector>

#include "deform/errors.h"

namespace tetwarp::simulate {

struct LaplacianFactor::Parts {
  std::vector<std::int32_t> row;  ///< by node: its row; -1: it is not free
  Eigen::Index rows = 0;
  Eigen::SimplicialLLT<Eigen::SparseMatrix<double>> factor;
};

LaplacianFactor::LaplacianFactor(const Model& model, std::span<const SpringRole> roles)
    : parts_(std::make_unique<Parts>()) {
  parts_->row.assign(model.nodes(), -1);
  for (std::size_t n = 0; n < model.nodes(); ++n) {
    if (roles[n] == SpringRole::free) parts_->row[n] = static_cast<std::int32_t>(parts_->rows++);
  }
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t n = 0; n < model.nodes(); ++n) {
    const std::int32_t row = parts_->row[n];
    if (row < 0) continue;
    double sum = 0;
    for (int d = 0; d < kDirections; ++d) {
      const std::size_t link = model.link(d, n);
      if (model.neighbour[link] < 0) continue;
      const double k = model.stiffness[link];
      sum += k;
      const std::int32_t column = parts_->row[static_cast<std::size_t>(model.neighbour[link])];
      if (column >= 0 && column < row) entries.emplace_back(row, column, -k);  // the lower triangle is what is read
    }
    entries.emplace_back(row, row, sum);
  }
  if (parts_->rows == 0) return;
  Eigen::SparseMatrix<double> laplacian(parts_->rows, parts_->rows);
  laplacian.setFromTriplets(entries.begin(), entries.end());
  parts_->factor.compute(laplacian);
  require(parts_->factor.info() == Eigen::Success,
          "the spring constants of " + std::to_string(parts_->rows) +
              " free nodes differ too much for a Cholesky factor; use conjugate gradients");
}

LaplacianFactor::~LaplacianFactor() = default;

void LaplacianFactor::solve(std::span<glm::dvec3> values) const {
  if (parts_->rows == 0) return;
  Eigen::Matrix<double, Eigen::Dynamic, 3> sides(parts_->rows, 3);
  for (std::size_t n = 0; n < values.size(); ++n) {
    if (parts_->row[n] < 0) continue;
    for (int axis = 0; axis < 3; ++axis) sides(parts_->row[n], axis) = values[n][axis];
  }
  sides = parts_->factor.solve(sides).eval();
  for (std::size_t n = 0; n < values.size(); ++n) {
    if (parts_->row[n] < 0) continue;
    for (int axis = 0; axis < 3; ++axis) values[n][axis] = sides(parts_->row[n], axis);
  }
}

}  // namespace tetwarp::simulate
