// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/invert/invert_fields.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numbers>

#include "bench/gpu/gpu_fields.h"
#include "deform/fields/formula.h"

namespace tetwarp::bench {

namespace {

using Inverse = std::function<Origin(const glm::dvec3& voxel)>;

/// The displacement that leads back from where a bubble moved a point.
PointMap undo(const Bubble& bubble) {
  return [=](const glm::dvec3& point) {
    const glm::dvec3 d = point - bubble.centre;
    const double r = glm::length(d) / bubble.radius;
    if (r == 0 || r >= 1) return glm::dvec3(0);
    double low = 0, high = 1;
    for (double middle = 0.5; low < middle && middle < high; middle = 0.5 * (low + high)) {
      (middle * (1 + bubble.strength * (1 - middle) * (1 - middle)) < r ? low : high) = middle;
    }
    return (low / r - 1) * d;
  };
}

/// One place for each voxel, which must lie in the lattice.
Inverse by_formula(const PointMap& back, const Geometry& lattice) {
  const glm::dvec3 last(lattice.size - std::int64_t{1});
  return [=](const glm::dvec3& voxel) {
    const glm::dvec3 displacement = back(voxel), place = voxel + displacement, outside = glm::max(-place, place - last);
    return Origin{displacement, std::max({outside.x, outside.y, outside.z})};
  };
}

/// Rows along x stay rows, and a row comes to lie, without a gap, from its leftmost vertex to its rightmost.
Inverse by_reach(const VertexField& field) {
  double left = INFINITY, right = -INFINITY;
  for (std::int64_t i = 0; i < field.lattice.size.x; ++i) {
    const double x = static_cast<double>(i) + static_cast<double>(field.displacement[static_cast<std::size_t>(i)].x);
    left = std::min(left, x);
    right = std::max(right, x);
  }
  return [=](const glm::dvec3& voxel) { return Origin{glm::dvec3(NAN), std::max(left - voxel.x, voxel.x - right)}; };
}

double wavelength(float radians_per_voxel) { return 2 * std::numbers::pi / static_cast<double>(radians_per_voxel); }

}  // namespace

KnownField make_known_field(const std::string& name, const glm::i64vec3& size, int threads) {
  const TestField test = make_test_field(name, size);
  const Formula& formula = test.formula;
  const glm::dvec3 centre(formula.centre);
  const Geometry lattice = lattice_over({.size = size}, 1);
  const auto known = [&](const PointMap& forward, const PointMap& back) {
    return KnownField{sample_on(lattice, forward, {.threads = threads}), by_formula(back, lattice)};
  };
  if (test.kind == TestField::Kind::folds) {
    const Wave along_itself{
        .amplitude = test.amplitude, .wavelength = wavelength(test.radians_per_voxel), .along = 0, .centre = centre};
    VertexField field = sample_on(lattice, along_itself, {.threads = threads});
    Inverse reach = by_reach(field);
    return {std::move(field), std::move(reach)};
  }
  if (formula.kind == Formula::Kind::wave) {
    Wave wave{.amplitude = formula.amplitude, .wavelength = wavelength(formula.radians_per_voxel), .centre = centre};
    Wave back = wave;
    back.amplitude = -wave.amplitude;
    return known(wave, back);
  }
  if (formula.kind == Formula::Kind::twist) {
    Twist twist{.angle = formula.radians_per_voxel * centre.z, .half_length = centre.z, .centre = centre};
    Twist back = twist;
    back.angle = -twist.angle;
    return known(twist, back);
  }
  require(formula.kind == Formula::Kind::bubble,
          "the inverse of \"" + name + "\" is not known; choose from wave, twist, bubble, folds");
  const Bubble bubble{.radius = formula.radius, .strength = formula.strength, .centre = centre};
  return known(bubble, undo(bubble));
}

}  // namespace tetwarp::bench
