#include "deform/fields/lattice_mesh.h"

#include "deform/core/five_tetrahedra.h"
#include "deform/errors.h"

namespace tetwarp {

TetrahedralMesh mesh_of(const VertexField& field) {
  const Geometry& lattice = field.lattice;
  view(field);  // checks the number of displacements
  require(voxel_count(lattice) < UINT32_MAX,
          "a lattice of " + to_string(lattice.size) + " vertices is too large for a mesh");
  const AffineMap point = point_from_index(lattice);
  const glm::i64vec3 size = lattice.size;
  TetrahedralMesh mesh;
  mesh.displacement = field.displacement;
  for (std::int64_t k = 0; k < size.z; ++k) {
    for (std::int64_t j = 0; j < size.y; ++j) {
      for (std::int64_t i = 0; i < size.x; ++i) mesh.rest.push_back(point(glm::dvec3(i, j, k)));
    }
  }
  for (std::int64_t k = 0; k + 1 < size.z; ++k) {
    for (std::int64_t j = 0; j + 1 < size.y; ++j) {
      for (std::int64_t i = 0; i + 1 < size.x; ++i) {
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
  return mesh;
}

}  // namespace tetwarp
