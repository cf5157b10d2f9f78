// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/contours/contour_stack.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <string>

#include "deform/errors.h"

namespace tetwarp {

namespace {

// Times the usual distance: planes further apart have nothing between them.
constexpr double kUsual = 1.5;
constexpr double kNudge = 0.01;  // part of the distance

bool is_area(const Contour& contour) { return is_closed(contour.kind) && contour.points.size() >= 3; }

/// A vector along the normal whose length is twice the area of a polygon (Newell).
glm::dvec3 area_vector(std::span<const glm::dvec3> points) {
  glm::dvec3 sum(0);
  for (std::size_t n = 0; n < points.size(); ++n)
    sum += glm::cross(points[n] - points[0], points[(n + 1) % points.size()] - points[0]);
  return sum;
}

bool lies_in_plane(const Contour& contour, const glm::dvec3& normal) {
  const auto along = [&](const glm::dvec3& point) { return glm::dot(normal, point - contour.points.front()); };
  const auto [low, high] =
      std::minmax_element(contour.points.begin(), contour.points.end(),
                          [&](const glm::dvec3& a, const glm::dvec3& b) { return along(a) < along(b); });
  return along(*high) - along(*low) <= 2 * kInPlane;
}

bool all_lie_in_planes(std::span<const Contour> contours, const glm::dvec3& normal) {
  return std::all_of(contours.begin(), contours.end(),
                     [&](const Contour& contour) { return !is_area(contour) || lies_in_plane(contour, normal); });
}

glm::dvec3 normal_of(const Geometry& slices) {
  return glm::normalize(glm::cross(slices.direction[0], slices.direction[1]));
}

/// Where the slices lie along the third axis of a frame; none if they are not perpendicular to it.
std::vector<double> slice_places(const Geometry& slices, const glm::dmat3& frame_from_point) {
  const double first = (frame_from_point * slices.origin).z, step = (frame_from_point * slices.direction[2]).z;
  std::vector<double> places;
  if (std::abs((frame_from_point * normal_of(slices)).z) < 1 - 1e-6) return places;
  for (std::int64_t k = 0; k < slices.size.z; ++k) {
    const double along =
        slices.slices.empty() ? slices.spacing.z * static_cast<double>(k) : slices.slices[static_cast<std::size_t>(k)];
    places.push_back(first + step * along);
  }
  return places;
}

bool is_any_between(const std::vector<double>& places, double below, double above) {
  return std::any_of(places.begin(), places.end(),
                     [&](double at) { return at > below + 2 * kInPlane && at < above - 2 * kInPlane; });
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

ContourStack::ContourStack(std::span<const Contour> contours, const Geometry& slices) {
  choose_frame(contours, normal_of(slices));
  add_planes(contours);
  if (!planes_.empty()) add_parts(slices);
}

void ContourStack::choose_frame(std::span<const Contour> contours, const glm::dvec3& normal) {
  glm::dvec3 along = normal;
  if (!all_lie_in_planes(contours, along)) {
    glm::dvec3 largest(0);
    for (const Contour& contour : contours) {
      const glm::dvec3 area = is_area(contour) ? area_vector(contour.points) : glm::dvec3(0);
      if (glm::length(area) > glm::length(largest)) largest = area;
    }
    along = glm::length(largest) > 0 ? glm::normalize(largest) : normal;
    require(all_lie_in_planes(contours, along), "its closed contours do not lie in parallel planes");
  }
  const glm::dvec3 aside = std::abs(along.x) < 0.7 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
  const glm::dvec3 u = glm::normalize(glm::cross(glm::cross(along, aside), along)), v = glm::cross(along, u);
  frame_from_point_ = glm::transpose(glm::dmat3(u, v, along));
}

void ContourStack::add_planes(std::span<const Contour> contours) {
  struct Placed {
    double at;
    Ring ring;
  };
  std::vector<Placed> placed;
  for (const Contour& contour : contours) {
    if (!is_area(contour)) continue;
    Placed& one = placed.emplace_back();
    double sum = 0;
    for (const glm::dvec3& point : contour.points) {
      const glm::dvec3 at = frame_from_point_ * point;
      one.ring.emplace_back(at);
      sum += at.z;
    }
    one.at = sum / static_cast<double>(contour.points.size());
  }
  std::stable_sort(placed.begin(), placed.end(), [](const Placed& a, const Placed& b) { return a.at < b.at; });
  for (auto one = placed.begin(); one != placed.end();) {
    std::vector<Ring> rings;
    const double at = one->at;
    for (; one != placed.end() && one->at - at <= 2 * kInPlane; ++one) rings.push_back(std::move(one->ring));
    planes_.push_back({at, PolygonInterior(rings), nested_area(rings)});
  }
}

void ContourStack::add_parts(const Geometry& slices) {
  const std::vector<double> places = slice_places(slices, frame_from_point_);
  std::vector<double> gaps;
  for (std::size_t n = 1; n < planes_.size(); ++n) gaps.push_back(planes_[n].at - planes_[n - 1].at);
  distance_ = gaps.empty() ? slices.spacing.z : median(gaps);
  const double below = (0.5 + kNudge) * distance_, above = (0.5 - kNudge) * distance_;
  for (std::size_t n = 0; n < planes_.size(); ++n) {
    const double at = planes_[n].at;
    if (n == 0 ||
        (gaps[n - 1] > kUsual * distance_ && (places.empty() || is_any_between(places, planes_[n - 1].at, at))))
      parts_.push_back({n, n, at - below, at + above});
    parts_.back().last = n;
    parts_.back().end = at + above;
  }
}

ContourStack::Neighbours ContourStack::neighbours(const Part& part, double z) const {
  const auto first = planes_.begin() + static_cast<std::ptrdiff_t>(part.first),
             last = planes_.begin() + static_cast<std::ptrdiff_t>(part.last);
  const auto above = std::upper_bound(first, last, z, [](double at, const Plane& plane) { return at < plane.at; });
  if (above == first || z >= above->at) return {&above->interior, &above->interior, 0};
  const auto below = above - 1;
  return {&below->interior, &above->interior, (z - below->at) / (above->at - below->at)};
}

double ContourStack::signed_distance(const glm::dvec3& point, Between between) const {
  const glm::dvec3 at = frame_from_point_ * point;
  double largest = -INFINITY;
  for (const Part& part : parts_) {
    const double cap = std::min(at.z - part.begin, part.end - at.z);
    if (cap <= largest) continue;
    const auto [below, above, t] = neighbours(part, at.z);
    const double weight = between == Between::interpolated ? t : std::floor(t + 0.5);
    double depth = weight < 1 ? (1 - weight) * below->signed_distance(glm::dvec2(at)) : 0;
    if (weight > 0) depth += weight * above->signed_distance(glm::dvec2(at));
    largest = std::max(largest, std::min(cap, depth));
  }
  return largest;
}

ContourStack::Inside ContourStack::is_inside(const glm::dvec3& point) const {
  const glm::dvec3 at = frame_from_point_ * point;
  for (const Part& part : parts_) {
    if (at.z < part.begin || at.z > part.end) continue;
    const auto [below, above, t] = neighbours(part, at.z);
    const bool in_below = below->contains(glm::dvec2(at)),
               in_above = t > 0 ? above->contains(glm::dvec2(at)) : in_below;
    const bool same = in_below == in_above;
    return {same ? in_below : signed_distance(point, Between::interpolated) >= 0, t < 0.5 ? in_below : in_above};
  }
  return {};
}

double ContourStack::volume() const {
  double sum = 0;
  for (const Part& part : parts_) {
    for (std::size_t n = part.first; n <= part.last; ++n) {
      const double below = n == part.first ? distance_ : planes_[n].at - planes_[n - 1].at;
      const double above = n == part.last ? distance_ : planes_[n + 1].at - planes_[n].at;
      sum += planes_[n].area * (below + above) / 2;
    }
  }
  return sum;
}

}  // namespace tetwarp
