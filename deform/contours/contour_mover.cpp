// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/contours/contour_mover.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "deform/contours/edge_distance.h"

namespace tetwarp {

namespace {

constexpr double kFollow = 0.1;            // voxels by which a moved edge may miss its straight line
constexpr std::size_t kMostSamples = 256;  // samples of an edge

glm::dvec3 normal_of(const Geometry& grid) { return glm::normalize(glm::cross(grid.direction[0], grid.direction[1])); }

double pixel_mm(const Geometry& grid) { return std::min(grid.spacing.x, grid.spacing.y); }

/// Distance of the planes of neighbouring slices along their normal, mm.
double slice_step(const Geometry& grid) { return grid.spacing.z * glm::dot(normal_of(grid), grid.direction[2]); }

/// Adds to `points`, in order, those samples of a moved edge that the straight line between its ends misses.
void add_missed(std::span<const glm::dvec3> samples, double tolerance, std::vector<glm::dvec3>& points) {
  if (samples.size() < 3) return;
  std::size_t farthest = 0;
  double distance = tolerance;
  for (std::size_t n = 1; n + 1 < samples.size(); ++n) {
    const double missed = distance_to_edge(samples[n], samples.front(), samples.back());
    if (missed <= distance) continue;
    distance = missed;
    farthest = n;
  }
  if (farthest == 0) return;
  add_missed(samples.first(farthest + 1), tolerance, points);
  points.push_back(samples[farthest]);
  add_missed(samples.subspan(farthest), tolerance, points);
}

/// How far a plane is from the nearest one of a family of parallel planes, of which one is at 0 and which are `step`
/// apart.
double to_nearest(double at, double step) { return std::abs(at - step * std::round(at / step)); }

}  // namespace

std::optional<std::int64_t> slice_of(std::span<const glm::dvec3> points, const Geometry& grid) {
  const glm::dvec3 normal = normal_of(grid);
  const double step = slice_step(grid);
  if (points.empty()) return {};
  const double slice = std::round(glm::dot(normal, points.front() - grid.origin) / step);
  if (!(slice >= 0 && slice < static_cast<double>(grid.size.z))) return {};
  const bool all = std::all_of(points.begin(), points.end(), [&](const glm::dvec3& point) {
    return std::abs(glm::dot(normal, point - grid.origin) - slice * step) <= kOnSlice;
  });
  return all ? std::optional(static_cast<std::int64_t>(slice)) : std::nullopt;
}

MovedContour ContourMover::move(const Contour& contour) const {
  const glm::dvec3 normal = normal_of(output_);
  MovedContour result{{contour.kind, {}, {}}, INFINITY, -INFINITY};
  const auto moved = [&](const glm::dvec3& point) {
    glm::dvec3 at = point;
    if (mover_.move(at) == PointStatus::outside) ++result.outside;
    const double along = glm::dot(normal, at - point);
    result.rests = result.rests && at == point;
    result.lowest = std::min(result.lowest, along);
    result.highest = std::max(result.highest, along);
    return at;
  };
  const std::vector<glm::dvec3>& points = contour.points;
  const std::size_t edges = points.size() - (is_closed(contour.kind) || points.empty() ? 0 : 1);
  std::vector<glm::dvec3> samples;
  for (std::size_t n = 0; n < points.size(); ++n) {
    const glm::dvec3 &a = points[n], &b = points[(n + 1) % points.size()];
    const double steps = n < edges ? std::ceil(glm::distance(a, b) / pixel_mm(output_)) : 0;
    const auto count = static_cast<std::size_t>(std::min(steps, static_cast<double>(kMostSamples)));
    samples.assign(1, moved(a));
    for (std::size_t s = 1; s < count; ++s)
      samples.push_back(moved(a + (b - a) * (static_cast<double>(s) / static_cast<double>(count))));
    result.contour.points.push_back(samples.front());
    if (samples.size() == 1) continue;
    glm::dvec3 end = b;
    mover_.move(end);
    samples.push_back(end);
    add_missed(samples, kFollow * pixel_mm(output_), result.contour.points);
  }
  result.contour.slice = slice_of(result.contour.points, output_);
  if (contour.kind == ContourKind::open && result.highest - result.lowest > kOnSlice)
    result.contour.kind = ContourKind::open_nonplanar;
  return result;
}

std::optional<std::vector<MovedContour>> ContourMover::move_within_slices(std::span<const Contour> contours,
                                                                          const Geometry& source,
                                                                          Outside outside) const {
  const glm::dvec3 normal = normal_of(output_);
  if (!source.slices.empty()) return {};
  std::vector<MovedContour> result;
  double lowest = INFINITY, highest = -INFINITY;
  bool known = true, rests = true;
  for (const Contour& contour : contours) {
    if (!is_closed(contour.kind)) continue;
    const MovedContour& moved = result.emplace_back(move(contour));
    lowest = std::min(lowest, moved.lowest);
    highest = std::max(highest, moved.highest);
    known = known && (moved.outside == 0 || outside == Outside::rest);
    rests = rests && moved.rests;
    if (highest - lowest > kOnSlice || (!known && !rests)) return {};
    for (const glm::dvec3& point : contour.points) {
      const double before = to_nearest(glm::dot(normal, point - source.origin), slice_step(source));
      const double after = to_nearest(glm::dot(normal, point - output_.origin) + lowest, slice_step(output_));
      if (after > before + kOnSlice) return {};
    }
  }
  return result;
}

}  // namespace tetwarp
