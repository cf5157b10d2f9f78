#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "deform/core/barycentric.h"
#include "deform/core/visit_cell.h"
#include "deform/resampler.h"

namespace tetwarp {

/// A tetrahedral mesh over an output grid: what every backend works with.
///
/// As a lattice's (`LatticeFrame::snap_vertex`), both ends of a vertex are taken in continuous output index in double
/// and snapped; u is zero exactly where the displacement is.
struct SnappedMesh {
  std::vector<Vertex> vertices;
  std::span<const glm::u32vec4> tetrahedra;  ///< of the mesh that was given
  Nudge nudge;                               ///< towards the middle of the undeformed mesh's box

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
/// The same, and for a tetrahedron with a vertex that is not there.
void require_fitting_arrays(const TetrahedralMesh& mesh);

/// Checks a mesh, snaps its vertices and looks at its tetrahedra, in parallel in the calling task arena.
/// @throws InputError for a mesh that is empty or whose arrays do not fit together, or the first vertex that is not
/// finite or too far away; Cancelled
SnappedMesh snap_mesh(const Geometry& output, const TetrahedralMesh& mesh, const Control& control);

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
  TETWARP_HD bool may_reach(const VoxelBox& box) const {
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
