// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/meshes/mesh_med.h"

#include <algorithm>
#include <array>
#include <iomanip>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <sstream>

#include "deform/errors.h"
#include "io/lower_case.h"
#ifdef TETWARP_WITH_ITK
#include "io/files/module.h"
#include "io/meshes/model_builder.h"
#include "itkbridge/med_file.h"
#endif

namespace tetwarp {
namespace {

bool recognizes(const std::filesystem::path& path, std::string_view) {
  const std::string suffix = lower(path.extension().string());
  return suffix == ".med" || suffix == ".rmed" || suffix == ".mmed";
}

#ifdef TETWARP_WITH_ITK
/// A type of cells, and in which places of its nodes the corners are, in the order of Abaqus. By MED's order the first
/// face of a cell looks outwards, by that of Abaqus inwards; what Code_Aster changes when it writes MED is the same.
struct MedCell {
  const char* type;
  std::size_t nodes;
  std::optional<CellShape> shape;
  std::array<std::uint8_t, 8> corners{};
};
constexpr std::array<std::uint8_t, 8> kTetrahedron = {0, 2, 1, 3}, kPyramid = {0, 3, 2, 1, 4},
                                      kWedge = {0, 2, 1, 3, 5, 4}, kHexahedron = {0, 3, 2, 1, 4, 7, 6, 5};
constexpr std::array kCells = std::to_array<MedCell>({{"PO1", 1, {}},
                                                      {"SE2", 2, {}},
                                                      {"SE3", 3, {}},
                                                      {"SE4", 4, {}},
                                                      {"TR3", 3, {}},
                                                      {"QU4", 4, {}},
                                                      {"TR6", 6, {}},
                                                      {"TR7", 7, {}},
                                                      {"QU8", 8, {}},
                                                      {"QU9", 9, {}},
                                                      {"TE4", 4, CellShape::tetrahedron, kTetrahedron},
                                                      {"PY5", 5, CellShape::pyramid, kPyramid},
                                                      {"PE6", 6, CellShape::wedge, kWedge},
                                                      {"HE8", 8, CellShape::hexahedron, kHexahedron},
                                                      {"T10", 10, CellShape::tetrahedron, kTetrahedron},
                                                      {"P13", 13, CellShape::pyramid, kPyramid},
                                                      {"P15", 15, CellShape::wedge, kWedge},
                                                      {"P18", 18, CellShape::wedge, kWedge},
                                                      {"H20", 20, CellShape::hexahedron, kHexahedron},
                                                      {"H27", 27, CellShape::hexahedron, kHexahedron},
                                                      {"POG", 0, {}},
                                                      {"PG2", 0, {}}});

std::string text_of(double number) {
  std::ostringstream text;
  text << std::setprecision(16) << number;
  return text.str();
}

/// A function of the module that reads HDF5.
template <class Function>
Function* in_module(const char* name, const std::filesystem::path& path) {
  return function_in_module<Function>(TETWARP_TRANSFORM_MODULE, name, "MED files", path.string());
}

/// The short name of a field of Code_Aster, which calls it by the name of a result, made 8 long by "_", and of the
/// quantity: DEPL of RESU____DEPL.
std::string short_name_of(const std::string& name) {
  constexpr std::size_t kResult = 8;
  if (name.size() <= kResult) return {};
  const std::string quantity = name.substr(kResult);
  const auto fits = [](char c) { return (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_'; };
  return quantity.front() != '_' && std::ranges::all_of(quantity, fits) ? quantity : "";
}

class MedMeshReader final : public MeshReader {
 public:
  explicit MedMeshReader(const std::filesystem::path& path) : MeshReader(path), path_(path), file_(path.string()) {
    MedFile med;
    in_module<decltype(tetwarp_read_med)>("tetwarp_read_med", path)(path, med);
    format = "MED " + std::to_string(med.version[0]) + "." + std::to_string(med.version[1]) + "." +
             std::to_string(med.version[2]) + ", mesh " + med.mesh;
    if (!med.unit.empty()) units = med.unit;
    ModelBuilder model(file_);
    take_nodes(med, model);
    take_cells(med, model);
    model.build(*this);
    take_fields(med);
  }

  std::vector<glm::dvec3> vectors(std::size_t n) const override {
    std::vector<MedVectors> parts;
    in_module<decltype(tetwarp_read_med_vectors)>("tetwarp_read_med_vectors", path_)(path_, fields_[n], parts);
    std::vector<glm::dvec3> result(points.size(), glm::dvec3(std::numeric_limits<double>::quiet_NaN()));
    std::vector<bool> seen(points.size());
    for (const MedVectors& part : parts) {
      const std::size_t count = part.vectors.size() / 3;
      require((part.nodes.empty() ? numbers_.size() : part.nodes.size()) == count,
              "\"" + arrays[n].name + "\" has " + std::to_string(count) + " vectors of other nodes, " + file_);
      for (std::size_t v = 0; v < count; ++v) {
        const std::size_t node = part.nodes.empty() ? v : place_of(part.nodes[v], "a profile");
        const std::uint32_t vertex = vertex_numbered(*this, numbers_[node], " in " + file_);
        require(!seen[vertex], [&] {
          return "\"" + arrays[n].name + "\" has the node " + std::to_string(numbers_[node]) + " twice, " + file_;
        });
        seen[vertex] = true;
        result[vertex] = glm::dvec3(part.vectors[v], part.vectors[count + v], part.vectors[2 * count + v]);
      }
    }
    return result;
  }

 private:
  /// The place of a node among all, which MED counts from 1. @param what  names it: "a cell TE4"
  std::size_t place_of(double node, const std::string& what) const {
    require(node >= 1 && node <= static_cast<double>(numbers_.size()), [&] {
      return "the node " + text_of(node) + " of " + what + ", " + file_ + "; there are " +
             std::to_string(numbers_.size());
    });
    return static_cast<std::size_t>(node) - 1;
  }

  void take_nodes(const MedFile& med, ModelBuilder& model) {
    const std::size_t count = med.coordinates.size() / 3;
    require(med.numbers.empty() || med.numbers.size() == count,
            std::to_string(med.numbers.size()) + " numbers of " + std::to_string(count) + " nodes, " + file_);
    for (std::size_t node = 0; node < count; ++node) {
      const double number = med.numbers.empty() ? static_cast<double>(node + 1) : med.numbers[node];
      constexpr double kMost = 1e15;
      require(number >= 1 && number <= kMost,
              [&] { return "the node " + text_of(number) + ", " + file_ + "; expected numbers from 1"; });
      numbers_.push_back(static_cast<std::int64_t>(number));
      model.add_node(numbers_.back(),
                     {med.coordinates[node], med.coordinates[count + node], med.coordinates[2 * count + node]});
    }
  }

  /// Takes the cells in MED's order of types, and counts them so from 1.
  void take_cells(const MedFile& med, ModelBuilder& model) const {
    for (const MedFile::Cells& list : med.cells) {
      require(list.type != "POE", "polyhedra, " + file_ + "; divide them into tetrahedra or hexahedra");
      require(std::ranges::any_of(kCells, [&](const MedCell& cell) { return cell.type == list.type; }),
              "cells of the type " + list.type.substr(0, 60) + ", " + file_);
    }
    std::int64_t number = 0;
    for (const MedCell& type : kCells) {
      for (const MedFile::Cells& list : med.cells) {
        if (list.type != type.type) continue;
        require(
            type.nodes == 0 || (list.nodes.size() % type.nodes == 0 && list.nodes.size() / type.nodes == list.count),
            std::to_string(list.nodes.size()) + " nodes of " + std::to_string(list.count) + " cells " + list.type +
                ", " + file_);
        if (!type.shape) model.leave_out(type.type, list.count);
        for (std::size_t cell = 0; type.shape && cell < list.count; ++cell)
          take_cell(list, cell, type, ++number, model);
      }
    }
  }

  void take_cell(const MedFile::Cells& list, std::size_t cell, const MedCell& type, std::int64_t number,
                 ModelBuilder& model) const {
    std::array<std::int64_t, 8> corners{};
    const std::size_t count = corner_count(*type.shape);
    for (std::size_t n = 0; n < count; ++n) {
      const double node = list.nodes[type.corners[n] * list.count + cell];
      corners[n] = numbers_[place_of(node, std::string("a cell ") + type.type)];
    }
    model.add_element(number, *type.shape, std::span(corners).first(count), type.nodes > count);
  }

  /// Lists the steps of the fields. Of several iterations of a step the last is taken.
  void take_fields(const MedFile& med) {
    std::map<std::string, std::map<std::int64_t, std::size_t>> known;  // by name and step: the place in `arrays`
    std::vector<std::int64_t> iterations;
    std::set<std::string> iterated;
    for (std::size_t n = 0; n < med.fields.size(); ++n) {
      const MedFile::Field& field = med.fields[n];
      auto& steps = known[field.name];
      if (steps.empty() && field.components > 3)
        notes.push_back("of the " + std::to_string(field.components) + " components of \"" + field.name +
                        "\" DX, DY and DZ are taken");
      const auto [found, added] = steps.emplace(field.step, arrays.size());
      if (added) {
        arrays.push_back(
            {field.name, field.step < 0 ? std::nullopt : std::optional(field.step), short_name_of(field.name)});
        fields_.push_back(n);
        iterations.push_back(field.iteration);
        continue;
      }
      if (iterated.insert(field.name).second)
        notes.push_back("of the iterations of a step of \"" + field.name + "\" the last is taken");
      if (field.iteration <= iterations[found->second]) continue;
      fields_[found->second] = n;
      iterations[found->second] = field.iteration;
    }
  }

  std::filesystem::path path_;
  std::string file_;
  std::vector<std::int64_t> numbers_;  ///< of the nodes, in the order of the file
  std::vector<std::uint64_t> fields_;  ///< for each of `arrays`, its number in the file
};

std::unique_ptr<MeshReader> open(const std::filesystem::path& path) { return std::make_unique<MedMeshReader>(path); }
#else
std::unique_ptr<MeshReader> open(const std::filesystem::path& path) {
  throw NotCompiled("MED files need ITK, whose HDF5 reads them, and this is built without ITK, " + path.string() +
                    "; build it with TETWARP_WITH_ITK=ON, or write another format (.vtk)");
}
#endif

}  // namespace

const MeshFormat kMeshFormat_med = {".med .rmed .mmed", recognizes, nullptr, open};

}  // namespace tetwarp
