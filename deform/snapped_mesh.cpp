// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/snapped_mesh.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <glm/common.hpp>
#include <optional>
#include <string>

#include "deform/core/lattice_vertex.h"
#include "deform/field_check.h"
#include "deform/fields/lattice_mesh.h"
#include "deform/target_check.h"

namespace tetwarp {

namespace {

constexpr std::size_t kGrain = 4096;

[[noreturn]] void refuse(const TetrahedralMesh& mesh, std::size_t vertex) {
  const glm::dvec3& at = mesh.rest[vertex];
  const glm::vec3& by = mesh.displacement[vertex];
  const auto text = [](const auto& v) {
    return "(" + std::to_string(v.x) + ", " + std::to_string(v.y) + ", " + std::to_string(v.z) + ")";
  };
  throw InputError("vertex " + std::to_string(vertex) + " of the mesh, counted from 0, at " + text(at) +
                   " mm and displaced by " + text(by) +
                   " mm, is not finite, lies more than 262144 voxels from the grid, or is moved by more than 131072; "
                   "are its units and frame right?");
}

/// Snaps the vertices of a mesh.
class VertexSnapper {
 public:
  VertexSnapper(const Geometry& output, const TetrahedralMesh& mesh, const FieldView& field)
      : mesh_(mesh), output_from_point_(index_from_point(output)) {
    if (mesh.lattice_vertex.empty() || !field.lattice) return;
    frame_ = make_lattice_frame(output, *field.lattice, field.outside);
    lattice_from_point_ = index_from_point(*field.lattice);
    size_ = field.lattice->size;
  }

  /// The frame of the lattice whose vertices the mesh names; empty: it names none.
  const std::optional<LatticeFrame>& frame() const { return frame_; }

  /// Snaps vertex n. @return false where it is not finite or too far away
  bool snap(std::size_t n, Vertex& vertex) const {
    const glm::dvec3 rest = frame_ ? frame_->output_from_lattice(lattice_index(n)) : output_from_point_(mesh_.rest[n]);
    return is_within(rest, kLargestIndex) && snap_moved(rest, output_from_point_.linear, mesh_.displacement[n], vertex);
  }

 private:
  glm::dvec3 lattice_index(std::size_t n) const {
    const std::int64_t number = mesh_.lattice_vertex[n];
    if (number < 0) return lattice_from_point_(mesh_.rest[n]);
    return glm::dvec3(number % size_.x, number / size_.x % size_.y, number / (size_.x * size_.y));
  }

  const TetrahedralMesh& mesh_;
  const AffineMap output_from_point_;
  AffineMap lattice_from_point_;
  glm::i64vec3 size_{0};
  std::optional<LatticeFrame> frame_;
};

/// What a pass over some tetrahedra found.
struct Findings {
  std::uint64_t inverted = 0, degenerate = 0;
  double least = std::numeric_limits<double>::infinity(), most = -least;
  glm::i64vec3 low{INT64_MAX}, high{INT64_MIN};  ///< steps: the box of undeformed corners

  void look_at(const Tetrahedron& t) {
    for (const Vertex* v : {&t.a, &t.b, &t.c, &t.d}) {
      const glm::i64vec3 rest(v->deformed + v->u);
      low = glm::min(low, rest);
      high = glm::max(high, rest);
    }
    const double determinant = forward_jacobian(t);
    if (!std::isfinite(determinant) || determinant == 0) ++degenerate;
    if (!std::isfinite(determinant)) return;  // undeformed, it has no volume
    inverted += determinant < 0;
    least = std::min(least, determinant);
    most = std::max(most, determinant);
  }
  Findings operator+(const Findings& other) const {
    return {inverted + other.inverted,  degenerate + other.degenerate, std::min(least, other.least),
            std::max(most, other.most), glm::min(low, other.low),      glm::max(high, other.high)};
  }
};

}  // namespace

void require_one_each(const TetrahedralMesh& mesh) {
  require(mesh.rest.size() == mesh.displacement.size(),
          "the mesh has " + std::to_string(mesh.rest.size()) + " vertices and " +
              std::to_string(mesh.displacement.size()) + " displacements; expected one for each vertex");
}

void require_fitting_arrays(const TetrahedralMesh& mesh, const Geometry* lattice) {
  require_one_each(mesh);
  const std::int64_t vertices = lattice ? voxel_count(*lattice) : INT64_MAX;
  require(mesh.lattice_vertex.empty() || mesh.lattice_vertex.size() == mesh.rest.size(),
          "the mesh has " + std::to_string(mesh.rest.size()) + " vertices and " +
              std::to_string(mesh.lattice_vertex.size()) +
              " numbers of a lattice's vertices; expected one for each vertex");
  for (const std::int64_t number : mesh.lattice_vertex) {
    require(number >= -1 && number < vertices, "a vertex of the mesh rests at vertex " + std::to_string(number) +
                                                   " of a lattice that has " + std::to_string(vertices));
  }
  require(mesh.tetrahedra.size() < UINT32_MAX,
          "the mesh has " + std::to_string(mesh.tetrahedra.size()) + " tetrahedra; expected fewer than 4294967295");
  for (std::size_t n = 0; n < mesh.tetrahedra.size(); ++n) {
    const glm::u32vec4& t = mesh.tetrahedra[n];
    const std::uint32_t largest = std::max({t.x, t.y, t.z, t.w});
    if (largest < mesh.rest.size()) continue;
    throw InputError("tetrahedron " + std::to_string(n) + " of the mesh has vertex " + std::to_string(largest) +
                     " of " + std::to_string(mesh.rest.size()) + ", counted from 0");
  }
}

SnappedMesh snap_mesh(const Geometry& output, const FieldView& field, const Control& control) {
  SnappedMesh snapped;
  std::optional<TetrahedralMesh> cut = mesh_of_cut(field);
  require(cut || field.mesh, "the field is empty");
  const TetrahedralMesh& mesh = cut ? *cut : *field.mesh;
  require(!mesh.tetrahedra.empty(), "the mesh has no tetrahedra");
  require_fitting_arrays(mesh, field.lattice);
  if (cut) snapped.made = std::make_shared<const std::vector<glm::u32vec4>>(std::move(cut->tetrahedra));
  snapped.tetrahedra = cut ? *snapped.made : mesh.tetrahedra;
  snapped.vertices.resize(mesh.rest.size());
  const VertexSnapper snapper(output, mesh, field);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, mesh.rest.size(), kGrain), [&](const auto& range) {
    if (control.stop.stop_requested()) throw Cancelled();
    for (std::size_t n = range.begin(); n < range.end(); ++n) {
      // Marks a vertex that cannot be used.
      if (!snapper.snap(n, snapped.vertices[n])) snapped.vertices[n].u.x = INT32_MIN;
    }
  });
  for (std::size_t n = 0; n < mesh.rest.size(); ++n) {
    const glm::i32vec3& u = snapped.vertices[n].u;
    if (u.x == INT32_MIN) refuse(mesh, n);
    snapped.most_moved = std::max({snapped.most_moved, std::abs(u.x), std::abs(u.y), std::abs(u.z)});
  }
  const Findings found = tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, snapped.tetrahedra.size(), kGrain), Findings{},
      [&](const auto& range, Findings findings) {
        if (control.stop.stop_requested()) throw Cancelled();
        for (std::size_t n = range.begin(); n < range.end(); ++n) findings.look_at(snapped.tetrahedron(n));
        return findings;
      },
      [](const Findings& a, const Findings& b) { return a + b; });
  snapped.nudge = snapper.frame() ? snapper.frame()->nudge : Nudge{found.low + found.high};
  snapped.coarse = is_coarse(output, field);
  snapped.inverted = found.inverted;
  snapped.degenerate = found.degenerate;
  snapped.jacobian_min = found.least;
  snapped.jacobian_max = found.most;
  return snapped;
}

SnappedMesh undeformed(const SnappedMesh& mesh) {
  SnappedMesh rest = mesh;
  for (Vertex& vertex : rest.vertices) vertex = {vertex.deformed + vertex.u, glm::i32vec3(0)};
  return rest;
}

void refuse_mesh_reach(const Geometry& output, std::int64_t voxels, std::int64_t lowest) {
  throw InputError("the mesh does not reach over the whole grid of the volume: " + std::to_string(voxels) + " of " +
                   std::to_string(voxel_count(output)) + " voxels lie outside it, the first at (" +
                   std::to_string(lowest % output.size.x) + ", " +
                   std::to_string(lowest / output.size.x % output.size.y) + ", " +
                   std::to_string(lowest / (output.size.x * output.size.y)) +
                   "); choose rest or background for what lies outside it");
}

Region mesh_source_region(const SnappedMesh& mesh, bool stays_outside, const Geometry& output, const Geometry& source,
                          const Region& region) {
  constexpr double kVoxelsPerStepExactly = 1.0 / kStepsPerVoxel;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  glm::dvec3 all_low(kInfinity), all_high(-kInfinity);  // box of undeformed places, output index
  for (std::size_t n = 0; n < mesh.tetrahedra.size(); ++n) {
    const Tetrahedron t = mesh.tetrahedron(n);
    if (is_empty(detail::candidates(mesh.nudge, box_of(t), region))) continue;
    glm::dvec3 low(kInfinity), high(-kInfinity);
    for (const Vertex* v : {&t.a, &t.b, &t.c, &t.d}) {
      const glm::dvec3 rest = glm::dvec3(v->deformed + v->u) * kVoxelsPerStepExactly;
      low = glm::min(low, rest);
      high = glm::max(high, rest);
    }
    const glm::dvec3 beyond = 4 * kWeightSlack * (high - low) +  // weights leave [0, 1] by the slack
                              (mesh.coarse ? kBeyondCoarse : 0.0);
    all_low = glm::min(all_low, low - beyond);
    all_high = glm::max(all_high, high + beyond);
  }
  if (stays_outside && !tetwarp::is_empty(region)) {
    all_low = glm::min(all_low, glm::dvec3(region.begin));
    all_high = glm::max(all_high, glm::dvec3(region.end - std::int64_t{1}));
  }
  return source_box(source, output, all_low, all_high);
}

}  // namespace tetwarp
