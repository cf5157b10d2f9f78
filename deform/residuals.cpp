// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/residuals.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <vector>

#include "deform/core/fixed_point.h"
#include "deform/core/trilinear.h"
#include "deform/cpu/tiles.h"
#include "deform/distance_histogram.h"
#include "deform/points.h"

namespace tetwarp {

namespace {

/// Sums of one slice. They are added up slice by slice, whichever thread made them, so that the order is fixed.
struct SliceSums {
  std::uint64_t points = 0;
  double sum = 0, largest = 0;
};

/// Collects distances from the slices of a grid, in one call or several.
class Distances {
 public:
  explicit Distances(std::int64_t slices) : slices_(static_cast<std::size_t>(slices)) {}

  /// Calls `distances(k, tell)` for each slice of begin <= k < end, in parallel; it calls `tell(distance)`.
  template <class Find>
  void find(std::int64_t begin, std::int64_t end, const Limits& limits, const Control& control, Find&& distances) {
    cpu::Arena arena(limits);
    cpu::WorkProgress progress(control, end - begin);
    arena.execute([&] {
      tbb::parallel_for(begin, end, [&](std::int64_t k) {
        SliceSums& slice = slices_[static_cast<std::size_t>(k)];
        DistanceHistogram& histogram = histograms_.local();
        distances(k, [&](double distance) {
          ++slice.points;
          slice.sum += distance;
          slice.largest = std::max(slice.largest, distance);
          histogram.add(distance);
        });
        progress.done(1);
      });
    });
  }

  Residuals residuals() const {
    Residuals all;
    double sum = 0;
    for (const SliceSums& slice : slices_) {
      all.points += slice.points;
      sum += slice.sum;
      all.largest = std::max(all.largest, slice.largest);
    }
    if (all.points == 0) return all;
    DistanceHistogram histogram;
    for (const DistanceHistogram& part : histograms_) histogram.add(part);
    all.mean = sum / static_cast<double>(all.points);
    all.percentile_99 = std::min(histogram.percentile(0.99, all.points), all.largest);
    return all;
  }

 private:
  std::vector<SliceSums> slices_;
  tbb::enumerable_thread_specific<DistanceHistogram> histograms_;
};

/// An inverse field of which some slices are in memory.
struct SlicedField {
  const Geometry& grid;
  std::vector<const glm::vec3*> slices;  ///< one per slice of the grid; null: not in memory

  explicit SlicedField(const Geometry& of) : grid(of), slices(static_cast<std::size_t>(of.size.z)) {}
  explicit SlicedField(const PullField& whole) : SlicedField(whole.grid) {
    for (std::int64_t k = 0; k < grid.size.z; ++k) hold(k, whole.displacement.data() + k * area());
  }

  std::int64_t area() const { return grid.size.x * grid.size.y; }
  void hold(std::int64_t k, const glm::vec3* slice) { slices[static_cast<std::size_t>(k)] = slice; }
  const glm::vec3* slice(std::int64_t k) const { return slices[static_cast<std::size_t>(k)]; }
};

/// A range of cells of a grid along k, half open.
struct Cells {
  std::int64_t begin = INT64_MIN, end = INT64_MAX;

  bool contains(std::int64_t k) const { return begin <= k && k < end; }
};

/// A field between its samples, trilinear; NaN where a sample that it needs is NaN or not in memory.
glm::dvec3 sample(const SlicedField& field, const glm::dvec3& index) {
  const glm::i64vec3 size = field.grid.size;
  return trilinear(size, index, [&](const glm::i64vec3& at) {
    const glm::vec3* slice = field.slice(at.z);
    return slice ? slice[at.y * size.x + at.x] : glm::vec3(NAN);
  });
}

/// The vertices of a field in parts: the slices of a lattice, or as many vertices of a mesh as one thread takes at a
/// time.
class VertexParts {
 public:
  explicit VertexParts(const VertexField& field) : field_(field), point_(point_from_index(field.lattice)) {}

  std::int64_t count() const {
    return slices() + (static_cast<std::int64_t>(field_.mesh.rest.size()) + kOfMesh - 1) / kOfMesh;
  }

  /// Calls `visit(rest, displacement)` for the vertices of a part: LPS mm.
  template <class Visit>
  void for_each(std::int64_t part, Visit&& visit) const {
    if (part >= slices()) {
      const std::size_t begin = static_cast<std::size_t>((part - slices()) * kOfMesh),
                        end = std::min(begin + kOfMesh, field_.mesh.rest.size());
      for (std::size_t n = begin; n < end; ++n) visit(field_.mesh.rest[n], glm::dvec3(field_.mesh.displacement[n]));
      return;
    }
    const glm::i64vec3 size = field_.lattice.size;
    const glm::vec3* displacement = field_.displacement.data() + part * size.x * size.y;
    for (std::int64_t j = 0; j < size.y; ++j) {
      for (std::int64_t i = 0; i < size.x; ++i, ++displacement)
        visit(point_(glm::dvec3(i, j, part)), glm::dvec3(*displacement));
    }
  }

 private:
  static constexpr std::int64_t kOfMesh = 4096;

  /// Number of slices of the lattice; 0 if a mesh stands alone.
  std::int64_t slices() const { return field_.mesh.is_empty() || !field_.replaced.empty() ? field_.lattice.size.z : 0; }

  const VertexField& field_;
  AffineMap point_;
};

/// Measures how far a point is from itself after the inverse and then the forward map, for all samples of the slices
/// begin <= k < end.
void find_forward_after(const SlicedField& inverse, const PointMover& forward, std::int64_t begin, std::int64_t end,
                        const Limits& limits, const Control& control, Distances& distances) {
  const Geometry& grid = inverse.grid;
  const AffineMap point = point_from_index(grid);
  distances.find(begin, end, limits, control, [&](std::int64_t k, auto&& tell) {
    const glm::vec3* slice = inverse.slice(k);
    if (!slice) return;
    for (std::int64_t j = 0; j < grid.size.y; ++j) {
      for (std::int64_t i = 0; i < grid.size.x; ++i) {
        const glm::vec3& by = slice[j * grid.size.x + i];
        if (std::isnan(by.x)) continue;
        const glm::dvec3 meant = point(glm::dvec3(i, j, k));
        glm::dvec3 found = meant + glm::dvec3(by);
        if (forward.move(found) == PointStatus::moved) tell(glm::distance(found, meant));
      }
    }
  });
}

/// Measures how far a vertex is from itself after the forward map and then the inverse, for the vertices that come to
/// lie in some cells of the inverse.
///
/// @param reach  for each part of the vertices, the cells in which they may come to lie; is replaced by those in which
/// they do
void find_inverse_after(const VertexField& field, const SlicedField& inverse, const Cells& cells,
                        std::vector<Cells>& reach, const Limits& limits, const Control& control, Distances& distances) {
  const VertexParts parts(field);
  const AffineMap index_from = index_from_point(inverse.grid);
  distances.find(0, parts.count(), limits, control, [&](std::int64_t part, auto&& tell) {
    Cells& reached = reach[static_cast<std::size_t>(part)];
    if (reached.end <= cells.begin || cells.end <= reached.begin) return;
    Cells found{INT64_MAX, INT64_MIN};
    parts.for_each(part, [&](const glm::dvec3& rest, const glm::dvec3& displacement) {
      const glm::dvec3 moved = rest + displacement, index = index_from(moved);
      const std::int64_t cell = cell_of(index.z, inverse.grid.size.z);
      if (cell < 0) return;
      found = {std::min(found.begin, cell), std::max(found.end, cell + 1)};
      if (!cells.contains(cell)) return;
      const double distance = glm::distance(moved + sample(inverse, index), rest);
      if (!std::isnan(distance)) tell(distance);
    });
    reached = found;
  });
}

Residuals forward_after(const SlicedField& inverse, const VertexField& field, const Limits& limits,
                        const Control& control) {
  Distances distances(inverse.grid.size.z);
  const PointMover forward(inverse.grid, view(field, Outside::background), limits, control);
  find_forward_after(inverse, forward, 0, inverse.grid.size.z, limits, control, distances);
  return distances.residuals();
}

Residuals inverse_after(const VertexField& field, const SlicedField& inverse, const Limits& limits,
                        const Control& control) {
  const std::int64_t parts = VertexParts(field).count();
  Distances distances(parts);
  std::vector<Cells> anywhere(static_cast<std::size_t>(parts));
  find_inverse_after(field, inverse, {}, anywhere, limits, control, distances);
  return distances.residuals();
}

/// Pairs of neighbouring slices, spread evenly, no slice twice; of a grid with few slices, all as one part.
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

struct InverseCheck::State {
  State(const VertexField& of, const Geometry& inverse, const Limits& with)
      : field(of),
        grid(inverse),
        limits(with),
        mover(inverse, view(of, Outside::background), with),
        forward(inverse.size.z),
        back(VertexParts(of).count()),
        reach(static_cast<std::size_t>(VertexParts(of).count())) {}

  const VertexField& field;
  Geometry grid;
  Limits limits;
  PointMover mover;
  Distances forward, back;
  /// By part of the vertices: the cells in which they come to lie. Most slabs are reached by few parts.
  std::vector<Cells> reach;
  std::vector<glm::vec3> last;  ///< the last slice that was added
  std::int64_t next = 0;        ///< the slice that comes next
};

InverseCheck::InverseCheck(const VertexField& field, const Geometry& grid, const Limits& limits)
    : state_(std::make_unique<State>(field, grid, limits)) {}

InverseCheck::~InverseCheck() = default;

void InverseCheck::add(const ConstVolumeView& slices, const Control& control) {
  State& state = *state_;
  const glm::i64vec3 size = state.grid.size;
  const std::int64_t first = state.next, end = slices.buffered.end.z, area = size.x * size.y;
  require(slices.voxels && slices.type == VoxelType::f32 && slices.components == 3 && slices.memory == Memory::host &&
              slices.buffered == Region{{0, 0, first}, {size.x, size.y, end}} && end > first && end <= size.z,
          "an inverse is expected in whole slices of 3 x float32, from slice " + std::to_string(first) + " on");
  SlicedField inverse(state.grid);
  const auto* samples = reinterpret_cast<const glm::vec3*>(slices.voxels);
  if (first > 0) inverse.hold(first - 1, state.last.data());
  for (std::int64_t k = first; k < end; ++k) inverse.hold(k, samples + (k - first) * area);
  const Control quiet{.stop = control.stop};
  find_forward_after(inverse, state.mover, first, end, state.limits, quiet, state.forward);
  const Cells cells{first == 0 ? INT64_MIN : first - 1, end == size.z ? INT64_MAX : end - 1};
  find_inverse_after(state.field, inverse, cells, state.reach, state.limits, quiet, state.back);
  state.last.assign(samples + (end - 1 - first) * area, samples + (end - first) * area);
  state.next = end;
}

Residuals InverseCheck::forward_after_inverse() const { return state_->forward.residuals(); }

Residuals InverseCheck::inverse_after_forward() const { return state_->back.residuals(); }

RoundTrip measure_round_trip(ForwardResampler& resampler, const VertexField& field, const Limits& limits,
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
