// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/harness/known_fields.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <numbers>

#include "bench/gpu/gpu_fields.h"
#include "deform/fields/formula.h"

namespace tetwarp::bench {

namespace {

constexpr double kResidual = 1e-10;  ///< voxels
constexpr int kMostSteps = 300;

SmoothField make_bubble(const Formula& formula) {
  const Bubble bubble{.radius = static_cast<double>(formula.radius),
                      .strength = static_cast<double>(formula.strength),
                      .centre = glm::dvec3(formula.centre)};
  const auto derivative = [=](const glm::dvec3& rest) {
    const glm::dvec3 d = rest - bubble.centre;
    const double r = glm::length(d), inwards = 1 - r / bubble.radius;
    if (inwards <= 0) return glm::dmat3(0);
    const double scale = bubble.strength * inwards * inwards;
    const double slope = r == 0 ? 0 : -2 * bubble.strength * inwards / (bubble.radius * r);
    return glm::dmat3(scale) + slope * glm::outerProduct(d, d);
  };
  return {bubble, derivative};
}

SmoothField make_elastic_field(const TestField& field) {
  const auto phase = [](const Sine& sine, const glm::dvec3& rest) {
    return glm::dot(glm::dvec3(sine.wave), rest) + static_cast<double>(sine.phase);
  };
  const auto displacement = [=](const glm::dvec3& rest) {
    glm::dvec3 sum(0);
    for (int component = 0; component < 3; ++component) {
      for (const Sine& sine : field.sines[component])
        sum[component] += static_cast<double>(sine.amplitude) * std::sin(phase(sine, rest));
    }
    return sum;
  };
  const auto derivative = [=](const glm::dvec3& rest) {
    glm::dmat3 sum(0);
    for (int component = 0; component < 3; ++component) {
      for (const Sine& sine : field.sines[component]) {
        const double slope = static_cast<double>(sine.amplitude) * std::cos(phase(sine, rest));
        for (int axis = 0; axis < 3; ++axis) sum[axis][component] += slope * static_cast<double>(sine.wave[axis]);
      }
    }
    return sum;
  };
  return {displacement, derivative};
}

/// What goes to `point`. From the point itself the map x -> point - displacement(x) comes nearer with every step, for
/// these fields change by less than a voxel a voxel; near the end Newton's steps are shorter.
glm::dvec3 undeformed(const SmoothField& field, const glm::dvec3& point, const glm::dvec3& guess, bool is_near) {
  glm::dvec3 rest = guess;
  for (int step = 0; step < kMostSteps; ++step) {
    const glm::dvec3 missed = rest + field.displacement(rest) - point;
    const double distance = glm::length(missed);
    if (distance < kResidual) return rest;
    is_near = is_near || distance < 1e-3;
    rest -= is_near ? glm::inverse(glm::dmat3(1) + field.derivative(rest)) * missed : missed;
  }
  throw Error("no undeformed point is found, voxel (" + std::to_string(point.x) + ", " + std::to_string(point.y) +
              ", " + std::to_string(point.z) + ") of a test field; does it fold?");
}

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

SmoothField make_smooth_field(const std::string& name, const glm::i64vec3& size) {
  require(name == "bubble" || name == "elastic", "no field \"" + name + "\"; choose from bubble, elastic");
  const TestField field = make_test_field(name, size);
  return name == "bubble" ? make_bubble(field.formula) : make_elastic_field(field);
}

double determinant(const SmoothField& field, const glm::dvec3& rest) {
  return glm::determinant(glm::dmat3(1) + field.derivative(rest));
}

PullField invert_closely(const SmoothField& field, const Geometry& grid, int threads) {
  PullField inverse{grid, std::vector<glm::vec3>(static_cast<std::size_t>(voxel_count(grid)))};
  const AffineMap point_of = point_from_index(grid);
  tbb::task_arena arena(threads);
  arena.execute([&] {
    tbb::parallel_for(std::int64_t{0}, grid.size.y * grid.size.z, [&](std::int64_t row) {
      glm::vec3* out = inverse.displacement.data() + row * grid.size.x;
      glm::dvec3 back(0);
      for (std::int64_t i = 0; i < grid.size.x; ++i) {
        const glm::dvec3 point = point_of(glm::dvec3(i, row % grid.size.y, row / grid.size.y));
        back = undeformed(field, point, point + back, i > 0) - point;
        out[i] = glm::vec3(back);
      }
    });
  });
  return inverse;
}

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
