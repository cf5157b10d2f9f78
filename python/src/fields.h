// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <nanobind/nanobind.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "deform/vertex_field.h"
#include "python/src/arrays.h"

namespace tetwarp::python {

/// Arrays of a mesh: rest [n, 3] of double, displacement [n, 3] of float, tetrahedra [m, 4] of uint32, and
/// lattice_vertex [n] of int64 or None.
struct MeshArrays {
  ConstArray rest, displacement, tetrahedra;
  std::optional<ConstArray> lattice_vertex;
};

/// A copy of a mesh's arrays.
/// @throws InputError for arrays of another shape or type, or vertex numbers that are too large
TetrahedralMesh mesh_of(const MeshArrays& arrays);

/// A forward field as a tuple of Python: lattice (a Grid or None), displacement (an array or None), mesh (None or a
/// tuple of four arrays), replaced cells (an array or None).
nb::tuple as_tuple(VertexField&& field);

/// A forward field of arrays that stay where they are.
class ForwardArrays {
 public:
  /// Takes arrays in the place of those before.
  /// @throws InputError for arrays that do not fit; then no field is held
  FieldView hold(const std::optional<Geometry>& lattice, const std::optional<ConstArray>& displacement,
                 const std::optional<MeshArrays>& mesh, const std::optional<ConstArray>& replaced,
                 const std::string& outside);
  /// Values of the lattice, if there are any.
  const std::optional<ConstArray>& displacement() const { return displacement_; }
  /// Whether setting the field surely takes less than 20 ms.
  bool is_small() const;

 private:
  Geometry lattice_;
  std::optional<ConstArray> displacement_;  ///< keeps the values to which the view refers
  TetrahedralMesh mesh_;
  std::vector<std::uint64_t> replaced_;
};

/// The vectors of an array [k, j, i, 3] of float, on the host or on a device.
const glm::vec3* vectors_of(const ConstArray& array, const Geometry& grid);

/// A pull field in host memory, copied from its grid and an array [k, j, i, 3] of float.
/// @throws InputError for an array of another shape or type
PullField pull_field_of(const Geometry& grid, const ConstArray& displacement);

/// A forward field in host memory, copied from what `as_tuple` describes.
VertexField field_of(const std::optional<Geometry>& lattice, const std::optional<ConstArray>& displacement,
                     const std::optional<MeshArrays>& mesh, const std::optional<ConstArray>& replaced);

}  // namespace tetwarp::python
