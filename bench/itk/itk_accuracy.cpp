// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/itk/itk_accuracy.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <optional>
#include <vector>

namespace tetwarp::bench {

namespace {

/// What one slice holds.
struct Sums {
  double errors = 0, squares = 0, largest = 0;
  std::uint64_t compared = 0, missing = 0;

  void add(double error) {
    if (!std::isfinite(error)) {
      ++missing;
      return;
    }
    errors += error;
    squares += error * error;
    largest = std::max(largest, error);
    ++compared;
  }
};

/// @param error_at  called with a sample's index and its number; none: it does not count
template <class ErrorAt>
Deviation compare(std::size_t found, const Geometry& grid, const ErrorAt& error_at) {
  require(found == static_cast<std::size_t>(voxel_count(grid)),
          std::to_string(found) + " values for a grid of " + to_string(grid.size));
  std::vector<Sums> slices(static_cast<std::size_t>(grid.size.z));
  tbb::parallel_for(std::int64_t{0}, grid.size.z, [&](std::int64_t k) {
    Sums& slice = slices[static_cast<std::size_t>(k)];
    auto number = static_cast<std::size_t>(k * grid.size.y * grid.size.x);
    for (std::int64_t j = 0; j < grid.size.y; ++j) {
      for (std::int64_t i = 0; i < grid.size.x; ++i, ++number) {
        const std::optional<double> error = error_at(glm::dvec3(i, j, k), number);
        if (error) slice.add(*error);
      }
    }
  });
  Sums all;
  for (const Sums& slice : slices) {
    all.errors += slice.errors;
    all.squares += slice.squares;
    all.largest = std::max(all.largest, slice.largest);
    all.compared += slice.compared;
    all.missing += slice.missing;
  }
  if (all.compared == 0) return {NAN, NAN, NAN, 0, all.missing};
  const auto count = static_cast<double>(all.compared);
  return {std::sqrt(all.squares / count), all.errors / count, all.largest, all.compared, all.missing};
}

/// Whether an index lies in a grid's box, by `margin` samples or more.
bool is_inside(const glm::dvec3& index, const Geometry& grid, double margin) {
  const glm::dvec3 last = glm::dvec3(grid.size - std::int64_t{1}) - margin;
  return index == glm::clamp(index, glm::dvec3(margin), last);
}

/// Undeformed place of a sample, as an index of the grid.
glm::dvec3 place_of(const glm::dvec3& index, std::size_t number, const TrueInverse& truth) {
  return index + glm::dvec3(truth.displacement[number]) / truth.grid->spacing;
}

/// Linear between the eight samples around an index that lies in the grid.
double sample(std::span<const std::int16_t> source, const glm::i64vec3& size, const glm::dvec3& index) {
  const glm::i64vec3 low = glm::min(glm::i64vec3(glm::floor(index)), size - std::int64_t{2});
  const glm::dvec3 high = index - glm::dvec3(low);
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const glm::i64vec3 step(corner & 1, corner >> 1 & 1, corner >> 2), at = low + step;
    double weight = 1;
    for (int axis = 0; axis < 3; ++axis) weight *= step[axis] == 1 ? high[axis] : 1 - high[axis];
    sum += weight * static_cast<double>(source[static_cast<std::size_t>((at.z * size.y + at.y) * size.x + at.x)]);
  }
  return sum;
}

}  // namespace

Deviation compare_volume(std::span<const std::int16_t> found, std::span<const std::int16_t> source,
                         const TrueInverse& truth) {
  const Geometry& grid = *truth.grid;
  require(source.size() == found.size() && truth.displacement.size() == found.size(),
          "a warped volume, its source and the inverse have different sizes");
  return compare(found.size(), grid, [&](const glm::dvec3& index, std::size_t number) -> std::optional<double> {
    const glm::dvec3 place = place_of(index, number, truth);
    if (!is_inside(place, grid, 0.5)) return {};
    return std::abs(static_cast<double>(found[number]) - sample(source, grid.size, place));
  });
}

Deviation compare_inverse_field(std::span<const glm::vec3> found, const TrueInverse& truth) {
  require(truth.displacement.size() == found.size(), "an inverse and the true one have different sizes");
  return compare(found.size(), *truth.grid, [&](const glm::dvec3& index, std::size_t number) -> std::optional<double> {
    if (!is_inside(place_of(index, number, truth), *truth.grid, 0)) return {};
    return glm::distance(glm::dvec3(found[number]), glm::dvec3(truth.displacement[number]));
  });
}

Deviation compare_determinants(std::span<const float> found, const SmoothField& field, const TrueInverse& truth) {
  require(truth.displacement.size() == found.size(), "determinants and the inverse have different sizes");
  const AffineMap point_of = point_from_index(*truth.grid);
  return compare(found.size(), *truth.grid, [&](const glm::dvec3& index, std::size_t number) -> std::optional<double> {
    const glm::dvec3 place = place_of(index, number, truth);
    if (!is_inside(place, *truth.grid, 1)) return {};
    return std::abs(static_cast<double>(found[number]) - determinant(field, point_of(place)));
  });
}

Deviation compare_rest_determinants(std::span<const float> found, const SmoothField& field, const Geometry& grid) {
  const AffineMap point_of = point_from_index(grid);
  return compare(found.size(), grid, [&](const glm::dvec3& index, std::size_t number) -> std::optional<double> {
    if (!is_inside(index, grid, 1)) return {};
    return std::abs(static_cast<double>(found[number]) - determinant(field, point_of(index)));
  });
}

Deviation compare_displacements(std::span<const glm::vec3> found, const PointMap& formula, const Geometry& grid) {
  const AffineMap point_of = point_from_index(grid);
  return compare(found.size(), grid, [&](const glm::dvec3& index, std::size_t number) -> std::optional<double> {
    return glm::distance(glm::dvec3(found[number]), formula(point_of(index)));
  });
}

}  // namespace tetwarp::bench
