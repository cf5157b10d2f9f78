// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <vector>

#include "deform/vertex_field.h"

namespace tetwarp::test {

/// How many tetrahedra own a voxel, and the lowest of their numbers.
struct Owners {
  std::uint32_t count = 0;
  std::uint64_t lowest = UINT64_MAX;
};

/// Where a voxel comes from, through its owner of lowest number.
struct Undeformed {
  glm::dvec3 u{0};  ///< undeformed minus deformed, voxels of output index
  glm::dvec3 alternative{
      0};                ///< another u that is as right where rounding decides between the voxel and the nudged point
  double jacobian = 0;   ///< deformed over rest volume of the owner
  double condition = 1;  ///< how much a relative rounding error of float products may grow in the weights
  double rest_condition = 1;  ///< the same factor for weights in the owner's undeformed volume
  double reach = 0;           ///< largest component of the difference of u between two corners, voxels
  bool coarse = false;        ///< whether the field is, so that u is a number in fixed point
  double from_middle = 0;     ///< if so: how far the voxel lies from the middle of its owner, sum norm, voxels
};

/// How far a determinant may be from the exact one: each of its two volumes, in float, is off by 5 units of the product
/// of its edges' sum norms, and their quotient is rounded once.
/// @param jacobian        the exact determinant
/// @param condition       of the tetrahedron as it is deformed, as `Undeformed` has it
/// @param rest_condition  of the tetrahedron at rest, in the same sense
double jacobian_tolerance(double jacobian, double condition, double rest_condition);

/// Finds owners by brute force, in other mathematics than the backends: it solves the paper's 4x4 system (Eq. 6) by
/// Cramer's rule in 128-bit integers, for every tetrahedron and every voxel whose nudged point lies in its box.
///
/// Coordinates are integers in units of 2^-16 voxel of output index. The point is (q, 1), q = p + d, and an
/// infinitesimal step is carried along as a polynomial in e: each numerator is c0 + c1 e + c2 e^2 + c3 e^3, whose sign
/// is that of its first coefficient that is not zero. A tetrahedron owns the voxel when no numerator is zero and all
/// have the sign of its determinant.
class Oracle {
 public:
  /// @param region  voxels to find owners of; counts of the report are those of the whole field all the same
  Oracle(const Geometry& output, const VertexField& field, const Region& region);
  Oracle(const Geometry& output, const VertexField& field) : Oracle(output, field, whole(output)) {}

  /// The owners of a voxel. @param voxel  in the region
  const Owners& owners(const glm::i64vec3& voxel) const;
  /// Where a voxel comes from. @param voxel  in the region, with an owner
  Undeformed undeformed(const glm::i64vec3& voxel) const;

  /// An interval of real numbers.
  struct Interval {
    double low, high;
  };

  std::uint64_t inverted = 0, degenerate = 0, multiply_owned = 0;
  /// Where the smallest and the largest determinant of the tetrahedra may be found to be, since each is off by as much
  /// as `jacobian_tolerance` says.
  Interval jacobian_min, jacobian_max;

 private:
  struct Vertex {
    glm::i64vec3 rest, deformed;  ///< 2^-16 voxel
  };

  void take_vertices(const Geometry& output, const VertexField& field);
  void take_mesh(const Geometry& output, const TetrahedralMesh& mesh);
  void visit(std::uint64_t tetrahedron);
  void corners(std::uint64_t tetrahedron, Vertex (&result)[4]) const;
  glm::i64vec3 signs(const glm::i64vec3& voxel) const;
  std::size_t offset(const glm::i64vec3& voxel) const;

  glm::i64vec3 vertices_{0}, cells_{0};
  std::vector<glm::u32vec4> tetrahedra_;  ///< of a field with a mesh
  std::vector<Vertex> vertex_;
  bool coarse_ = true;  ///< whether the lattice's steps are at least 2.5 voxels long; so is a mesh
  /// Twice the middle of the undeformed lattice's box, 2^-16 voxel.
  glm::i64vec3 middle_doubled_{0};
  Region region_;
  std::vector<Owners> owners_;
};

}  // namespace tetwarp::test
