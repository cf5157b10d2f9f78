// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/score/registration_score.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <limits>

#include "deform/cpu/tiles.h"
#include "deform/distance_histogram.h"
#include "deform/errors.h"

namespace tetwarp::score {

namespace {

constexpr std::int64_t kSlab = 8;  // slices of the truth that are held at a time
constexpr double kNothing = std::numeric_limits<double>::infinity();

/// Collects errors. Those of slices are added up in their order, so the sums do not depend on threads.
class ErrorSums {
 public:
  void add(double distance, const glm::dvec3& where) {
    ++errors_.points;
    sum_ += distance;
    histogram_.add(distance);
    if (distance > errors_.largest || errors_.points == 1) errors_.largest = distance, errors_.worst = where;
  }
  void add_missing() { ++errors_.missing; }
  void add(const ErrorSums& later) {
    if (later.errors_.points > 0 && (errors_.points == 0 || later.errors_.largest > errors_.largest)) {
      errors_.largest = later.errors_.largest;
      errors_.worst = later.errors_.worst;
    }
    errors_.points += later.errors_.points;
    errors_.missing += later.errors_.missing;
    sum_ += later.sum_;
    histogram_.add(later.histogram_);
  }
  Errors errors() const {
    Errors all = errors_;
    if (all.points == 0) return all;
    all.mean = sum_ / static_cast<double>(all.points);
    const auto percentile = [&](double part) { return std::min(histogram_.percentile(part, all.points), all.largest); };
    all.median = percentile(0.5);
    all.percentile_95 = percentile(0.95);
    all.percentile_99 = percentile(0.99);
    return all;
  }

 private:
  Errors errors_;
  double sum_ = 0;
  DistanceHistogram histogram_;
};

/// What is found in one slice.
struct SliceSums {
  ErrorSums all;
  std::map<std::int64_t, ErrorSums> labels;
  std::array<double, kReadings> readings{};
  std::uint64_t determinants = 0, folded = 0;
  double smallest = kNothing, largest = -kNothing, determinant_error = 0;

  void add(const SliceSums& later) {
    all.add(later.all);
    for (const auto& [label, sums] : later.labels) labels[label].add(sums);
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

/// Some slices of what the truth says.
struct TruthSlab {
  std::vector<std::uint8_t> coverage;
  std::vector<glm::vec3> inverse;
  std::vector<float> jacobian;

  TruthSlab(ForwardResampler& truth, const Region& slices, const Control& control) {
    const Geometry& grid = truth.output();
    const auto count = static_cast<std::size_t>(voxel_count(slices));
    coverage.resize(count);
    inverse.resize(count);
    jacobian.resize(count);
    const auto map = [&](auto& values, VoxelType type, int components) {
      return VolumeView{&grid, slices, type, components, std::as_writable_bytes(std::span(values)).data()};
    };
    truth.resample(slices, {},
                   {.coverage = map(coverage, VoxelType::u8, 1),
                    .inverse_mm = map(inverse, VoxelType::f32, 3),
                    .jacobian = map(jacobian, VoxelType::f32, 1)},
                   {.stop = control.stop, .stream = control.stream});
  }
};

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

DenseScore score_field(ForwardResampler& truth, const PullField& result, const std::vector<std::uint8_t>& counts,
                       const ConstVolumeView& labels, const Limits& limits, const Control& control) {
  const Geometry& grid = truth.output();
  const glm::i64vec3 size = grid.size;
  const std::int64_t area = size.x * size.y;
  require(result.grid.size == size && std::ssize(result.displacement) == voxel_count(grid),
          "the result lies on a grid of " + tetwarp::to_string(result.grid.size) + ", the fixed volume on one of " +
              tetwarp::to_string(size));
  require(std::ssize(counts) == voxel_count(grid), "there has to be a mark for each voxel of the fixed volume");
  require(!labels.voxels || (labels.buffered == whole(grid) && labels.components == 1 &&
                             labels.type != VoxelType::f32 && labels.type != VoxelType::f64),
          "labels have to be whole numbers on the grid of the fixed volume");
  const ResultMap map(result);
  SliceSums all;
  cpu::WorkProgress progress(control, size.z);
  cpu::Arena arena(limits);
  for (std::int64_t begin = 0; begin < size.z; begin += kSlab) {
    const std::int64_t end = std::min(begin + kSlab, size.z);
    const TruthSlab slab(truth, {{0, 0, begin}, {size.x, size.y, end}}, control);
    std::vector<SliceSums> slices(static_cast<std::size_t>(end - begin));
    const auto look_at = [&](std::int64_t k, auto&& label_of) {
      SliceSums& sums = slices[static_cast<std::size_t>(k - begin)];
      std::int64_t voxel = k * area;
      for (std::int64_t j = 0; j < size.y; ++j) {
        for (std::int64_t i = 0; i < size.x; ++i, ++voxel) {
          const auto at = static_cast<std::size_t>(voxel - begin * area);
          if (!counts[static_cast<std::size_t>(voxel)] || !slab.coverage[at]) continue;
          ErrorSums* const of_label = label_of(sums, voxel);
          const glm::dvec3 by = map.displacement(voxel);
          if (!is_place(by)) {
            sums.all.add_missing();
            if (of_label) of_label->add_missing();
            continue;
          }
          const glm::dvec3 wanted(slab.inverse[at]);
          const auto readings = map.readings(by);
          for (std::size_t n = 0; n < kReadings; ++n) sums.readings[n] += glm::distance(readings[n], wanted);
          const double distance = glm::distance(by, wanted);
          const glm::dvec3 where = map.point({i, j, k});
          sums.all.add(distance, where);
          if (of_label) of_label->add(distance, where);
          const double determinant = map.determinant({i, j, k}, voxel);
          if (std::isnan(determinant)) continue;
          ++sums.determinants;
          sums.folded += determinant <= 0;
          sums.smallest = std::min(sums.smallest, determinant);
          sums.largest = std::max(sums.largest, determinant);
          sums.determinant_error += std::abs(determinant - 1 / static_cast<double>(slab.jacobian[at]));
        }
      }
      progress.done(1);
    };
    arena.execute([&] {
      tbb::parallel_for(begin, end, [&](std::int64_t k) {
        if (!labels.voxels)
          return look_at(k, [](SliceSums&, std::int64_t) { return static_cast<ErrorSums*>(nullptr); });
        dispatch(labels.type, [&]<class V>(V) {
          const V* values = reinterpret_cast<const V*>(labels.voxels);
          look_at(k, [&](SliceSums& sums, std::int64_t voxel) {
            return &sums.labels[static_cast<std::int64_t>(values[voxel])];
          });
        });
      });
    });
    for (const SliceSums& slice : slices) all.add(slice);
  }
  DenseScore score;
  score.all = all.all.errors();
  require(score.all.points + score.all.missing > 0, "no voxel of the fixed volume counts");
  for (const auto& [label, sums] : all.labels) score.labels[label] = sums.errors();
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

Errors score_points(std::span<const glm::dvec3> found, std::span<const glm::dvec3> wanted) {
  require(found.size() == wanted.size(), "there are " + std::to_string(found.size()) + " points where " +
                                             std::to_string(wanted.size()) + " are wanted");
  ErrorSums sums;
  for (std::size_t n = 0; n < found.size(); ++n) {
    if (is_place(found[n])) {
      sums.add(glm::distance(found[n], wanted[n]), wanted[n]);
    } else {
      sums.add_missing();
    }
  }
  return sums.errors();
}

}  // namespace tetwarp::score
