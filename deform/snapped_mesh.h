// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "deform/core/barycentric.h"
#include "deform/core/visit_cell.h"
#include "deform/resampler.h"

namespace tetwarp {

/// A tetrahedral mesh over an output grid: what every backend works with.
///
/// Both ends of a vertex are taken in continuous output index in double and snapped; u is zero exactly where the
/// displacement is. Vertices that rest at a lattice's are snapped by its frame, from their vertex index, so that they
/// have the bits that they have in the lattice; others from their place in mm.
struct SnappedMesh {
  std::vector<Vertex> vertices;
  std::span<const glm::u32vec4> tetrahedra;  ///< those of the mesh that was given, or `made`
  /// Tetrahedra made of a lattice with replaced cells; else null.
  std::shared_ptr<const std::vector<glm::u32vec4>> made;
  Nudge nudge;         ///< towards the middle of the undeformed box: the lattice's where there is one, else the mesh's
  bool coarse = true;  ///< whether its lattice is, where there is one
  std::int32_t most_moved = 0;  ///< largest displacement of a vertex on an axis, 2^-12 voxel

  std::uint64_t inverted = 0;    ///< tetrahedra turned inside out
  std::uint64_t degenerate = 0;  ///< tetrahedra without volume, deformed or undeformed; undeformed ones may own voxels
  double jacobian_min = std::numeric_limits<double>::infinity();  ///< over all that have a volume undeformed
  double jacobian_max = -std::numeric_limits<double>::infinity();

  Tetrahedron tetrahedron(std::size_t number) const {
    const glm::u32vec4& at = tetrahedra[number];
    return {vertices[at.x], vertices[at.y], vertices[at.z], vertices[at.w]};
  }
  /// What a report says of the whole field.
  void describe(Report& report) const {
    report.inverted = inverted;
    report.degenerate = degenerate;
    report.jacobian_min = jacobian_min;
    report.jacobian_max = jacobian_max;
  }
};

/// @throws InputError unless a mesh has one displacement for each vertex
void require_one_each(const TetrahedralMesh& mesh);
/// @throws InputError as `require_one_each`, for a tetrahedron with a vertex that is not there, and for numbers of
/// lattice vertices that are not one a vertex, or of no vertex of the lattice. @param lattice  may be null
void require_fitting_arrays(const TetrahedralMesh& mesh, const Geometry* lattice);

/// Checks the mesh of a field, snaps its vertices and looks at its tetrahedra, in parallel in the calling task arena.
/// @param field  a mesh, which must outlive the result, or a lattice with replaced cells, which need not; in host
/// memory
/// @throws InputError for a mesh that is empty or whose arrays do not fit together, the first vertex that is not finite
/// or too far away, and what `make_lattice_frame` throws for the lattice, if there is one; Cancelled
SnappedMesh snap_mesh(const Geometry& output, const FieldView& field, const Control& control);

/// The same mesh where nothing moved: its tetrahedra own what lies in the undeformed mesh.
SnappedMesh undeformed(const SnappedMesh& mesh);

/// @throws InputError for voxels of the output that lie outside the undeformed mesh. @param lowest  number of the first
[[noreturn]] void refuse_mesh_reach(const Geometry& output, std::int64_t voxels, std::int64_t lowest);

/// The part of a source that voxels of a region of the output may be sampled from.
/// @param stays_outside  whether voxels outside the undeformed mesh stay where they are
Region mesh_source_region(const SnappedMesh& mesh, bool stays_outside, const Geometry& output, const Geometry& source,
                          const Region& region);

/// What keeps a tetrahedron away from boxes of voxels.
class TetrahedronPlanes {
 public:
  TETWARP_HD explicit TetrahedronPlanes(const Tetrahedron& t) {
    const glm::dvec3 a(t.a.deformed), b(t.b.deformed), c(t.c.deformed), d(t.d.deformed);
    set(0, b, c, d, a);
    set(1, a, c, d, b);
    set(2, a, b, d, c);
    set(3, a, b, c, d);
  }

  /// False only where a face is certain to lie between the tetrahedron and all voxels of a box, nudged.
  TETWARP_HD bool may_reach(const Region& box) const {
    const glm::dvec3 low(glm::dvec3(box.begin) * double{kStepsPerVoxel} - 1.0),  // a nudge is shorter than a step
        high(glm::dvec3(box.end - std::int64_t{1}) * double{kStepsPerVoxel} + 1.0);
    for (const Plane& plane : planes_) {
      double most = -plane.offset, size = plane.error;
      for (int axis = 0; axis < 3; ++axis) {
        const double n = plane.normal[axis], below = n * low[axis], above = n * high[axis];
        most += below > above ? below : above;
        size += std::fabs(below) + std::fabs(above);
      }
      if (most < -kError * size) return false;
    }
    return true;
  }

 private:
  /// Far more than what rounding costs: products of three differences, a few sums.
  static constexpr double kError = 1e-12;

  /// normal . p - offset is positive inside, but for `error` times kError.
  struct Plane {
    glm::dvec3 normal;
    double offset, error;
  };

  TETWARP_HD void set(int number, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c,
                      const glm::dvec3& inside) {
    const glm::dvec3 u = b - a, v = c - a, w = inside - a;
    Plane& plane = planes_[number];
    plane.normal = {u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x};
    const auto dot = [](const glm::dvec3& x, const glm::dvec3& y) { return (x.x * y.x + x.y * y.y) + x.z * y.z; };
    if (dot(plane.normal, w) < 0) plane.normal = -plane.normal;
    plane.offset = dot(plane.normal, a);
    const auto norm1 = [](const glm::dvec3& x) { return std::fabs(x.x) + std::fabs(x.y) + std::fabs(x.z); };
    plane.error = norm1(u) * norm1(v) * (norm1(a) + norm1(w));
  }

  Plane planes_[4];
};

}  // namespace tetwarp
