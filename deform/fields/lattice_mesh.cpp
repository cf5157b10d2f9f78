// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/fields/lattice_mesh.h"

#include <glm/common.hpp>
#include <numeric>

#include "deform/core/five_tetrahedra.h"
#include "deform/errors.h"
#include "deform/snapped_mesh.h"

namespace tetwarp {

namespace {

/// For each vertex of a mesh, the lattice's vertex where it rests, or -1. If the mesh does not state it, it is found by
/// place.
std::vector<std::int64_t> lattice_vertices_of(const TetrahedralMesh& mesh, const Geometry& lattice) {
  if (!mesh.lattice_vertex.empty()) return mesh.lattice_vertex;
  const AffineMap point = point_from_index(lattice), index = index_from_point(lattice);
  const glm::i64vec3 size = lattice.size;
  std::vector<std::int64_t> numbers;
  for (const glm::dvec3& rest : mesh.rest) {
    const glm::i64vec3 near =
        glm::clamp(glm::i64vec3(glm::round(index(rest))), glm::i64vec3(0), size - std::int64_t{1});
    numbers.push_back(point(glm::dvec3(near)) == rest ? (near.z * size.y + near.y) * size.x + near.x : -1);
  }
  return numbers;
}

/// Adds a mesh to the mesh of a lattice. Vertices at the place of a lattice vertex with the same displacement are that
/// vertex and are not added again.
void append(const TetrahedralMesh& added, const Geometry& lattice, TetrahedralMesh& mesh) {
  const std::vector<std::int64_t> of_lattice = lattice_vertices_of(added, lattice);
  std::vector<std::uint32_t> number;
  for (std::size_t n = 0; n < added.rest.size(); ++n) {
    const std::int64_t vertex = of_lattice[n];
    if (vertex >= 0 && mesh.displacement[static_cast<std::size_t>(vertex)] == added.displacement[n]) {
      number.push_back(static_cast<std::uint32_t>(vertex));
      continue;
    }
    number.push_back(static_cast<std::uint32_t>(mesh.rest.size()));
    mesh.rest.push_back(added.rest[n]);
    mesh.displacement.push_back(added.displacement[n]);
    mesh.lattice_vertex.push_back(vertex);
  }
  for (const glm::u32vec4& t : added.tetrahedra)
    mesh.tetrahedra.emplace_back(number[t.x], number[t.y], number[t.z], number[t.w]);
}

}  // namespace

bool has_lattice_vertices(const VertexField& field) {
  return !field.mesh.lattice_vertex.empty() && field.lattice.size.x != 0;
}

TetrahedralMesh mesh_of(const FieldView& field) {
  if (field.mesh) require_fitting_arrays(*field.mesh, field.lattice);
  if (field.mesh && field.replaced.empty()) return *field.mesh;
  require(field.memory == Memory::host, "a mesh is made of a field in host memory");
  const Geometry& lattice = *field.lattice;
  const auto vertices = static_cast<std::size_t>(voxel_count(lattice));
  require(vertices + (field.mesh ? field.mesh->rest.size() : 0) < UINT32_MAX,
          "a lattice of " + to_string(lattice.size) + " vertices is too large for a mesh");
  const AffineMap point = point_from_index(lattice);
  const glm::i64vec3 size = lattice.size;
  TetrahedralMesh mesh;
  mesh.displacement.assign(field.displacement, field.displacement + vertices);
  for (std::int64_t k = 0; k < size.z; ++k) {
    for (std::int64_t j = 0; j < size.y; ++j) {
      for (std::int64_t i = 0; i < size.x; ++i) mesh.rest.push_back(point(glm::dvec3(i, j, k)));
    }
  }
  mesh.lattice_vertex.resize(vertices);
  std::iota(mesh.lattice_vertex.begin(), mesh.lattice_vertex.end(), std::int64_t{0});
  std::uint64_t cell = 0;
  auto replaced = field.replaced.begin();
  for (std::int64_t k = 0; k + 1 < size.z; ++k) {
    for (std::int64_t j = 0; j + 1 < size.y; ++j) {
      for (std::int64_t i = 0; i + 1 < size.x; ++i, ++cell) {
        if (replaced != field.replaced.end() && *replaced == cell) {
          ++replaced;
          continue;
        }
        for (int t = 0; t < kTetrahedraPerCell; ++t) {
          const TetrahedronCorners corners = tetrahedron_corners(t, (i + j + k) % 2 != 0);
          const auto vertex = [&](int c) {
            return static_cast<std::uint32_t>(i + (c & 1) + size.x * (j + (c >> 1 & 1) + size.y * (k + (c >> 2 & 1))));
          };
          mesh.tetrahedra.emplace_back(vertex(corners.a), vertex(corners.b), vertex(corners.c), vertex(corners.d));
        }
      }
    }
  }
  require(replaced == field.replaced.end(),
          "replaced cells are expected by rising number, below " + std::to_string(cell) + ", the cells of the lattice");
  if (field.mesh) append(*field.mesh, lattice, mesh);
  return mesh;
}

TetrahedralMesh mesh_of(const VertexField& field) { return mesh_of(view(field)); }

std::optional<TetrahedralMesh> mesh_of_cut(const FieldView& field) {
  if (field.replaced.empty()) return std::nullopt;
  return mesh_of(field);
}

}  // namespace tetwarp
