// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "deform/core/five_tetrahedra.h"

namespace tetwarp::cpu {

/// Displacements of a row of vertices in double, mm, the vertices of even and of odd number apart: cells whose numbers
/// leave the same rest divided by 2 have the same five tetrahedra, and their vertices then lie side by side.
class SplitRow {
 public:
  /// @param vertices  of the row, 2 or more
  explicit SplitRow(std::size_t vertices);
  /// @param row  displacements of the vertices
  void set(const glm::vec3* row);
  /// One component of vertices 2 m + rest, by m. As many numbers as a vector has may be read beyond the last.
  const double* component(std::size_t rest, std::size_t axis) const { return of_[rest][axis].data(); }

 private:
  std::size_t vertices_;
  std::array<std::array<std::vector<double>, 3>, 2> of_;
};

/// The steps of a lattice, and what turns them into gradients.
struct LatticeSteps {
  glm::dmat3 step;     ///< columns: from a vertex to the next along i, j, k, LPS mm
  glm::dmat3 inverse;  ///< of `step`
  double over_volume;  ///< 1 / determinant of `step`
  bool is_diagonal;    ///< whether all but the diagonal of `step` is 0
  explicit LatticeSteps(const glm::dmat3& step);
};

/// Most cells of a run.
constexpr std::size_t kGradientRun = 64;

/// Every other cell of a row of cells, from cell 2 first + rest on.
struct GradientRun {
  const SplitRow* rows[4];  ///< the rows of vertices at (j, k), (j + 1, k), (j, k + 1) and (j + 1, k + 1)
  std::size_t first, rest, count;
  bool odd;  ///< which five tetrahedra the cells have (`tetrahedron_corners`)
};

/// What is found of the cells of a run.
struct RunGradients {
  /// By tetrahedron and cell: Jacobian determinant of the forward map.
  alignas(64) std::array<std::array<double, kGradientRun>, kTetrahedraPerCell> determinant;
  double least, most;  ///< of all determinants
  /// By cell: whether a vertex moves, and if so whether a tetrahedron may stretch by more than the given bound.
  enum class Kind : std::uint8_t { at_rest, within, beyond };
  std::array<Kind, kGradientRun> kind;
};

/// Measures the five tetrahedra of each cell of a run. Every instruction set gives the same bits.
/// @param limit  a cell is `beyond` where an eigenvalue of transpose(f) f may exceed it, for the gradient f of one of
///               its tetrahedra, the derivative of the deformed place by the undeformed place
void measure_gradients(const LatticeSteps& steps, const GradientRun& run, double limit, RunGradients& found);

}  // namespace tetwarp::cpu
