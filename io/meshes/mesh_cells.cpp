// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/mesh_cells.h"

#include <algorithm>
#include <utility>

#include "deform/errors.h"

namespace tetwarp {
namespace {

using Corners = std::span<const std::uint32_t>;
using Triangle = std::array<std::uint32_t, 3>;

/// Corner numbers of a face in counter-clockwise order, seen from outside; the last one of a triangle is kNone.
using FaceCorners = std::array<std::uint8_t, 4>;
constexpr std::uint8_t kNone = 255;
constexpr std::array<FaceCorners, 4> kTetrahedron = {
    {{0, 2, 1, kNone}, {0, 1, 3, kNone}, {1, 2, 3, kNone}, {2, 0, 3, kNone}}};
constexpr std::array<FaceCorners, 5> kPyramid = {
    {{0, 3, 2, 1}, {0, 1, 4, kNone}, {1, 2, 4, kNone}, {2, 3, 4, kNone}, {3, 0, 4, kNone}}};
constexpr std::array<FaceCorners, 5> kWedge = {  // in VTK's order of corners: the triangle (0, 1, 2) looks outwards
    {{0, 1, 2, kNone}, {3, 5, 4, kNone}, {0, 3, 4, 1}, {1, 4, 5, 2}, {2, 5, 3, 0}}};
constexpr std::array<FaceCorners, 6> kHexahedron = {
    {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}}};

std::span<const FaceCorners> faces_of(CellShape shape) {
  switch (shape) {
    case CellShape::tetrahedron: return kTetrahedron;
    case CellShape::pyramid: return kPyramid;
    case CellShape::wedge: return kWedge;
    case CellShape::hexahedron: break;
  }
  return kHexahedron;
}

bool is_flat(const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }

/// Calls `use` with each triangle of a cell's surface that has three different vertices. Quadrilaterals are cut into
/// two.
template <class Use>
void for_each_triangle(CellShape shape, Corners corners, const Use& use) {
  for (const FaceCorners& face : faces_of(shape)) {
    const auto at = [&](std::size_t n) { return corners[face[n]]; };
    if (face[3] == kNone) {
      if (const Triangle whole = {at(0), at(1), at(2)}; !is_flat(whole)) use(whole);
      continue;
    }
    // The first corner of the diagonal: it begins at the vertex with the lowest number, so that neighbours agree.
    const std::size_t from = std::min(at(0), at(2)) < std::min(at(1), at(3)) ? 0 : 1;
    for (const std::size_t n : {from, from + 2}) {
      if (const Triangle half = {at(n % 4), at((n + 1) % 4), at((n + 2) % 4)}; !is_flat(half)) use(half);
    }
  }
}

bool has_repeated(Corners corners) {
  for (std::size_t n = 1; n < corners.size(); ++n) {
    if (std::find(corners.begin(), corners.begin() + static_cast<std::ptrdiff_t>(n), corners[n]) !=
        corners.begin() + static_cast<std::ptrdiff_t>(n))
      return true;
  }
  return false;
}

/// Whether repeated corners make two parts of the surface coincide, or leave no surface.
bool is_folded(CellShape shape, Corners corners) {
  std::vector<Triangle> seen;
  for_each_triangle(shape, corners, [&](Triangle triangle) {
    std::sort(triangle.begin(), triangle.end());
    seen.push_back(triangle);
  });
  std::sort(seen.begin(), seen.end());
  return seen.empty() || std::adjacent_find(seen.begin(), seen.end()) != seen.end();
}

bool is_collapsed_to_tetrahedron(CellShape shape, Corners corners) {
  return shape == CellShape::hexahedron && !has_repeated(corners.first(4)) &&
         std::all_of(corners.begin() + 4, corners.end(), [&](std::uint32_t v) { return v == corners[3]; });
}

}  // namespace

std::string to_string(CellShape shape) {
  switch (shape) {
    case CellShape::tetrahedron: return "tetrahedron";
    case CellShape::pyramid: return "pyramid";
    case CellShape::wedge: return "wedge";
    case CellShape::hexahedron: break;
  }
  return "hexahedron";
}

std::size_t corner_count(CellShape shape) {
  constexpr std::array<std::size_t, kCellShapes.size()> kCorners = {4, 5, 6, 8};
  return kCorners[static_cast<std::size_t>(shape)];
}

void MeshCells::add(CellShape shape, Corners corners, std::uint64_t cell) {
  const auto named = [&] { return "the " + to_string(shape) + " " + std::to_string(cell) + ", " + file_; };
  if (corners.size() != corner_count(shape)) {
    throw InputError(std::to_string(corners.size()) + " vertices of " + named() + "; expected " +
                     std::to_string(corner_count(shape)));
  }
  ++counts_[static_cast<std::size_t>(shape)];
  if (has_repeated(corners)) {
    if (is_collapsed_to_tetrahedron(shape, corners)) {
      tetrahedra_.emplace_back(corners[0], corners[1], corners[2], corners[3]);
      return;
    }
    if (is_folded(shape, corners)) {
      throw InputError("no solid is left by the repeated vertices of " + named() +
                       "; write it as a cell of fewer vertices, or leave it out");
    }
  } else if (shape == CellShape::tetrahedron) {
    tetrahedra_.emplace_back(corners[0], corners[1], corners[2], corners[3]);
    return;
  }
  const std::uint32_t lowest = *std::min_element(corners.begin(), corners.end());
  for_each_triangle(shape, corners, [&](const Triangle& t) {
    if (std::find(t.begin(), t.end(), lowest) == t.end()) tetrahedra_.emplace_back(t[0], t[2], t[1], lowest);
  });
}

}  // namespace tetwarp
