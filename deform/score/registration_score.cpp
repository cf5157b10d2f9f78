// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/score/registration_score.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <limits>

#include "deform/core/trilinear.h"
#include "deform/cpu/tiles.h"
#include "deform/errors.h"
#include "deform/score/error_sums.h"
#include "deform/score/label_map.h"

namespace tetwarp::score {

namespace {

constexpr std::int64_t kSlab = 8;  // slices of the truth that are held at a time
constexpr double kNothing = std::numeric_limits<double>::infinity();

/// What is found in one slice.
struct SliceSums {
  ErrorSums all, apart;
  std::vector<std::map<std::int64_t, ErrorSums>> parts;
  std::array<double, kReadings> readings{};
  std::uint64_t determinants = 0, folded = 0;
  double smallest = kNothing, largest = -kNothing, determinant_error = 0;

  void add(const SliceSums& later) {
    all.add(later.all);
    apart.add(later.apart);
    parts.resize(later.parts.size());
    for (std::size_t n = 0; n < parts.size(); ++n)
      for (const auto& [label, sums] : later.parts[n]) parts[n][label].add(sums);
    for (std::size_t n = 0; n < kReadings; ++n) readings[n] += later.readings[n];
    determinants += later.determinants;
    folded += later.folded;
    smallest = std::min(smallest, later.smallest);
    largest = std::max(largest, later.largest);
    determinant_error += later.determinant_error;
  }
};

/// The result as a map of points.
class ResultMap {
 public:
  explicit ResultMap(const PullField& field)
      : field_(field), size_(field.grid.size), point_(point_from_index(field.grid)) {
    across_ = glm::inverse(point_.linear);
  }

  glm::dvec3 displacement(std::int64_t voxel) const {
    return glm::dvec3(field_.displacement[static_cast<std::size_t>(voxel)]);
  }
  glm::dvec3 point(const glm::i64vec3& at) const { return point_(glm::dvec3(at)); }
  /// Other readings of a displacement.
  std::array<glm::dvec3, kReadings> readings(const glm::dvec3& by) const {
    return {by, glm::dvec3(0), -by, glm::dvec3(-by.x, -by.y, by.z), point_.linear * by};
  }
  /// Determinant of the gradient of T; NaN on faces and beside samples without a place.
  double determinant(const glm::i64vec3& at, std::int64_t voxel) const {
    glm::dmat3 gradient(0);
    std::int64_t step = 1;
    for (int axis = 0; axis < 3; ++axis) {
      if (at[axis] == 0 || at[axis] == size_[axis] - 1) return NAN;
      gradient[axis] = 0.5 * (displacement(voxel + step) - displacement(voxel - step));
      step *= size_[axis];
    }
    return glm::determinant(glm::dmat3(1) + gradient * across_);
  }

 private:
  const PullField& field_;
  glm::i64vec3 size_;
  AffineMap point_;
  glm::dmat3 across_;
};

bool is_place(const glm::dvec3& point) { return std::isfinite(point.x + point.y + point.z); }

/// A displacement between samples, trilinear. @param index  continuous index
glm::dvec3 sample(const PullField& field, const glm::dvec3& index) {
  const glm::i64vec3 size = field.grid.size;
  return trilinear(size, index, [&](const glm::i64vec3& at) {
    return field.displacement[static_cast<std::size_t>(at.x + size.x * (at.y + size.y * at.z))];
  });
}

/// Looks at the voxels of a field, slice by slice.
class FieldScorer {
 public:
  FieldScorer(const PullField& result, std::span<const Counts> counts, std::span<const ConstVolumeView> parts)
      : map_(result), size_(result.grid.size), counts_(counts), parts_(parts) {}

  /// What is found in a slice. @param first  index of the slab's first slice
  SliceSums look_at(std::int64_t k, const TruthSlab& slab, std::int64_t first) const {
    SliceSums sums;
    sums.parts.resize(parts_.size());
    const std::int64_t area = size_.x * size_.y;
    std::int64_t voxel = k * area;
    for (std::int64_t j = 0; j < size_.y; ++j) {
      for (std::int64_t i = 0; i < size_.x; ++i, ++voxel) {
        const auto at = static_cast<std::size_t>(voxel - first * area);
        if (counts_[static_cast<std::size_t>(voxel)] != Counts::no && slab.is_known[at])
          look_at({i, j, k}, voxel, glm::dvec3(slab.displacement[at]), static_cast<double>(slab.determinant[at]), sums);
      }
    }
    return sums;
  }

 private:
  void look_at(const glm::i64vec3& at, std::int64_t voxel, const glm::dvec3& wanted, double true_determinant,
               SliceSums& sums) const {
    const glm::dvec3 by = map_.displacement(voxel), where = map_.point(at);
    const double distance = is_place(by) ? glm::distance(by, wanted) : NAN;
    if (counts_[static_cast<std::size_t>(voxel)] == Counts::apart) return sums.apart.add_or_miss(distance, where);
    sums.all.add_or_miss(distance, where);
    for (std::size_t n = 0; n < parts_.size(); ++n)
      sums.parts[n][label_at(parts_[n], voxel)].add_or_miss(distance, where);
    if (std::isnan(distance)) return;
    const auto readings = map_.readings(by);
    for (std::size_t n = 0; n < kReadings; ++n) sums.readings[n] += glm::distance(readings[n], wanted);
    const double determinant = map_.determinant(at, voxel);
    if (std::isnan(determinant)) return;
    ++sums.determinants;
    sums.folded += determinant <= 0;
    sums.smallest = std::min(sums.smallest, determinant);
    sums.largest = std::max(sums.largest, determinant);
    sums.determinant_error += std::abs(determinant - true_determinant);
  }

  ResultMap map_;
  glm::i64vec3 size_;
  std::span<const Counts> counts_;
  std::span<const ConstVolumeView> parts_;
};

DenseScore score_of(const SliceSums& all) {
  DenseScore score;
  score.all = all.all.errors();
  score.apart = all.apart.errors();
  for (const auto& sums_of : all.parts) {
    std::map<std::int64_t, Errors>& errors = score.parts.emplace_back();
    for (const auto& [label, sums] : sums_of) errors[label] = sums.errors();
  }
  for (std::size_t n = 0; n < kReadings; ++n)
    score.readings[n] = all.readings[n] / static_cast<double>(std::max<std::uint64_t>(score.all.points, 1));
  score.determinants = all.determinants;
  score.folded = all.folded;
  if (all.determinants > 0) {
    score.smallest_determinant = all.smallest;
    score.largest_determinant = all.largest;
    score.mean_determinant_error = all.determinant_error / static_cast<double>(all.determinants);
  }
  return score;
}

}  // namespace

std::string to_string(Reading reading) {
  switch (reading) {
    case Reading::as_given: return "as given";
    case Reading::nothing: return "no displacement";
    case Reading::negative: return "the inverse, from moving to fixed";
    case Reading::ras: return "RAS instead of LPS";
    case Reading::voxels: return "voxels instead of mm";
  }
  return {};
}

Reading suspected_reading(const DenseScore& score) {
  const auto mean = [&](Reading reading) { return score.readings[static_cast<std::size_t>(reading)]; };
  const double bound = 0.5 * std::min(mean(Reading::as_given), mean(Reading::nothing));
  Reading best = Reading::as_given;
  double least = bound;
  for (const Reading reading : {Reading::negative, Reading::ras, Reading::voxels})
    if (mean(reading) < least) best = reading, least = mean(reading);
  return best;
}

DenseScore score_field(Truth& truth, const PullField& result, std::span<const Counts> counts,
                       std::span<const ConstVolumeView> parts, const Limits& limits, const Control& control) {
  const Geometry& grid = truth.grid();
  const glm::i64vec3 size = grid.size;
  require(result.grid.size == size && std::ssize(result.displacement) == voxel_count(grid),
          "the result lies on a grid of " + tetwarp::to_string(result.grid.size) + ", the truth on one of " +
              tetwarp::to_string(size));
  require(std::ssize(counts) == voxel_count(grid), "there has to be a mark for each voxel of the truth's grid");
  for (const ConstVolumeView& labels : parts) {
    require_label_map(labels);
    require(labels.geometry->size == size, "labels have to lie on the grid of the truth");
  }
  const FieldScorer scorer(result, counts, parts);
  SliceSums all;
  all.parts.resize(parts.size());
  cpu::WorkProgress progress(control, size.z);
  cpu::Arena arena(limits);
  for (std::int64_t begin = 0; begin < size.z; begin += kSlab) {
    const std::int64_t end = std::min(begin + kSlab, size.z);
    const TruthSlab slab = truth.slab({{0, 0, begin}, {size.x, size.y, end}}, control);
    std::vector<SliceSums> slices(static_cast<std::size_t>(end - begin));
    arena.execute([&] {
      tbb::parallel_for(begin, end, [&](std::int64_t k) {
        slices[static_cast<std::size_t>(k - begin)] = scorer.look_at(k, slab, begin);
        progress.done(1);
      });
    });
    for (const SliceSums& slice : slices) all.add(slice);
  }
  require(all.all.count() > 0, "no voxel of the truth's grid counts");
  return score_of(all);
}

glm::dvec3 displacement_at(const PullField& result, const glm::dvec3& point) {
  return sample(result, index_from_point(result.grid)(point));
}

Errors consistency(const PullField& first, const PullField& second, const PullField* whole,
                   std::span<const Counts> counts, const Limits& limits, const Control& control) {
  const glm::i64vec3 size = first.grid.size;
  require(std::ssize(counts) == voxel_count(first.grid) && std::ssize(first.displacement) == voxel_count(first.grid) &&
              std::ssize(second.displacement) == voxel_count(second.grid) &&
              (!whole || (whole->grid.size == size && std::ssize(whole->displacement) == voxel_count(first.grid))),
          "fields and marks that are compared do not fit their grids");
  const AffineMap point = point_from_index(first.grid), index = index_from_point(second.grid);
  std::vector<ErrorSums> slices(static_cast<std::size_t>(size.z));
  cpu::WorkProgress progress(control, size.z);
  cpu::Arena arena(limits);
  arena.execute([&] {
    tbb::parallel_for(std::int64_t{0}, size.z, [&](std::int64_t k) {
      auto voxel = static_cast<std::size_t>(k * size.x * size.y);
      for (std::int64_t j = 0; j < size.y; ++j) {
        for (std::int64_t i = 0; i < size.x; ++i, ++voxel) {
          if (counts[voxel] != Counts::yes) continue;
          const glm::dvec3 from = point(glm::dvec3(i, j, k)), between = from + glm::dvec3(first.displacement[voxel]);
          const glm::dvec3 by = sample(second, index(between));
          const glm::dvec3 wanted = whole ? from + glm::dvec3(whole->displacement[voxel]) : from;
          slices[static_cast<std::size_t>(k)].add_or_miss(glm::distance(between + by, wanted), from);
        }
      }
      progress.done(1);
    });
  });
  ErrorSums all;
  for (const ErrorSums& slice : slices) all.add(slice);
  return all.errors();
}

Errors score_points(std::span<const glm::dvec3> found, std::span<const glm::dvec3> wanted) {
  require(found.size() == wanted.size(), "there are " + std::to_string(found.size()) + " points where " +
                                             std::to_string(wanted.size()) + " are wanted");
  ErrorSums sums;
  for (std::size_t n = 0; n < found.size(); ++n)
    sums.add_or_miss(is_place(found[n]) ? glm::distance(found[n], wanted[n]) : NAN, wanted[n]);
  return sums.errors();
}

}  // namespace tetwarp::score
