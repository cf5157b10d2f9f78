// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/simulate/cuts/cut_surface.h"

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "deform/errors.h"

namespace tetwarp::simulate {

namespace {

bool is_finite(const glm::dvec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

glm::dvec3 unit(const Cut& cut, const glm::dvec3& v, const char* what) {
  const double length = glm::length(v);
  require(std::isfinite(length) && length > 0,
          "the cut \"" + cut.name + "\" has a " + what + " of length " + std::to_string(length));
  return v / length;
}

}  // namespace

CutSurface::CutSurface(const Cut& cut) : shape_(cut.shape) {
  const auto check_point = [&](const glm::dvec3& point) {
    require(is_finite(point), "the cut \"" + cut.name + "\" has a place that is not finite");
  };
  if (const auto* plane = std::get_if<PlaneCut>(&shape_)) {
    check_point(plane->point);
    up_ = unit(cut, plane->normal, "normal");
  } else if (const auto* disc = std::get_if<DiscCut>(&shape_)) {
    check_point(disc->centre);
    up_ = unit(cut, disc->normal, "normal");
    require(std::isfinite(disc->radius_mm) && disc->radius_mm > 0,
            "the cut \"" + cut.name + "\" has a radius of " + std::to_string(disc->radius_mm) + " mm");
  } else {
    const auto& swept = std::get<SweptCut>(shape_);
    up_ = unit(cut, swept.sweep, "sweep");
    std::vector<glm::dvec3> path = swept.path;
    require(path.size() >= 2,
            "the cut \"" + cut.name + "\" has a path of " + std::to_string(path.size()) + " points; two are needed");
    if (swept.is_closed) path.push_back(path.front());
    for (const glm::dvec3& point : path) {
      check_point(point);
      heights_.push_back(glm::dot(point, up_));
      flat_.push_back(point - heights_.back() * up_);
    }
    for (std::size_t n = 0; n + 1 < flat_.size(); ++n) {
      across_.push_back(unit(cut, glm::cross(up_, flat_[n + 1] - flat_[n]), "piece of its path across the sweep"));
    }
  }
}

double CutSurface::side(const glm::dvec3& point) const {
  if (const auto* plane = std::get_if<PlaneCut>(&shape_)) return glm::dot(point - plane->point, up_);
  if (const auto* disc = std::get_if<DiscCut>(&shape_)) return glm::dot(point - disc->centre, up_);
  return nearest_on_path(point).side;
}

bool CutSurface::reaches(const glm::dvec3& point) const {
  if (std::holds_alternative<PlaneCut>(shape_)) return true;
  if (const auto* disc = std::get_if<DiscCut>(&shape_)) {
    const glm::dvec3 from = point - disc->centre;
    return glm::length(from - glm::dot(from, up_) * up_) <= disc->radius_mm;
  }
  const Nearest nearest = nearest_on_path(point);
  const double depth = glm::dot(point, up_) - nearest.height;
  return nearest.is_on_it && depth >= 0 && depth <= glm::length(std::get<SweptCut>(shape_).sweep);
}

CutSurface::Nearest CutSurface::nearest_on_path(const glm::dvec3& point) const {
  const bool is_closed = std::get<SweptCut>(shape_).is_closed;
  const glm::dvec3 at = point - glm::dot(point, up_) * up_;
  const std::size_t pieces = across_.size();
  double least = std::numeric_limits<double>::infinity();
  Nearest result{};
  for (std::size_t n = 0; n < pieces; ++n) {
    const glm::dvec3 along = flat_[n + 1] - flat_[n], from = at - flat_[n];
    const double part = glm::dot(from, along) / glm::dot(along, along);
    const bool before = part<0, after = part> 1;
    const double clamped = before ? 0 : after ? 1 : part;
    const glm::dvec3 offset = from - clamped * along;
    const double distance = glm::dot(offset, offset);
    if (distance >= least) continue;
    least = distance;
    // At a bend of the path the mean normal of both pieces tells the side; beyond an end, the last piece is continued.
    glm::dvec3 normal = across_[n];
    const bool at_start = before && (n > 0 || is_closed), at_end = after && (n + 1 < pieces || is_closed);
    if (at_start) normal += across_[n > 0 ? n - 1 : pieces - 1];
    if (at_end) normal += across_[n + 1 < pieces ? n + 1 : 0];
    const double across = glm::dot(from, across_[n]);
    const bool is_past = (before && !at_start) || (after && !at_end);
    result.side =
        is_past || (!before && !after) ? across : std::copysign(std::sqrt(distance), glm::dot(offset, normal));
    result.is_on_it = !is_past;
    result.height = heights_[n] + clamped * (heights_[n + 1] - heights_[n]);
  }
  return result;
}

}  // namespace tetwarp::simulate
