// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. Datasets in VTK files, for fields and meshes: legacy files (.vtk), which are read here, and XML files
// (.vts .vti .vtr .vtu), whose XML is read and whose values are decoded by VTK. VTK's own dataset readers allocate
// whatever a header states; here every count is compared with the file first.
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
  std::size_t id = 0;  ///< used by the VtkFile alone

  std::uint64_t count() const { return components * tuples; }
};

/// Cells of an unstructured grid. The points of cell n are connectivity[offsets[n]] up to, but without,
/// connectivity[offsets[n + 1]].
struct VtkCells {
  std::vector<std::uint8_t> types;  ///< numbers of vtkCellType.h
  std::vector<std::uint64_t> offsets;
  std::vector<std::uint32_t> connectivity;  ///< numbers of points
};

/// A VTK file whose structure was read. The file is long enough for `points`, `coordinates` and the arrays of
/// `point_data` with three components.
class VtkFile {
 public:
  explicit VtkFile(std::string file_name) : name(std::move(file_name)) {}
  virtual ~VtkFile() = default;
  VtkFile(const VtkFile&) = delete;
  VtkFile& operator=(const VtkFile&) = delete;

  std::string name;    ///< for messages
  std::string format;  ///< "VTK StructuredGrid", "legacy VTK STRUCTURED_GRID"
  VtkDataset dataset = VtkDataset::other;
  std::optional<std::string> frame;  ///< LPS or RAS, where 3D Slicer wrote it into the title of a legacy file
  /// Index of the first point, and number of points along i, j, k; not used for meshes.
  glm::i64vec3 begin{0}, size{0};
  glm::dvec3 origin{0}, spacing{1};     ///< of an image: at index (0, 0, 0)
  glm::dmat3 direction{1};              ///< of an image
  std::array<VtkArray, 3> coordinates;  ///< of a rectilinear grid
  VtkArray points;                      ///< of a structured grid or a mesh
  std::vector<VtkArray> point_data;     ///< arrays with one tuple for each point
  /// Arrays of the dataset as a whole; that the file holds their values is checked only when one is read.
  std::vector<VtkArray> field_data;

  /// Reads some values of an array as they are in the file, from value number `first` on. They need not be finite.
  /// @throws InputError for a file that is truncated or damaged
  virtual void read(const VtkArray& array, std::uint64_t first, std::span<double> values) const = 0;
  /// Reads all values of an array, in parts of whole tuples. @param take  called with each part and the number of its
  /// first tuple
  void read_all(const VtkArray& array,
                const std::function<void(std::uint64_t tuple, std::span<const double> values)>& take) const;
  /// Reads all values of an array, after a check that the file can hold them. @throws InputError where it cannot
  std::vector<double> values_of(const VtkArray& array) const;
  /// The cells of a mesh. @throws InputError for a file that is damaged, offsets that go back, and corners that are no
  /// point
  VtkCells cells() const;

 protected:
  /// Checks that the file can hold an array. @throws InputError unless it can
  virtual void require_holds(const VtkArray& array) const = 0;

  enum class Offsets : std::uint8_t {
    ends,    ///< `offsets_` has the end of each cell
    bounds,  ///< `offsets_` has the begin of each cell and the end of the last
    lengths  ///< `connectivity_` has the length of each cell before its points
  };
  Offsets offset_kind_ = Offsets::ends;
  VtkArray types_, offsets_;
  VtkArray connectivity_;  ///< its length is unknown (0 tuples) where offsets are `ends`

 private:
  template <class Number>
  std::vector<Number> whole_numbers(const VtkArray& array, double limit, const char* what) const;
  void take_lengths(const std::vector<std::uint32_t>& list, VtkCells& cells) const;
};

/// The dataset that a word means, as XML files ("StructuredGrid") or legacy files ("STRUCTURED_GRID") call it.
VtkDataset vtk_dataset_called(const std::string& word);
/// What a file says it holds, by a quick look: the suffix of an XML file, the DATASET of a legacy file.
VtkDataset vtk_dataset(const std::filesystem::path& path);
/// Whether a path ends with .vtk, .vts, .vti, .vtr or .vtu.
bool has_vtk_suffix(const std::filesystem::path& path);

/// Opens a file and reads its structure. @throws InputError for a file that is damaged or of another kind; NotCompiled
/// for an XML file in a build without VTK
std::unique_ptr<VtkFile> open_vtk_file(const std::filesystem::path& path);

/// Number of points of a grid. @throws InputError for none, and for more than any file has
std::uint64_t vtk_point_count(const glm::i64vec3& size, const std::string& name);

std::unique_ptr<VtkFile> open_vtk_legacy(const std::filesystem::path& path);
std::unique_ptr<VtkFile> open_vtk_xml(const std::filesystem::path& path);

}  // namespace tetwarp
