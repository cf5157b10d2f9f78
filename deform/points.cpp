// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/points.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "deform/core/cell_weights.h"
#include "deform/cpu/first_refusal.h"
#include "deform/cpu/tiles.h"
#include "deform/field_check.h"
#include "deform/mesh_locator.h"

namespace tetwarp {

namespace {

/// How far outside the lattice a point on its border may lie by rounding, in voxels of the output.
constexpr double kOnBorder = 1.0 / kStepsPerVoxel;
/// The largest negative weight that counts as rounding: the tetrahedron holds the point.
constexpr double kRounding = 1e-9;

/// A tetrahedron and the weights of its corners A, B, C at a point.
struct Holder {
  Tetrahedron tetrahedron{};
  glm::dvec3 weights{0};
  /// The least of all four weights: negative where the point is outside the tetrahedron.
  double least = -INFINITY;
};

/// By how much the affine map of a tetrahedron moves the point with these weights, LPS mm.
glm::dvec3 moved_by(const Tetrahedron& t, const glm::dvec3& weights, const glm::dmat3& mm_from_output) {
  const glm::dvec3 d(t.d.u), &w = weights;
  const glm::dvec3 u =
      d + w.x * (glm::dvec3(t.a.u) - d) + w.y * (glm::dvec3(t.b.u) - d) + w.z * (glm::dvec3(t.c.u) - d);
  return u == glm::dvec3(0) ? u : mm_from_output * (u * (-1.0 / kStepsPerVoxel));
}

/// The volume of a tetrahedron after over before.
double determinant_of(const Tetrahedron& t) {
  const glm::dvec3 d(t.d.deformed), e(t.d.deformed + t.d.u);
  const auto deformed = [&](const Vertex& v) { return glm::dvec3(v.deformed) - d; };
  const auto rest = [&](const Vertex& v) { return glm::dvec3(v.deformed + v.u) - e; };
  return glm::determinant(glm::dmat3(deformed(t.a), deformed(t.b), deformed(t.c))) /
         glm::determinant(glm::dmat3(rest(t.a), rest(t.b), rest(t.c)));
}

/// Adds a motion to a point. A point that does not move keeps its bits, -0 included.
void add_move(const glm::dvec3& by, glm::dvec3& point) {
  if (by != glm::dvec3(0)) point += by;
}

}  // namespace

/// The forward map of a field, for points.
class PointMover::Map {
 public:
  virtual ~Map() = default;
  virtual PointStatus move(glm::dvec3& point, double* determinant) const = 0;
};

namespace {

class LatticeMap final : public PointMover::Map {
 public:
  LatticeMap(const Geometry& output, const FieldView& field)
      : field_(field),
        frame_(make_lattice_frame(output, field)),
        output_from_point_(index_from_point(output)),
        mm_from_output_(point_from_index(output).linear) {
    for (int axis = 0; axis < 3; ++axis)
      slack_[axis] = kOnBorder / glm::length(frame_.output_from_lattice.linear[axis]);
  }

  PointStatus move(glm::dvec3& point, double* determinant) const override;

 private:
  static bool is_odd(const glm::i64vec3& cell) { return ((cell.x + cell.y + cell.z) & 1) != 0; }
  Vertex vertex(const glm::i64vec3& cell, int corner) const;
  Holder hold(const glm::i64vec3& cell, const TetrahedronCorners& corners, const glm::dvec3& steps) const;
  Holder search_around(const glm::i64vec3& cell, const glm::dvec3& steps) const;

  const FieldView field_;
  const LatticeFrame frame_;
  const AffineMap output_from_point_;
  const glm::dmat3 mm_from_output_;
  glm::dvec3 slack_{0};  ///< kOnBorder, in cells along each axis
};

Vertex LatticeMap::vertex(const glm::i64vec3& cell, int corner) const {
  const glm::i64vec3 at = cell + glm::i64vec3(corner & 1, corner >> 1 & 1, corner >> 2);
  const glm::i64vec3& size = field_.lattice->size;
  Vertex result;
  if (!frame_.snap_vertex(at, field_.displacement[(at.z * size.y + at.y) * size.x + at.x], result)) refuse_vertex(at);
  return result;
}

/// The weights of a point in a tetrahedron. @param steps  the point in output index times 2^12, not rounded
Holder LatticeMap::hold(const glm::i64vec3& cell, const TetrahedronCorners& corners, const glm::dvec3& steps) const {
  Holder holder;
  Tetrahedron& t = holder.tetrahedron;
  t = {vertex(cell, corners.a), vertex(cell, corners.b), vertex(cell, corners.c), vertex(cell, corners.d)};
  const auto rest = [](const Vertex& v) { return glm::dvec3(v.deformed + v.u); };
  const glm::dvec3 d = rest(t.d);
  holder.weights = glm::inverse(glm::dmat3(rest(t.a) - d, rest(t.b) - d, rest(t.c) - d)) * (steps - d);
  const glm::dvec3& w = holder.weights;
  holder.least = std::min({w.x, w.y, w.z, 1 - w.x - w.y - w.z});
  return holder;
}

/// Among the tetrahedra of a cell and its neighbours, the one that holds a point best. Snapping moves the faces of
/// undeformed tetrahedra by up to 2^-13 voxel, so a point may lie beyond a face of the tetrahedron that held it before.
Holder LatticeMap::search_around(const glm::i64vec3& cell, const glm::dvec3& steps) const {
  const glm::i64vec3 begin = glm::max(cell - std::int64_t{1}, glm::i64vec3(0));
  const glm::i64vec3 end = glm::min(cell + std::int64_t{2}, frame_.cells);
  Holder best;
  for (std::int64_t z = begin.z; z < end.z; ++z) {
    for (std::int64_t y = begin.y; y < end.y; ++y) {
      for (std::int64_t x = begin.x; x < end.x; ++x) {
        for (int t = 0; t < kTetrahedraPerCell; ++t) {
          const glm::i64vec3 at(x, y, z);
          const Holder holder = hold(at, tetrahedron_corners(t, is_odd(at)), steps);
          if (holder.least > best.least) best = holder;
        }
      }
    }
  }
  return best;
}

PointStatus LatticeMap::move(glm::dvec3& point, double* determinant) const {
  const glm::dvec3 in_output = output_from_point_(point), at = frame_.lattice_from_output(in_output);
  glm::i64vec3 cell;
  for (int axis = 0; axis < 3; ++axis) {
    const double last = static_cast<double>(frame_.cells[axis]);
    if (!(at[axis] >= -slack_[axis] && at[axis] <= last + slack_[axis])) return PointStatus::outside;
    cell[axis] = std::clamp<std::int64_t>(static_cast<std::int64_t>(std::floor(at[axis])), 0, frame_.cells[axis] - 1);
  }
  const glm::dvec3 steps = in_output * double{kStepsPerVoxel};
  const CellWeights guess = weights_in_cell(glm::clamp(at - glm::dvec3(cell), 0.0, 1.0), is_odd(cell));
  Holder holder = hold(cell, guess.corners, steps);
  if (!(holder.least >= -kRounding)) holder = search_around(cell, steps);
  if (determinant) *determinant = determinant_of(holder.tetrahedron);
  add_move(moved_by(holder.tetrahedron, holder.weights, mm_from_output_), point);
  return PointStatus::moved;
}

class MeshMap final : public PointMover::Map {
 public:
  MeshMap(const Geometry& output, const FieldView& field, const Control& control)
      : mesh_(snap_mesh(output, field, control)),
        locator_(mesh_),
        output_from_point_(index_from_point(output)),
        mm_from_output_(point_from_index(output).linear) {}

  PointStatus move(glm::dvec3& point, double* determinant) const override {
    const auto found = locator_.find(output_from_point_(point) * double{kStepsPerVoxel});
    if (!found) return PointStatus::outside;
    const Tetrahedron tetrahedron = mesh_.tetrahedron(found->tetrahedron);
    if (determinant) *determinant = determinant_of(tetrahedron);
    add_move(moved_by(tetrahedron, found->weights, mm_from_output_), point);
    return PointStatus::moved;
  }

 private:
  const SnappedMesh mesh_;
  const MeshLocator locator_;
  const AffineMap output_from_point_;
  const glm::dmat3 mm_from_output_;
};

}  // namespace

PointMover::PointMover(const Geometry& output, const FieldView& field, const Limits& limits, const Control& control)
    : limits_(limits) {
  require(field.memory == Memory::host, "points are moved by fields in host memory");
  if (!field.mesh) {
    map_ = std::make_unique<LatticeMap>(output, field);
    return;
  }
  cpu::Arena arena(limits);
  arena.execute([&] { map_ = std::make_unique<MeshMap>(output, field, control); });
}

PointMover::~PointMover() = default;

PointStatus PointMover::move(glm::dvec3& point, double* determinant) const {
  if (determinant) *determinant = 1;
  return map_->move(point, determinant);
}

std::vector<PointStatus> PointMover::move(std::span<glm::dvec3> points, const Control& control) const {
  std::vector<PointStatus> status(points.size());
  cpu::WorkProgress progress(control, static_cast<std::int64_t>(points.size()));
  cpu::FirstRefusal refusal;
  cpu::Arena arena(limits_);
  arena.execute([&] {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, points.size(), 4096), [&](const auto& range) {
      refusal.attempt(static_cast<std::int64_t>(range.begin()), [&] {
        for (std::size_t n = range.begin(); n < range.end(); ++n) status[n] = move(points[n]);
        progress.done(static_cast<std::int64_t>(range.size()));
      });
    });
  });
  refusal.rethrow();
  return status;
}

std::vector<PointStatus> move_points(const Geometry& output, const FieldView& field, std::span<glm::dvec3> points,
                                     Limits limits, const Control& control) {
  return PointMover(output, field, limits, control).move(points, control);
}

}  // namespace tetwarp
