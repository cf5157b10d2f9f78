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

enum class CellShape : std::uint8_t { tetrahedron, pyramid, wedge, hexahedron };
inline constexpr std::array kCellShapes = {CellShape::tetrahedron, CellShape::pyramid, CellShape::wedge,
                                           CellShape::hexahedron};
std::string to_string(CellShape shape);     // "tetrahedron"
std::size_t corner_count(CellShape shape);  // 4, 5, 6, 8

/// Collects the tetrahedra of cells of all shapes; each is made of vertices of its cell.
///
/// A quadrilateral face is split by the diagonal at its lowest vertex number, so that the two cells at a face agree
/// without knowing of each other (Dompierre, Labbe, Vallet, Camarero, "How to subdivide pyramids, prisms and hexahedra
/// into tetrahedra", 1999). Inside, a cell is the cone from its lowest vertex over the triangles of the faces that do
/// not hold it: a pyramid becomes 2 tetrahedra, a wedge 3, a hexahedron 6. (The paper has 5 for some hexahedra.)
class MeshCells {
 public:
  /// @param file  named in errors
  explicit MeshCells(std::string file) : file_(std::move(file)) {}

  /// @param corners  vertex numbers in VTK's order, 4, 5, 6 or 8 of them; a cell that is convex and positively oriented
  ///                 there gives positively oriented tetrahedra. Vertices may be repeated where faces collapse to
  ///                 triangles or edges, as where a wedge is written as a hexahedron; and a hexahedron (a, b, c, d, d,
  ///                 d, d, d) is a tetrahedron
  /// @param cell  number of the cell in the file, for errors
  /// @throws InputError naming file and cell: another number of corners, or repeated ones that leave no solid
  void add(CellShape shape, std::span<const std::uint32_t> corners, std::uint64_t cell);

  /// How many cells were added; sizes in order of kCellShapes.
  const std::array<std::uint64_t, kCellShapes.size()>& counts() const { return counts_; }
  const std::vector<glm::u32vec4>& tetrahedra() const { return tetrahedra_; }
  /// In the order of the cells. Nothing is left here.
  std::vector<glm::u32vec4> take() { return std::move(tetrahedra_); }

 private:
  std::string file_;
  std::vector<glm::u32vec4> tetrahedra_;
  std::array<std::uint64_t, kCellShapes.size()> counts_{};
};

}  // namespace tetwarp
