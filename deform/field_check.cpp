#include "deform/field_check.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "deform/errors.h"
#include "deform/target_check.h"

namespace tetwarp {

namespace {

constexpr double kSmallestCell = 1.0 / 1024;  ///< voxels; snapping would leave smaller cells no shape
constexpr double kReachTolerance = 1.0 / kStepsPerVoxel;

}  // namespace

LatticeFrame make_lattice_frame(const Geometry& output, const FieldView& field) {
  require(field.lattice && field.displacement, "the field is empty");
  const Geometry& lattice = *field.lattice;
  require_valid(lattice, "field lattice");
  require(lattice.slices.empty(), "the field lattice has uneven slices; only a source may");
  LatticeFrame frame;
  frame.cells = lattice.size - std::int64_t{1};
  frame.output_from_lattice = index_from_point(output) * point_from_index(lattice);
  frame.lattice_from_output = index_from_point(lattice) * point_from_index(output);
  frame.output_from_mm = index_from_point(output).linear;
  for (int axis = 0; axis < 3; ++axis) {
    require(lattice.size[axis] >= 2,
            "field lattice of " + to_string(lattice.size) + " vertices, expected at least 2 on every axis");
    const double length = glm::length(frame.output_from_lattice.linear[axis]);
    require(length >= kSmallestCell, "the field's cells are " + std::to_string(length) +
                                         " voxels of the output along axis " + std::to_string(axis) +
                                         ", expected at least 1/1024");
  }
  Box rest{glm::i32vec3(INT32_MAX), glm::i32vec3(INT32_MIN)};
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 at = glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2);
    require(is_within(frame.output_from_lattice(at * glm::dvec3(frame.cells)), kLargestIndex),
            "the field's lattice lies more than 262144 voxels from the output grid");
    rest.grow(snap(frame.output_from_lattice(at * glm::dvec3(frame.cells))));
    if (field.outside != Outside::refuse) continue;
    const glm::dvec3 vertex = frame.lattice_from_output(at * glm::dvec3(output.size - std::int64_t{1}));
    for (int axis = 0; axis < 3; ++axis) {
      const double slack = kReachTolerance / glm::length(frame.output_from_lattice.linear[axis]);
      require(vertex[axis] >= -slack && vertex[axis] <= static_cast<double>(frame.cells[axis]) + slack,
              "the field's lattice of " + to_string(lattice.size) +
                  " vertices does not reach over the whole grid of the volume: a corner of it lies at vertex index " +
                  std::to_string(vertex[axis]) + " of axis " + std::to_string(axis) + ", expected 0 to " +
                  std::to_string(frame.cells[axis]) + "; choose rest or background for what lies outside it");
    }
  }
  frame.nudge.low_plus_high = glm::i64vec3(rest.low) + glm::i64vec3(rest.high);
  return frame;
}

StepLattice make_step_lattice(const LatticeFrame& frame, const Geometry& output) {
  constexpr double kMostSteps = 1 << 24, kNegligible = 1e-6;
  const glm::dmat3& linear = frame.output_from_lattice.linear;
  const glm::ivec3 first = snap(frame.output_from_lattice(glm::dvec3(0, 0, frame.first_slice)));
  StepLattice lattice;
  for (int axis = 0; axis < 3; ++axis) {
    const double step = std::rint(linear[axis][axis] * kStepsPerVoxel);
    for (int other = 0; other < 3; ++other) {
      const double meant = other == axis ? step / kStepsPerVoxel : 0;
      if (std::fabs(linear[axis][other] - meant) * static_cast<double>(frame.cells[axis]) > kNegligible) return {};
    }
    // From the first vertex, all places of vertices and voxels must be whole numbers that float holds.
    const double far = step * static_cast<double>(frame.cells[axis]);
    const double grid = static_cast<double>(output.size[axis]) * kStepsPerVoxel;
    const double before = std::fabs(static_cast<double>(first[axis]));
    if (step < 1 || step > kMostSteps / 4 || before + far >= kMostSteps || before + grid >= kMostSteps) return {};
    lattice.first[axis] = static_cast<float>(first[axis]);
    lattice.cell[axis] = static_cast<float>(step);
    lattice.voxel[axis] = static_cast<float>(kStepsPerVoxel / step);
  }
  const glm::i64vec3 size = frame.cells + std::int64_t{1};
  if (size.x * size.y * size.z > INT32_MAX) return {};
  lattice.cells = glm::ivec3(frame.cells);
  lattice.last = lattice.cells - 1;
  lattice.row = static_cast<int>(size.x);
  lattice.slice = static_cast<int>(size.x * size.y);
  return lattice;
}

PullFrame make_pull_frame(const Geometry& output, const PullFieldView& field) {
  require(field.grid && field.displacement, "the pull field is empty");
  require_valid(*field.grid, "pull field grid");
  PullFrame frame;
  frame.grid_from_output = *field.grid == output  // rounding tells no grid from itself
                               ? AffineMap{glm::dmat3(1), glm::dvec3(0)}
                               : index_from_point(*field.grid) * point_from_index(output);
  frame.output_from_mm = index_from_point(output).linear;
  frame.size = field.grid->size;
  frame.displacement = field.displacement;
  frame.rest_outside = field.outside == Outside::rest;
  for (int corner = 0; corner < 8 && field.outside == Outside::refuse; ++corner) {
    const glm::dvec3 at = glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2);
    const glm::dvec3 found = frame.grid_from_output(at * glm::dvec3(output.size - std::int64_t{1}));
    glm::dvec3 index = found;
    require(frame.clamp_to_samples(index),
            "the pull field's grid of " + to_string(frame.size) +
                " samples does not reach over the whole grid of the volume: a corner of it lies at (" +
                std::to_string(found.x) + ", " + std::to_string(found.y) + ", " + std::to_string(found.z) +
                ") of it; choose rest or background for what lies outside it");
  }
  return frame;
}

Region pull_source_region(const PullFrame& frame, const Geometry& grid, const Geometry& output, const Geometry& source,
                          Region region) {
  region = intersection(region, whole(output));
  if (tetwarp::is_empty(region)) return {};
  const glm::dvec3 first(region.begin), last(region.end - std::int64_t{1});
  Region samples = source_box(grid, output, first, last);
  glm::dvec3 least(0), most(0);
  for (std::int64_t z = samples.begin.z; z < samples.end.z; ++z) {
    for (std::int64_t y = samples.begin.y; y < samples.end.y; ++y) {
      for (std::int64_t x = samples.begin.x; x < samples.end.x; ++x) {
        if (PullFrame::is_missing(frame.vector({x, y, z}))) continue;
        const glm::dvec3 shift = frame.sample({x, y, z});
        least = glm::min(least, shift);
        most = glm::max(most, shift);
      }
    }
  }
  return source_box(source, output, first + least, last + most);
}

void refuse_sample(const glm::i64vec3& sample) {
  throw InputError("the pull field's displacement at (" + std::to_string(sample.x) + ", " + std::to_string(sample.y) +
                   ", " + std::to_string(sample.z) + ") is infinite or longer than 262144 voxels");
}

void refuse_vertex(const glm::i64vec3& vertex) {
  throw InputError("the field's displacement at vertex (" + std::to_string(vertex.x) + ", " + std::to_string(vertex.y) +
                   ", " + std::to_string(vertex.z) + ") is not finite or moves it by more than 131072 voxels");
}

}  // namespace tetwarp
