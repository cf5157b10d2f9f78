#pragma once

#include <cstdint>
#include <vector>

#include "bench/inverse.h"

namespace tetwarp::bench {

/// One tetrahedron's determinant in the four ways.
struct Determinants {
  double double_4x4 = 0, double_3x3 = 0;
  float float_4x4 = 0, float_3x3 = 0;
};

/// @param corners  exact in float
Determinants determinants(const Corners<float>& corners);

/// Relative errors of the float forms against 3 x 3 in double, over random tetrahedra of about one cell.
struct DeterminantErrors {
  double distance = 0;  ///< their coordinates lie within a tenth below it, on all three axes
  std::int64_t tetrahedra = 0;
  double largest_4x4 = 0, median_4x4 = 0, largest_3x3 = 0, median_3x3 = 0;
};

/// What the paper's Appendix A is about: the determinant of Eq. 6 in float far from the origin, and of Eq. 13.
///
/// The corners of the paper's example (its Eq. 8) are not known to us; those here are ours.
struct Appendix {
  Corners<float> corners{};
  Determinants example;
  std::vector<DeterminantErrors> errors;
};

/// The same numbers on every call.
Appendix measure_appendix(std::int64_t tetrahedra = 100000);

}  // namespace tetwarp::bench
