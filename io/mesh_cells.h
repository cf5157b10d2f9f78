// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "deform/core/host_device.h"

namespace tetwarp {

/// Shape of a volume cell of a mesh file.
enum class CellShape : std::uint8_t {
  tetrahedron,  ///< 4 corners
  pyramid,      ///< 5 corners
  wedge,        ///< 6 corners
  hexahedron    ///< 8 corners
};
/// All shapes.
inline constexpr std::array kCellShapes = {CellShape::tetrahedron, CellShape::pyramid, CellShape::wedge,
                                           CellShape::hexahedron};
/// The name of a shape: "tetrahedron".
std::string to_string(CellShape shape);
/// Number of corners of a shape.
std::size_t corner_count(CellShape shape);

/// Splits cells of all shapes into tetrahedra, whose vertices are those of their cell.
///
/// A quadrilateral face is split by the diagonal at its lowest vertex number, so that the two cells at a face agree
/// without knowing of each other (Dompierre, Labbe, Vallet and Camarero, "How to subdivide pyramids, prisms and
/// hexahedra into tetrahedra", 1999). A cell becomes the cones from its lowest vertex over the triangles of the faces
/// that do not contain it: a pyramid becomes 2 tetrahedra, a wedge 3, a hexahedron 6. (The paper gives some hexahedra
/// 5.)
class MeshCells {
 public:
  /// @param file  name that messages show
  explicit MeshCells(std::string file) : file_(std::move(file)) {}

  /// Adds a cell.
  /// @param shape    its shape
  /// @param corners  vertex numbers in VTK's order. A convex cell that is positively oriented there gives positively
  ///         oriented tetrahedra. Vertices may be repeated where faces collapse to triangles or edges, as where a wedge
  ///         is written as a hexahedron; a hexahedron (a, b, c, d, d, d, d, d) is a tetrahedron.
  /// @param cell     number of the cell in the file, for messages
  /// @throws InputError, which names file and cell, for another number of corners, or repeated ones that leave no solid
  void add(CellShape shape, std::span<const std::uint32_t> corners, std::uint64_t cell);

  /// Number of cells of each shape that were added, in the order of kCellShapes.
  const std::array<std::uint64_t, kCellShapes.size()>& counts() const { return counts_; }
  /// Tetrahedra in the order of their cells.
  const std::vector<glm::u32vec4>& tetrahedra() const { return tetrahedra_; }
  /// Moves the tetrahedra out; none are left.
  std::vector<glm::u32vec4> take() { return std::move(tetrahedra_); }

 private:
  std::string file_;
  std::vector<glm::u32vec4> tetrahedra_;
  std::array<std::uint64_t, kCellShapes.size()> counts_{};
};

}  // namespace tetwarp
