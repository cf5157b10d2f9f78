#include "deform/residuals.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <vector>

#include "deform/core/fixed_point.h"
#include "deform/cpu/tiles.h"
#include "deform/points.h"

namespace tetwarp {

namespace {

/// Counts distances by the upper 16 bits of their floats: bins less than 1 % wide.
class Histogram {
 public:
  void add(double distance) {
    const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(distance));
    ++counts_[bits >> kDropped];
  }
  void add(const Histogram& other) {
    for (std::size_t n = 0; n < counts_.size(); ++n) counts_[n] += other.counts_[n];
  }
  /// The upper end of the bin that holds what a part of all distances do not exceed.
  double percentile(double part, std::uint64_t all) const {
    const auto wanted = static_cast<std::uint64_t>(std::ceil(part * static_cast<double>(all)));
    std::uint64_t seen = 0;
    for (std::size_t n = 0; n < counts_.size(); ++n) {
      seen += counts_[n];
      if (seen >= wanted) return std::bit_cast<float>(static_cast<std::uint32_t>((n << kDropped) | kRest));
    }
    return 0;
  }

 private:
  static constexpr int kDropped = 16;
  static constexpr std::uint32_t kRest = (1U << kDropped) - 1;
  std::vector<std::uint64_t> counts_ = std::vector<std::uint64_t>(std::size_t{1} << (31 - kDropped));
};

/// Of one slice: sums are added up slice by slice, whatever thread made them.
struct Slice {
  std::uint64_t points = 0;
  double sum = 0, largest = 0;
};

/// Calls `distances(k, tell)` for each slice, in parallel; it calls `tell(distance)`.
template <class Distances>
Residuals gather_slices(std::int64_t count, const Limits& limits, const Control& control, Distances&& distances) {
  std::vector<Slice> slices(static_cast<std::size_t>(count));
  tbb::enumerable_thread_specific<Histogram> histograms;
  tbb::task_arena arena = cpu::make_arena(limits);
  cpu::Progress progress(control, count);
  arena.execute([&] {
    tbb::parallel_for(std::int64_t{0}, count, [&](std::int64_t k) {
      Slice& slice = slices[static_cast<std::size_t>(k)];
      Histogram& histogram = histograms.local();
      distances(k, [&](double distance) {
        ++slice.points;
        slice.sum += distance;
        slice.largest = std::max(slice.largest, distance);
        histogram.add(distance);
      });
      progress.done(1);
    });
  });
  Residuals all;
  double sum = 0;
  for (const Slice& slice : slices) {
    all.points += slice.points;
    sum += slice.sum;
    all.largest = std::max(all.largest, slice.largest);
  }
  if (all.points == 0) return all;
  Histogram histogram;
  for (const Histogram& part : histograms) histogram.add(part);
  all.mean = sum / static_cast<double>(all.points);
  all.percentile_99 = std::min(histogram.percentile(0.99, all.points), all.largest);
  return all;
}

/// An inverse of which some slices are at hand.
struct SlicedField {
  const Geometry& grid;
  std::vector<const glm::vec3*> slices;  ///< one per slice of the grid; null: not at hand

  explicit SlicedField(const Geometry& of) : grid(of), slices(static_cast<std::size_t>(of.size.z)) {}
  explicit SlicedField(const PullField& whole) : SlicedField(whole.grid) {
    for (std::int64_t k = 0; k < grid.size.z; ++k) hold(k, whole.displacement.data() + k * area());
  }

  std::int64_t area() const { return grid.size.x * grid.size.y; }
  void hold(std::int64_t k, const glm::vec3* slice) { slices[static_cast<std::size_t>(k)] = slice; }
  const glm::vec3* slice(std::int64_t k) const { return slices[static_cast<std::size_t>(k)]; }
};

/// Trilinear between samples, NaN where one of them is or is not at hand.
glm::dvec3 sample(const SlicedField& field, const glm::dvec3& index) {
  const glm::i64vec3 size = field.grid.size;
  glm::i64vec3 cell;
  for (int axis = 0; axis < 3; ++axis) {
    if (!(index[axis] >= 0 && index[axis] <= static_cast<double>(size[axis] - 1))) return glm::dvec3(NAN);
    cell[axis] = std::min(static_cast<std::int64_t>(index[axis]), std::max<std::int64_t>(size[axis] - 2, 0));
  }
  if (!field.slice(cell.z) && !field.slice(std::min(cell.z + 1, size.z - 1))) return glm::dvec3(NAN);
  const glm::dvec3 t = index - glm::dvec3(cell);
  glm::dvec3 sum(0);
  for (int corner = 0; corner < 8; ++corner) {
    const glm::i64vec3 step(corner & 1, corner >> 1 & 1, corner >> 2);
    const glm::dvec3 part = glm::mix(1.0 - t, t, glm::dvec3(step));
    const double weight = part.x * part.y * part.z;
    if (weight == 0) continue;
    const glm::i64vec3 at = cell + step;
    const glm::vec3* slice = field.slice(at.z);
    if (!slice) return glm::dvec3(NAN);
    sum += weight * glm::dvec3(slice[at.y * size.x + at.x]);
  }
  return sum;
}

Residuals forward_after(const SlicedField& inverse, const VertexField& field, const Limits& limits,
                        const Control& control) {
  const Geometry& grid = inverse.grid;
  const AffineMap point = point_from_index(grid);
  const FieldView forward = view(field, Outside::background);
  return gather_slices(grid.size.z, limits, control, [&](std::int64_t k, auto&& tell) {
    const glm::vec3* slice = inverse.slice(k);
    if (!slice) return;
    std::vector<glm::dvec3> meant, points;
    for (std::int64_t j = 0; j < grid.size.y; ++j) {
      for (std::int64_t i = 0; i < grid.size.x; ++i) {
        const glm::vec3& by = slice[j * grid.size.x + i];
        if (std::isnan(by.x)) continue;
        meant.push_back(point(glm::dvec3(i, j, k)));
        points.push_back(meant.back() + glm::dvec3(by));
      }
    }
    const std::vector<PointStatus> status = move_points(grid, forward, points, {.threads = 1});
    for (std::size_t n = 0; n < points.size(); ++n) {
      if (status[n] == PointStatus::moved) tell(glm::distance(points[n], meant[n]));
    }
  });
}

Residuals inverse_after(const VertexField& field, const SlicedField& inverse, const Limits& limits,
                        const Control& control) {
  const glm::i64vec3 size = field.lattice.size;
  const AffineMap point = point_from_index(field.lattice), index = index_from_point(inverse.grid);
  return gather_slices(size.z, limits, control, [&](std::int64_t k, auto&& tell) {
    for (std::int64_t j = 0; j < size.y; ++j) {
      for (std::int64_t i = 0; i < size.x; ++i) {
        const glm::dvec3 rest = point(glm::dvec3(i, j, k));
        const glm::dvec3 moved =
            rest + glm::dvec3(field.displacement[static_cast<std::size_t>((k * size.y + j) * size.x + i)]);
        const double distance = glm::distance(moved + sample(inverse, index(moved)), rest);
        if (!std::isnan(distance)) tell(distance);
      }
    }
  });
}

/// Pairs of slices, evenly spread, none twice; of few slices, all as one part.
std::vector<Region> sampled_parts(const Geometry& grid) {
  constexpr std::int64_t kPairs = RoundTrip::kMostSlices / 2;
  Region part = whole(grid);
  if (grid.size.z <= RoundTrip::kMostSlices) return {part};
  std::vector<Region> parts;
  for (std::int64_t n = 0; n < kPairs; ++n) {
    part.begin.z = (2 * n + 1) * (grid.size.z - 1) / (2 * kPairs);
    part.end.z = part.begin.z + 2;
    parts.push_back(part);
  }
  return parts;
}

}  // namespace

Residuals forward_after_inverse(const VertexField& field, const PullField& inverse, const Limits& limits,
                                const Control& control) {
  return forward_after(SlicedField(inverse), field, limits, control);
}

Residuals inverse_after_forward(const VertexField& field, const PullField& inverse, const Limits& limits,
                                const Control& control) {
  return inverse_after(field, SlicedField(inverse), limits, control);
}

RoundTrip measure_round_trip(Resampler& resampler, const VertexField& field, const Limits& limits,
                             const Control& control) {
  const Geometry& grid = resampler.output();
  SlicedField inverse(grid);
  RoundTrip trip;
  trip.step_mm = std::max({grid.spacing.x, grid.spacing.y, grid.spacing.z}) / kStepsPerVoxel;
  std::vector<std::vector<glm::vec3>> held;
  const Control quiet{.stop = control.stop, .stream = control.stream};
  for (const Region& part : sampled_parts(grid)) {
    std::vector<glm::vec3>& samples = held.emplace_back(static_cast<std::size_t>(voxel_count(part)));
    const VolumeView map{&grid, part, VoxelType::f32, 3, std::as_writable_bytes(std::span(samples)).data()};
    resampler.resample(part, {}, {.inverse_mm = map}, quiet);
    for (std::int64_t k = part.begin.z; k < part.end.z; ++k)
      inverse.hold(k, samples.data() + (k - part.begin.z) * inverse.area());
    trip.slices += static_cast<std::uint64_t>(part.end.z - part.begin.z);
    trip.voxels += samples.size();
  }
  trip.forward_after_inverse = forward_after(inverse, field, limits, quiet);
  trip.inverse_after_forward = inverse_after(field, inverse, limits, quiet);
  return trip;
}

}  // namespace tetwarp
