// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. Datasets in VTK files, for fields and meshes: legacy files (.vtk), which are read here, and XML files
// (.vts .vti .vtr .vtu), of which VTK reads the XML and decodes the values. VTK's own dataset readers allocate what a
// header asks for; here every count is compared with the file first.
#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "deform/core/host_device.h"

namespace tetwarp {

enum class VtkDataset : std::uint8_t { structured_grid, image, rectilinear_grid, unstructured_grid, other };

/// An array of a VtkFile.
struct VtkArray {
  std::string name;
  std::uint64_t components = 1;  ///< 0: text, or of a type that is not read
  std::uint64_t tuples = 0;
  std::size_t id = 0;  ///< the VtkFile's own

  std::uint64_t count() const { return components * tuples; }
};

/// Cells of an unstructured grid. The points of cell n are connectivity[offsets[n]] up to connectivity[offsets[n + 1]].
struct VtkCells {
  std::vector<std::uint8_t> types;  ///< numbers of vtkCellType.h
  std::vector<std::uint64_t> offsets;
  std::vector<std::uint32_t> connectivity;  ///< each a number of a point
};

/// A file whose structure was read; `points`, `coordinates` and those of `point_data` with three components were found
/// to fit into it.
class VtkFile {
 public:
  explicit VtkFile(std::string file_name) : name(std::move(file_name)) {}
  virtual ~VtkFile() = default;
  VtkFile(const VtkFile&) = delete;
  VtkFile& operator=(const VtkFile&) = delete;

  std::string name;    ///< for errors
  std::string format;  ///< "VTK StructuredGrid", "legacy VTK STRUCTURED_GRID"
  VtkDataset dataset = VtkDataset::other;
  std::optional<std::string> frame;     ///< LPS or RAS, where 3D Slicer wrote it into the title of a legacy file
  glm::i64vec3 begin{0}, size{0};       ///< index of the first point, and points along i, j, k; of all but meshes
  glm::dvec3 origin{0}, spacing{1};     ///< of an image, at index (0, 0, 0)
  glm::dmat3 direction{1};              ///< of an image
  std::array<VtkArray, 3> coordinates;  ///< of a rectilinear grid
  VtkArray points;                      ///< of a structured grid or a mesh
  std::vector<VtkArray> point_data;     ///< one tuple a point
  std::vector<VtkArray> field_data;     ///< of the dataset as a whole; whoever reads one finds out whether it fits

  /// Some of an array's values as they lie in the file, from number `first` on; they need not be finite.
  /// @throws InputError for a file that is truncated or damaged
  virtual void read(const VtkArray& array, std::uint64_t first, std::span<double> values) const = 0;
  /// All values, in parts of whole tuples. @param take  gets the number of the part's first tuple
  void read_all(const VtkArray& array,
                const std::function<void(std::uint64_t tuple, std::span<const double> values)>& take) const;
  /// All values of an array of which nothing was found out yet. @throws InputError where the file cannot hold it
  std::vector<double> values_of(const VtkArray& array) const;
  /// Of a mesh. @throws InputError as `read`, for offsets that go back and for corners that are no point
  VtkCells cells() const;

 protected:
  /// @throws InputError unless the file can hold the array
  virtual void require_holds(const VtkArray& array) const = 0;

  enum class Offsets : std::uint8_t {
    ends,    ///< of each cell, in `offsets_`
    bounds,  ///< one more than cells, in `offsets_`
    lengths  ///< in `connectivity_`, each before the points of its cell
  };
  Offsets offset_kind_ = Offsets::ends;
  VtkArray types_, offsets_;
  VtkArray connectivity_;  ///< of unknown length (0 tuples) where offsets are `ends`

 private:
  template <class Number>
  std::vector<Number> whole_numbers(const VtkArray& array, double limit, const char* what) const;
  void take_lengths(const std::vector<std::uint32_t>& list, VtkCells& cells) const;
};

/// "StructuredGrid", "STRUCTURED_GRID": as XML and legacy files call it.
VtkDataset vtk_dataset_called(const std::string& word);
/// What a file says it holds, by a quick look: the suffix of an XML file, the DATASET of a legacy file.
VtkDataset vtk_dataset(const std::filesystem::path& path);
/// .vtk .vts .vti .vtr .vtu
bool has_vtk_suffix(const std::filesystem::path& path);

/// @throws InputError; NotCompiled for an XML file in a build without VTK
std::unique_ptr<VtkFile> open_vtk_file(const std::filesystem::path& path);

/// Points of a grid. @throws InputError for none and for more than any file has
std::uint64_t vtk_point_count(const glm::i64vec3& size, const std::string& name);

std::unique_ptr<VtkFile> open_vtk_legacy(const std::filesystem::path& path);
std::unique_ptr<VtkFile> open_vtk_xml(const std::filesystem::path& path);

}  // namespace tetwarp
