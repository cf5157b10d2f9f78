#include "bench/appendix.h"

#include <cmath>
#include <random>

#include "bench/statistics.h"

namespace tetwarp::bench {

namespace {

/// About one cell, near the far corner of a grid of 512^3 voxels: one of the random tetrahedra below, chosen for a
/// determinant near the paper's 1.216 and an error of the 4 x 4 float form near the median.
constexpr Corners<float> kExample = {{473.548096f, 497.62323f, 487.950073f},
                                     {472.541412f, 498.819244f, 488.255646f},
                                     {472.295868f, 497.894745f, 489.099915f},
                                     {472.38443f, 497.844604f, 488.044189f}};

Corners<double> in_double(const Corners<float>& t) {
  const auto wide = [](const Point<float>& p) { return Point<double>{p.x, p.y, p.z}; };
  return {wide(t.a), wide(t.b), wide(t.c), wide(t.d)};
}

/// Uniform in [low, high), from the bits of the generator alone: distributions differ between standard libraries.
float uniform(std::mt19937_64& random, double low, double high) {
  return static_cast<float>(low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53);
}

/// D anywhere, A, B, C a cell further along i, j, k, each corner moved by up to a quarter of a cell.
Corners<float> random_tetrahedron(std::mt19937_64& random, double distance) {
  const auto corner = [&](const Point<float>& d, int axis) {
    const auto along = [&](int n) { return uniform(random, -0.25, 0.25) + (n == axis ? 1.0f : 0.0f); };
    const float x = along(0), y = along(1), z = along(2);
    return Point<float>{d.x + x, d.y + y, d.z + z};
  };
  const double least = 0.9 * distance;
  const float x = uniform(random, least, distance), y = uniform(random, least, distance),
              z = uniform(random, least, distance);
  const Point<float> d{x, y, z};
  const Point<float> a = corner(d, 0), b = corner(d, 1), c = corner(d, 2);
  return {a, b, c, d};
}

DeterminantErrors measure_errors(double distance, std::int64_t tetrahedra) {
  std::mt19937_64 random(1);
  std::vector<double> of_4x4, of_3x3;
  for (std::int64_t n = 0; n < tetrahedra; ++n) {
    const Determinants found = determinants(random_tetrahedron(random, distance));
    const double exact = found.double_3x3;
    of_4x4.push_back(std::abs((static_cast<double>(found.float_4x4) - exact) / exact));
    of_3x3.push_back(std::abs((static_cast<double>(found.float_3x3) - exact) / exact));
  }
  const Summary summary_4x4 = summarize(std::move(of_4x4)), summary_3x3 = summarize(std::move(of_3x3));
  return {distance, tetrahedra, summary_4x4.max, summary_4x4.median, summary_3x3.max, summary_3x3.median};
}

}  // namespace

Determinants determinants(const Corners<float>& corners) {
  const Corners<double> wide = in_double(corners);
  return {determinant_4x4(wide), determinant_about_d(wide), determinant_4x4(corners), determinant_about_d(corners)};
}

Appendix measure_appendix(std::int64_t tetrahedra) {
  Appendix appendix{.corners = kExample, .example = determinants(kExample), .errors = {}};
  for (const double distance : {32.0, 128.0, 512.0, 1024.0}) {
    appendix.errors.push_back(measure_errors(distance, tetrahedra));
  }
  return appendix;
}

}  // namespace tetwarp::bench
