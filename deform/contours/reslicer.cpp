// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/contours/reslicer.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>

#include "deform/contours/zero_contours.h"

namespace tetwarp {

namespace {

constexpr double kSimple = 0.01;     // voxels
constexpr double kSmallest = 1e-3;   // voxels of area, the least of a contour
constexpr double kFewVoxels = 64;    // a solid at least this wide is sampled once a voxel
constexpr std::int64_t kFinest = 4;  // samples a voxel
constexpr double kMargin = 2;        // voxels

/// The mean of two samples with weights 1 - t and t. A sample that is not known counts only if it has weight.
glm::dvec3 mixed(const glm::dvec3& a, const glm::dvec3& b, double t) { return t == 0 ? a : glm::mix(a, b, t); }

double largest_step(const Geometry& grid) { return std::max({grid.spacing.x, grid.spacing.y, grid.spacing.z}); }

}  // namespace

/// The part of a slice that may show the solid: voxels from `begin` to `end`, inclusive.
struct Reslicer::SliceExtent {
  glm::i64vec2 begin{std::numeric_limits<std::int64_t>::max()}, end{std::numeric_limits<std::int64_t>::min()};

  bool is_empty() const { return begin.x > end.x; }
};

Reslicer::Reslicer(std::span<const Contour> contours, const Geometry& source, const Geometry& output)
    : solid_(contours, source),
      output_(output),
      point_from_output_(point_from_index(output)),
      low_(INFINITY),
      high_(-INFINITY) {
  const AffineMap index = index_from_point(output);
  glm::dvec3 first(INFINITY), last(-INFINITY);  // in voxels, as if nothing moved
  for (const Contour& contour : contours) {
    if (!is_closed(contour.kind)) continue;
    for (const glm::dvec3& point : contour.points) {
      low_ = glm::min(low_, point);
      high_ = glm::max(high_, point);
      first = glm::min(first, index(point));
      last = glm::max(last, index(point));
    }
  }
  const double margin = kMargin * std::max(largest_step(source), largest_step(output)) + solid_.distance();
  low_ -= margin;
  high_ += margin;
  const double width = std::max(1.0, std::min(last.x - first.x, last.y - first.y));
  fineness_ = std::clamp<std::int64_t>(static_cast<std::int64_t>(std::ceil(kFewVoxels / width)), 1, kFinest);
}

Reslicer::SliceExtent Reslicer::extent_of(const ConstVolumeView& inverse_mm, std::int64_t k) const {
  const Region& held = inverse_mm.buffered;
  const auto* displacement =
      reinterpret_cast<const glm::vec3*>(inverse_mm.voxels) + (k - held.begin.z) * output_.size.x * output_.size.y;
  SliceExtent extent;
  const glm::dvec3 step = point_from_output_.linear[0];
  for (std::int64_t j = 0; j < output_.size.y; ++j) {
    const glm::dvec3 row = point_from_output_(glm::dvec3(0, j, k));
    for (std::int64_t i = 0; i < output_.size.x; ++i, ++displacement) {
      const glm::dvec3 from = row + static_cast<double>(i) * step + glm::dvec3(*displacement);
      const bool inside = from.x >= low_.x && from.x <= high_.x && from.y >= low_.y && from.y <= high_.y &&
                          from.z >= low_.z && from.z <= high_.z;  // false for NaN
      if (!inside) continue;
      extent.begin = glm::min(extent.begin, glm::i64vec2(i, j));
      extent.end = glm::max(extent.end, glm::i64vec2(i, j));
    }
  }
  if (extent.is_empty()) return extent;
  extent.begin = glm::max(extent.begin - std::int64_t{1}, glm::i64vec2(0));
  extent.end = glm::min(extent.end + std::int64_t{1}, glm::i64vec2(output_.size) - std::int64_t{1});
  return extent;
}

/// The places from which samples of an extent come.
struct Reslicer::Samples {
  glm::i64vec2 size;
  std::vector<glm::dvec3> from;                 ///< LPS mm; NaN: nothing maps there
  std::vector<ContourStack::Inside> is_inside;  ///< whether the points in `from` lie in the solid
};

Reslicer::Samples Reslicer::sample(const ConstVolumeView& inverse_mm, std::int64_t k, const SliceExtent& extent) const {
  const auto* displacement = reinterpret_cast<const glm::vec3*>(inverse_mm.voxels) +
                             (k - inverse_mm.buffered.begin.z) * output_.size.x * output_.size.y;
  const auto inverse = [&](std::int64_t i, std::int64_t j) {
    return glm::dvec3(displacement[std::min(j, output_.size.y - 1) * output_.size.x + std::min(i, output_.size.x - 1)]);
  };
  const double fine = static_cast<double>(fineness_);
  Samples samples{(extent.end - extent.begin) * fineness_ + std::int64_t{1}, {}, {}};
  samples.from.reserve(static_cast<std::size_t>(samples.size.x * samples.size.y));
  for (std::int64_t n = 0; n < samples.size.y; ++n) {
    for (std::int64_t m = 0; m < samples.size.x; ++m) {
      const std::int64_t i = extent.begin.x + m / fineness_, j = extent.begin.y + n / fineness_;
      const double s = static_cast<double>(m % fineness_) / fine, t = static_cast<double>(n % fineness_) / fine;
      const glm::dvec3 below = mixed(inverse(i, j), inverse(i + 1, j), s),
                       above = mixed(inverse(i, j + 1), inverse(i + 1, j + 1), s);
      const glm::dvec3 at(static_cast<double>(i) + s, static_cast<double>(j) + t, k);
      samples.from.push_back(point_from_output_(at) + mixed(below, above, t));
      samples.is_inside.push_back(solid_.is_inside(samples.from.back()));
    }
  }
  return samples;
}

/// Signed distances of the samples from the border of the solid, mm. They are computed only for samples with a
/// neighbour on the other side; for all others only the sign is right.
std::vector<double> Reslicer::depths(const Samples& samples, Between between) const {
  constexpr double kSomewhere = 1;  // mm: the size that stands for an unknown distance
  std::vector<double> depth;
  depth.reserve(samples.from.size());
  const auto inside = [&](std::int64_t i, std::int64_t j) {
    const ContourStack::Inside& kinds = samples.is_inside[static_cast<std::size_t>(j * samples.size.x + i)];
    return between == Between::interpolated ? kinds.interpolated : kinds.nearest;
  };
  const auto at_border = [&](std::int64_t i, std::int64_t j) {
    for (std::int64_t n = std::max<std::int64_t>(j - 1, 0); n <= std::min(j + 1, samples.size.y - 1); ++n)
      for (std::int64_t m = std::max<std::int64_t>(i - 1, 0); m <= std::min(i + 1, samples.size.x - 1); ++m)
        if (inside(m, n) != inside(i, j)) return true;
    return false;
  };
  for (std::int64_t j = 0; j < samples.size.y; ++j) {
    for (std::int64_t i = 0; i < samples.size.x; ++i) {
      const glm::dvec3& from = samples.from[depth.size()];
      if (std::isnan(from.x)) {
        depth.push_back(std::numeric_limits<double>::quiet_NaN());
      } else if (at_border(i, j)) {
        depth.push_back(solid_.signed_distance(from, between));
      } else {
        depth.push_back(inside(i, j) ? kSomewhere : -kSomewhere);
      }
    }
  }
  return depth;
}

SlicedContours Reslicer::draw(const Samples& samples, const SliceExtent& extent, std::int64_t k,
                              Between between) const {
  SlicedContours result;
  const double fine = static_cast<double>(fineness_);
  ZeroContours zero = zero_contours(depths(samples, between), samples.size.x, samples.size.y);
  result.cut = zero.cut;
  std::vector<Ring> rings;
  for (Ring& ring : zero.rings) {
    for (glm::dvec2& corner : ring) corner = glm::dvec2(extent.begin) + corner / fine;
    ring = simplified(ring, kSimple);
    const double area = signed_area(ring);
    if (ring.size() < 3 || std::abs(area) < kSmallest) continue;
    result.area += area * output_.spacing.x * output_.spacing.y;
    rings.push_back(std::move(ring));
  }
  for (const Ring& ring : joined_by_keyholes(std::move(rings))) {
    Contour& contour = result.contours.emplace_back();
    contour.slice = k;
    for (const glm::dvec2& corner : ring) contour.points.push_back(point_from_output_(glm::dvec3(corner, k)));
  }
  return result;
}

std::array<SlicedContours, 2> Reslicer::slice(const ConstVolumeView& inverse_mm, std::int64_t k) const {
  const SliceExtent extent = extent_of(inverse_mm, k);
  if (extent.is_empty()) return {};
  const Samples samples = sample(inverse_mm, k, extent);
  return {draw(samples, extent, k, Between::interpolated), draw(samples, extent, k, Between::nearest)};
}

}  // namespace tetwarp
