// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/field_check.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "deform/core/barycentric.h"
#include "deform/errors.h"
#include "deform/target_check.h"

namespace tetwarp {

namespace {

constexpr double kSmallestCell = 1.0 / 1024;  ///< in voxels; snapping would leave smaller cells without a shape
/// How far, in voxels, a lattice may end before the outermost voxel centres and still count as reaching them: what
/// rounding a header's spacing and origin to six digits costs on 512 voxels (2.6e-3), and a little more.
constexpr double kBorderRounding = 1.0 / 256;

/// Where the corners of an output lie in a lattice: the lowest and highest vertex index on each axis.
struct Reach {
  glm::dvec3 low{INFINITY}, high{-INFINITY};

  Reach(const AffineMap& lattice_from_output, const glm::i64vec3& size) {
    for (int corner = 0; corner < 8; ++corner) {
      const glm::dvec3 at(corner & 1, corner >> 1 & 1, corner >> 2);
      const glm::dvec3 vertex = lattice_from_output(at * glm::dvec3(size - std::int64_t{1}));
      low = glm::min(low, vertex);
      high = glm::max(high, vertex);
    }
  }
};

/// Whether an axis of a lattice runs along an axis of the output, so that its border layers lie in planes of voxels.
bool is_aligned(const glm::dvec3& step, std::int64_t cells) {
  constexpr double kNegligible = 1e-6;  // voxels over the whole lattice
  int along = 0;
  for (int axis = 0; axis < 3; ++axis) along += std::fabs(step[axis]) * static_cast<double>(cells) > kNegligible;
  return along == 1;
}

/// How far a lattice is lengthened at the end of an axis so that its snapped border loses no voxel, in vertex index.
/// @param missing  voxels from the lattice's end to the outermost corner of the output; negative where it overhangs
double drawn_out(double missing, double voxels_per_cell, bool aligned) {
  constexpr double kStep = 1.0 / kStepsPerVoxel;
  // A border that lies in a plane of voxels, up to half a step before it, is snapped onto it. An oblique border may
  // lose a step and is moved by two.
  const double from = aligned ? kStep / 4 : -kStep, further = aligned ? 0 : 2 * kStep;
  return missing > from && missing <= kBorderRounding ? (missing + further) / voxels_per_cell : 0;
}

/// Lengthens a lattice to the border of the output where it ends within rounding of it. A lattice that reaches beyond
/// the border, or ends well inside it, stays as it is.
void reach_border(const Reach& reach, LatticeFrame& frame) {
  glm::dvec3 low(0), high(frame.cells);
  for (int axis = 0; axis < 3; ++axis) {
    const glm::dvec3 step = frame.output_from_lattice.linear[axis];
    const double length = glm::length(step);
    const bool aligned = is_aligned(step, frame.cells[axis]);
    low[axis] -= drawn_out(-reach.low[axis] * length, length, aligned);
    high[axis] += drawn_out((reach.high[axis] - static_cast<double>(frame.cells[axis])) * length, length, aligned);
  }
  if (low == glm::dvec3(0) && high == glm::dvec3(frame.cells)) return;
  const glm::dvec3 scale = (high - low) / glm::dvec3(frame.cells);
  const auto diagonal = [](const glm::dvec3& d) { return glm::dmat3(d.x, 0, 0, 0, d.y, 0, 0, 0, d.z); };
  frame.output_from_lattice = frame.output_from_lattice * AffineMap{diagonal(scale), low};
  frame.lattice_from_output = AffineMap{diagonal(1.0 / scale), -low / scale} * frame.lattice_from_output;
}

/// Refuses a lattice that does not reach over the output. @throws InputError
void require_reach(const Reach& reach, const LatticeFrame& frame) {
  for (int axis = 0; axis < 3; ++axis) {
    const double slack = kBorderRounding / glm::length(frame.output_from_lattice.linear[axis]),
                 cells = static_cast<double>(frame.cells[axis]);
    const bool below = !(reach.low[axis] >= -slack);
    require(!below && reach.high[axis] <= cells + slack, [&] {
      return "the field's lattice of " + to_string(frame.cells + std::int64_t{1}) +
             " vertices does not reach over the whole grid of the volume: a corner of it lies at vertex index " +
             std::to_string(below ? reach.low[axis] : reach.high[axis]) + " of axis " + std::to_string(axis) +
             ", expected 0 to " + std::to_string(frame.cells[axis]) +
             "; choose rest or background for what lies outside it";
    });
  }
}

}  // namespace

LatticeFrame make_lattice_frame(const Geometry& output, const FieldView& field) {
  require(field.lattice && field.displacement, "the field is empty");
  return make_lattice_frame(output, *field.lattice, field.outside);
}

bool is_coarse(const Geometry& output, const FieldView& field) {
  const bool is_mesh_alone = field.mesh && field.replaced.empty();
  if (is_mesh_alone && (!field.lattice || field.mesh->lattice_vertex.empty())) return true;
  require(field.lattice, "the field is empty");
  return make_lattice_frame(output, *field.lattice, Outside::background).coarse;  // whether it reaches or not
}

LatticeFrame make_lattice_frame(const Geometry& output, const Geometry& lattice, Outside outside) {
  require_valid(lattice, "field lattice");
  require(lattice.slices.empty(), "the field lattice has uneven slices; only a source may");
  LatticeFrame frame;
  frame.cells = lattice.size - std::int64_t{1};
  frame.output_from_lattice = index_from_point(output) * point_from_index(lattice);
  frame.lattice_from_output = index_from_point(lattice) * point_from_index(output);
  frame.output_from_mm = index_from_point(output).linear;
  frame.coarse = true;
  for (int axis = 0; axis < 3; ++axis) {
    require(lattice.size[axis] >= 2, [&] {
      return "field lattice of " + to_string(lattice.size) + " vertices, expected at least 2 on every axis";
    });
    const double length = glm::length(frame.output_from_lattice.linear[axis]);
    require(length >= kSmallestCell, [&] {
      return "the field's cells are " + std::to_string(length) + " voxels of the output along axis " +
             std::to_string(axis) + ", expected at least 1/1024";
    });
    frame.coarse = frame.coarse && length >= kCoarseStep;
  }
  const Reach reach(frame.lattice_from_output, output.size);
  if (outside == Outside::refuse) require_reach(reach, frame);
  reach_border(reach, frame);
  Box rest{glm::i32vec3(INT32_MAX), glm::i32vec3(INT32_MIN)};
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 at = glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2);
    require(is_within(frame.output_from_lattice(at * glm::dvec3(frame.cells)), kLargestIndex),
            "the field's lattice lies more than 262144 voxels from the output grid");
    rest.grow(snap(frame.output_from_lattice(at * glm::dvec3(frame.cells))));
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
    // Places of vertices and voxels are counted from the first vertex; float must hold all of them as whole numbers.
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
  const glm::vec3 x(lattice.cell.x, 0, 0), y(0, lattice.cell.y, 0), z(0, 0, lattice.cell.z);
  if (is_thin_at_rest(x, y, z) || is_thin_at_rest(y + z, x + z, x + y)) return {};
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
  frame.grid_from_output = *field.grid == output  // exact where both are the same grid, without rounding
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
    require(frame.clamp_to_samples(index), [&] {
      return "the pull field's grid of " + to_string(frame.size) +
             " samples does not reach over the whole grid of the volume: a corner of it lies at (" +
             std::to_string(found.x) + ", " + std::to_string(found.y) + ", " + std::to_string(found.z) +
             ") of it; choose rest or background for what lies outside it";
    });
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
