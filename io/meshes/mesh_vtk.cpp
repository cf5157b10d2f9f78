// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/meshes/mesh_vtk.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "deform/errors.h"
#include "io/meshes/mesh_lattice.h"
#include "io/meshes/vtk_file.h"

namespace tetwarp {
namespace {

/// How cells of a type (vtkCellType.h) are read.
struct CellKind {
  const char* plural;
  /// Empty: cells of this type are no solids and are left out.
  std::optional<CellShape> shape;
  std::size_t points = 0;  ///< how many points a solid has
  bool voxel = false;      ///< corners are numbered along i, j, k, not around each face
};

const std::map<int, CellKind>& kinds() {
  using enum CellShape;
  static const std::map<int, CellKind> kKinds = {{0, {"empty cells", {}}},
                                                 {1, {"vertices", {}}},
                                                 {2, {"poly-vertices", {}}},
                                                 {3, {"lines", {}}},
                                                 {4, {"polylines", {}}},
                                                 {5, {"triangles", {}}},
                                                 {6, {"triangle strips", {}}},
                                                 {7, {"polygons", {}}},
                                                 {8, {"pixels", {}}},
                                                 {9, {"quadrilaterals", {}}},
                                                 {10, {"tetrahedra", tetrahedron, 4}},
                                                 {11, {"voxels", hexahedron, 8, true}},
                                                 {12, {"hexahedra", hexahedron, 8}},
                                                 {13, {"wedges", wedge, 6}},
                                                 {14, {"pyramids", pyramid, 5}},
                                                 {21, {"quadratic edges", {}}},
                                                 {22, {"quadratic triangles", {}}},
                                                 {23, {"quadratic quadrilaterals", {}}},
                                                 {24, {"quadratic tetrahedra", tetrahedron, 10}},
                                                 {25, {"quadratic hexahedra", hexahedron, 20}},
                                                 {26, {"quadratic wedges", wedge, 15}},
                                                 {27, {"quadratic pyramids", pyramid, 13}},
                                                 {28, {"biquadratic quadrilaterals", {}}},
                                                 {29, {"triquadratic hexahedra", hexahedron, 27}},
                                                 {30, {"quadratic-linear quadrilaterals", {}}},
                                                 {31, {"quadratic-linear wedges", wedge, 12}},
                                                 {32, {"biquadratic-quadratic wedges", wedge, 18}},
                                                 {33, {"biquadratic-quadratic hexahedra", hexahedron, 24}},
                                                 {34, {"biquadratic triangles", {}}},
                                                 {35, {"cubic lines", {}}},
                                                 {36, {"quadratic polygons", {}}},
                                                 {37, {"triquadratic pyramids", pyramid, 19}}};
  return kKinds;
}

const CellKind& kind_of(int type, std::uint64_t cell, const std::string& file) {
  const auto found = kinds().find(type);
  if (found != kinds().end()) return found->second;
  throw InputError("the cell " + std::to_string(cell) + " is of VTK's type " + std::to_string(type) +
                   (type == 42 ? " (polyhedron)" : "") + ", " + file +
                   "; expected tetrahedra, hexahedra, voxels, wedges and pyramids, linear or quadratic");
}

class VtkMeshReader final : public MeshReader {
 public:
  explicit VtkMeshReader(const std::filesystem::path& path) : MeshReader(path), file_(open_vtk_file(path)) {
    require(file_->dataset == VtkDataset::unstructured_grid,
            "no mesh (" + file_->format + "), " + file_->name + "; expected an unstructured grid");
    require(file_->points.tuples < UINT32_MAX, std::to_string(file_->points.tuples) + " points, " + file_->name +
                                                   "; expected at most " + std::to_string(UINT32_MAX - 1));
    format = file_->format;
    frame = file_->frame;
    take_cells();
    points = triples(file_->points);
    for (const VtkArray& array : file_->point_data) {
      if (array.components != 3) continue;
      vectors_.push_back(array);
      arrays.push_back({array.name, {}});
    }
    take_lattice();
  }

  std::vector<glm::dvec3> vectors(std::size_t n) const override { return triples(vectors_.at(n)); }

 private:
  std::vector<glm::dvec3> triples(const VtkArray& array) const {
    std::vector<glm::dvec3> result(array.tuples);
    file_->read_all(array, [&](std::uint64_t first, std::span<const double> values) {
      for (std::uint64_t n = 0; n < values.size() / 3; ++n)
        result[first + n] = {values[3 * n], values[3 * n + 1], values[3 * n + 2]};
    });
    return result;
  }

  /// Takes the lattice that a mesh was made of, where `write_mesh_file` wrote it.
  void take_lattice() {
    const auto called = [](const std::vector<VtkArray>& list, const char* title) -> const VtkArray* {
      const auto found =
          std::find_if(list.begin(), list.end(), [&](const VtkArray& array) { return array.name == title; });
      return found == list.end() ? nullptr : &*found;
    };
    const VtkArray* place = called(file_->field_data, kMeshLatticeArray);
    const VtkArray* numbers = called(file_->point_data, kMeshLatticeVertexArray);
    if (!place || !numbers) return;
    require(place->count() == kMeshLatticeNumbers && numbers->components == 1,
            std::string("\"") + kMeshLatticeArray + "\" of " + std::to_string(place->count()) + " numbers, " +
                file_->name + "; expected " + std::to_string(kMeshLatticeNumbers));
    lattice.emplace();
    lattice->geometry = mesh_lattice_of(file_->values_of(*place), file_->name);
    const auto vertices = static_cast<double>(voxel_count(lattice->geometry));
    for (const double number : file_->values_of(*numbers)) {
      require(number >= -1 && number < vertices && number == std::floor(number),
              "vertex " + std::to_string(number) + " of a lattice of " + to_string(lattice->geometry.size) + ", " +
                  file_->name);
      lattice->vertex.push_back(static_cast<std::int64_t>(number));
    }
  }

  void take_cells() {
    const VtkCells all = file_->cells();
    std::map<int, std::uint64_t> left_out, simplified;
    for (std::size_t n = 0; n < all.types.size(); ++n) {
      const int type = all.types[n];
      const CellKind& kind = kind_of(type, n, file_->name);
      if (!kind.shape) {
        ++left_out[type];
        continue;
      }
      const std::size_t length = all.offsets[n + 1] - all.offsets[n];
      require(length == kind.points, "the cell " + std::to_string(n) + " of " + kind.plural + " has " +
                                         std::to_string(length) + " points, " + file_->name + "; expected " +
                                         std::to_string(kind.points));
      std::array<std::uint32_t, 8> corners{};
      const std::size_t count = corner_count(*kind.shape);
      std::copy_n(all.connectivity.begin() + static_cast<std::ptrdiff_t>(all.offsets[n]), count, corners.begin());
      if (kind.voxel) {
        std::swap(corners[2], corners[3]);
        std::swap(corners[6], corners[7]);
      }
      cells.add(*kind.shape, std::span(corners).first(count), n);
      if (length > count) ++simplified[type];
    }
    for (const auto& [type, count] : left_out)
      notes.push_back(std::to_string(count) + " " + kinds().at(type).plural + " are left out");
    for (const auto& [type, count] : simplified)
      notes.push_back(std::to_string(count) + " " + kinds().at(type).plural + " are taken by their corners");
  }

  std::unique_ptr<VtkFile> file_;
  std::vector<VtkArray> vectors_;
};

bool recognizes(const std::filesystem::path& path, std::string_view) {
  return vtk_dataset(path) == VtkDataset::unstructured_grid;
}

std::unique_ptr<MeshReader> open(const std::filesystem::path& path) { return std::make_unique<VtkMeshReader>(path); }

}  // namespace

const MeshFormat kMeshFormat_vtk = {".vtu .vtk", recognizes, nullptr, open};

}  // namespace tetwarp
