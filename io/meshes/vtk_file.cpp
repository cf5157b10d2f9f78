// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/meshes/vtk_file.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>

#include "deform/errors.h"
#include "io/images/image_reader.h"
#include "io/lower_case.h"
#include "io/meshes/vtk_text.h"
#include "io/opened_file.h"

namespace tetwarp {
namespace {

constexpr std::uint64_t kPart = 1 << 16;  // values that are read at once

std::string suffix_of(const std::filesystem::path& path) { return lower(path.extension().string()); }

VtkDataset legacy_dataset(const std::filesystem::path& path) {
  std::string bytes(4096, '\0');
  std::ifstream stream(path, std::ios::binary);
  stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(stream.gcount()));
  try {
    return vtk_dataset_called(VtkText(bytes, path.string()).dataset);
  } catch (const InputError&) {
    return VtkDataset::other;
  }
}

/// Whether a file of any suffix is a legacy one: SOFA calls its legacy files .vtu.
bool is_legacy(const std::filesystem::path& path) {
  constexpr std::string_view kMark = "# vtk DataFile";
  if (!is_file(path)) return suffix_of(path) == ".vtk";
  std::string first(kMark.size(), '\0');
  std::ifstream(path, std::ios::binary).read(first.data(), static_cast<std::streamsize>(first.size()));
  return suffix_of(path) == ".vtk" || first == kMark;
}

}  // namespace

void VtkFile::read_all(const VtkArray& array,
                       const std::function<void(std::uint64_t, std::span<const double>)>& take) const {
  const std::uint64_t most = std::max<std::uint64_t>(1, kPart / std::max<std::uint64_t>(1, array.components));
  std::vector<double> values;
  for (std::uint64_t tuple = 0; tuple < array.tuples; tuple += most) {
    values.resize(std::min(most, array.tuples - tuple) * array.components);
    read(array, tuple * array.components, values);
    take(tuple, values);
  }
}

std::vector<double> VtkFile::values_of(const VtkArray& array) const {
  require_holds(array);
  std::vector<double> all;
  all.reserve(array.count());
  read_all(array,
           [&](std::uint64_t, std::span<const double> values) { all.insert(all.end(), values.begin(), values.end()); });
  return all;
}

template <class Number>
std::vector<Number> VtkFile::whole_numbers(const VtkArray& array, double limit, const char* what) const {
  require_holds(array);
  std::vector<Number> numbers;
  numbers.reserve(array.count());
  read_all(array, [&](std::uint64_t, std::span<const double> values) {
    for (const double value : values) {
      if (!(value >= 0 && value < limit && value == std::floor(value))) {
        throw InputError(std::string(what) + " " + text_of(value) + " (number " + std::to_string(numbers.size()) +
                         "), " + name + "; expected a whole number from 0 to " +
                         std::to_string(static_cast<std::uint64_t>(limit) - 1));
      }
      numbers.push_back(static_cast<Number>(value));
    }
  });
  return numbers;
}

void VtkFile::take_lengths(const std::vector<std::uint32_t>& list, VtkCells& cells) const {
  cells.offsets.push_back(0);
  cells.connectivity.reserve(list.size());
  std::size_t at = 0;
  while (at < list.size() && cells.offsets.size() <= cells.types.size()) {
    const std::uint64_t length = list[at++];
    require(length <= list.size() - at, "the cell " + std::to_string(cells.offsets.size() - 1) + " has " +
                                            std::to_string(length) + " points, " + std::to_string(list.size() - at) +
                                            " numbers are left, " + name);
    cells.connectivity.insert(cells.connectivity.end(), list.begin() + static_cast<std::ptrdiff_t>(at),
                              list.begin() + static_cast<std::ptrdiff_t>(at + length));
    at += length;
    cells.offsets.push_back(cells.connectivity.size());
  }
  require(at == list.size() && cells.offsets.size() == cells.types.size() + 1,
          std::to_string(cells.types.size()) + " types of cells for a list of others, " + name);
}

VtkCells VtkFile::cells() const {
  VtkCells cells;
  const auto point_limit = static_cast<double>(points.tuples);
  cells.types = whole_numbers<std::uint8_t>(types_, 256, "the type of a cell");
  if (offset_kind_ == Offsets::lengths) {
    // A length may be larger than any number of a point; take_lengths checks the numbers of points.
    take_lengths(whole_numbers<std::uint32_t>(connectivity_, 4294967296.0, "a number in CELLS"), cells);
  } else {
    cells.offsets = whole_numbers<std::uint64_t>(offsets_, 1099511627776.0, "an offset of a cell");
    if (offset_kind_ == Offsets::ends) cells.offsets.insert(cells.offsets.begin(), 0);
    require(cells.offsets.size() == cells.types.size() + 1, std::to_string(cells.types.size()) + " types for " +
                                                                std::to_string(cells.offsets.size() - 1) + " cells, " +
                                                                name);
    const auto back = std::adjacent_find(cells.offsets.begin(), cells.offsets.end(), std::greater<>());
    require(cells.offsets.front() == 0 && back == cells.offsets.end(),
            "offsets of cells that do not begin at 0 or go back, " + name);
    VtkArray list = connectivity_;
    if (offset_kind_ == Offsets::ends) list.tuples = cells.offsets.back();
    require(list.tuples == cells.offsets.back(), "a list of " + std::to_string(list.tuples) +
                                                     " numbers for cells that end at " +
                                                     std::to_string(cells.offsets.back()) + ", " + name);
    cells.connectivity = whole_numbers<std::uint32_t>(list, point_limit, "a cell with the point");
  }
  const auto beyond = std::find_if(cells.connectivity.begin(), cells.connectivity.end(),
                                   [&](std::uint32_t n) { return n >= points.tuples; });
  require(beyond == cells.connectivity.end(), "a cell with the point " +
                                                  std::to_string(beyond == cells.connectivity.end() ? 0 : *beyond) +
                                                  ", " + name + "; the file has " + std::to_string(points.tuples));
  return cells;
}

VtkDataset vtk_dataset_called(const std::string& word) {
  static const std::map<std::string, VtkDataset> kWords = {{"StructuredGrid", VtkDataset::structured_grid},
                                                           {"STRUCTURED_GRID", VtkDataset::structured_grid},
                                                           {"ImageData", VtkDataset::image},
                                                           {"STRUCTURED_POINTS", VtkDataset::image},
                                                           {"RectilinearGrid", VtkDataset::rectilinear_grid},
                                                           {"RECTILINEAR_GRID", VtkDataset::rectilinear_grid},
                                                           {"UnstructuredGrid", VtkDataset::unstructured_grid},
                                                           {"UNSTRUCTURED_GRID", VtkDataset::unstructured_grid}};
  const auto found = kWords.find(word);
  return found == kWords.end() ? VtkDataset::other : found->second;
}

VtkDataset vtk_dataset(const std::filesystem::path& path) {
  static const std::map<std::string, VtkDataset> kSuffixes = {{".vts", VtkDataset::structured_grid},
                                                              {".vti", VtkDataset::image},
                                                              {".vtr", VtkDataset::rectilinear_grid},
                                                              {".vtu", VtkDataset::unstructured_grid}};
  const auto found = kSuffixes.find(suffix_of(path));
  return found == kSuffixes.end() || is_legacy(path) ? legacy_dataset(path) : found->second;
}

bool has_vtk_suffix(const std::filesystem::path& path) {
  const std::string suffix = suffix_of(path);
  return suffix == ".vtk" || suffix == ".vts" || suffix == ".vti" || suffix == ".vtr" || suffix == ".vtu";
}

std::unique_ptr<VtkFile> open_vtk_file(const std::filesystem::path& path) {
  require_readable_file(path);
  return has_vtk_suffix(path) && !is_legacy(path) ? open_vtk_xml(path) : open_vtk_legacy(path);
}

std::uint64_t vtk_point_count(const glm::i64vec3& size, const std::string& name) {
  const double count = static_cast<double>(size.x) * static_cast<double>(size.y) * static_cast<double>(size.z);
  require(size.x > 0 && size.y > 0 && size.z > 0 && count <= 1099511627776.0,
          "a grid of " + to_string(size) + " points, " + name + "; expected at least 1 on every axis, and fewer");
  return static_cast<std::uint64_t>(size.x * size.y * size.z);
}

}  // namespace tetwarp
