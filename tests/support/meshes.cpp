// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/support/meshes.h"

#include <algorithm>
#include <glm/common.hpp>
#include <glm/vector_relational.hpp>
#include <utility>

#include "deform/fields/lattice_mesh.h"

namespace tetwarp::test {

TetrahedralMesh random_mesh(const Geometry& output, const glm::dvec3& low, const glm::dvec3& high, int most_cells,
                            Random& random) {
  VertexField lattice;
  lattice.lattice.size =
      glm::i64vec3(random.integer(1, most_cells), random.integer(1, most_cells), random.integer(1, most_cells)) +
      std::int64_t{1};
  lattice.displacement.resize(static_cast<std::size_t>(voxel_count(lattice.lattice)), glm::vec3(0));
  TetrahedralMesh mesh = mesh_of(lattice);
  std::vector<double> planes[3];
  for (int axis = 0; axis < 3; ++axis) {
    planes[axis] = {low[axis], high[axis]};
    while (static_cast<std::int64_t>(planes[axis].size()) < lattice.lattice.size[axis]) {
      const double at = random.real(low[axis], high[axis]);
      planes[axis].push_back(random.chance(0.3) ? glm::clamp(std::round(at), low[axis], high[axis]) : at);
    }
    std::sort(planes[axis].begin(), planes[axis].end());
    for (std::size_t n = 1; n + 1 < planes[axis].size(); ++n)  // no plane lies upon another
      planes[axis][n] = std::min(std::max(planes[axis][n], planes[axis][n - 1] + 0.05), high[axis] - 0.05);
  }
  const AffineMap point = point_from_index(output);
  const double thrown = random.chance(0.5) ? 0.2 : 0;
  for (glm::dvec3& rest : mesh.rest) {
    const glm::i64vec3 at(rest);  // vertices of the lattice have whole coordinates
    for (int axis = 0; axis < 3; ++axis) {
      const auto n = static_cast<std::size_t>(at[axis]);
      rest[axis] = planes[axis][n];
      if (n == 0 || n + 1 == planes[axis].size()) continue;
      const double room = std::min(planes[axis][n] - planes[axis][n - 1], planes[axis][n + 1] - planes[axis][n]);
      rest[axis] += random.real(-thrown, thrown) * room;
    }
    rest = point(rest);
  }
  for (glm::u32vec4& t : mesh.tetrahedra) {
    for (int n = 3; n > 0; --n) std::swap(t[n], t[static_cast<int>(random.integer(0, n))]);
    std::swap(t, mesh.tetrahedra[static_cast<std::size_t>(
                     random.integer(0, static_cast<std::int64_t>(mesh.tetrahedra.size()) - 1))]);
  }
  return mesh;
}

void shake(TetrahedralMesh& mesh, const Geometry& output, double voxels, double on_border, Random& random) {
  const AffineMap index = index_from_point(output);
  const glm::dmat3 mm = point_from_index(output).linear;
  glm::dvec3 low(INFINITY), high(-INFINITY);
  for (const glm::dvec3& rest : mesh.rest) {
    low = glm::min(low, index(rest));
    high = glm::max(high, index(rest));
  }
  for (std::size_t n = 0; n < mesh.rest.size(); ++n) {
    const glm::dvec3 at = index(mesh.rest[n]);
    const bool inside = glm::all(glm::lessThan(low + 1e-6, at)) && glm::all(glm::lessThan(at, high - 1e-6));
    const double most = inside ? voxels : on_border;
    const glm::dvec3 by(random.real(-most, most), random.real(-most, most), random.real(-most, most));
    mesh.displacement[n] = most == 0 ? glm::vec3(0) : glm::vec3(mm * by);
  }
}

TetrahedralMesh loose_tetrahedra(const Geometry& output, int count, double size, Random& random) {
  const AffineMap point = point_from_index(output);
  const glm::dvec3 last(output.size - std::int64_t{1});
  TetrahedralMesh mesh;
  for (int n = 0; n < count; ++n) {
    const glm::dvec3 middle(random.real(0, last.x), random.real(0, last.y), random.real(0, last.z));
    const double reach = size * random.real(0.02, 1);
    const bool is_flat = random.chance(0.1);
    const auto first = static_cast<std::uint32_t>(mesh.rest.size());
    for (int corner = 0; corner < 4; ++corner) {
      glm::dvec3 at = middle + reach * glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 1));
      if (random.chance(0.3)) at = glm::round(at);
      mesh.rest.push_back(point(at));
      glm::dvec3 to = random.chance(0.2) ? at : at + random.real(0, 3) * glm::dvec3(random.real(-1, 1), 1, -1);
      if (is_flat) to.y = 3;
      mesh.displacement.emplace_back(point.linear * (to - at));
    }
    mesh.tetrahedra.emplace_back(first, first + 1, first + 2, first + 3);
  }
  return mesh;
}

VertexField field_of(TetrahedralMesh mesh) {
  VertexField field;
  field.mesh = std::move(mesh);
  return field;
}

}  // namespace tetwarp::test
