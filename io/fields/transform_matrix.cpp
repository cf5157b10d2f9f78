// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/fields/transform_matrix.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>

#include "deform/errors.h"
#include "deform/text/text_number.h"
#include "io/fields/shared/fsl_frame.h"
#include "io/images/image_reader.h"
#include "io/lower_case.h"
#include "io/ras.h"

namespace tetwarp {
namespace {

/// The numbers in a text, of which lines that begin with # are comments. @throws InputError for anything else
std::vector<double> read_numbers(const std::filesystem::path& path) {
  constexpr std::size_t kMost = 16;
  require_readable_file(path);
  std::ifstream stream(path, std::ios::binary);
  std::vector<double> numbers;
  for (std::string line; std::getline(stream, line);) {
    if (line.starts_with('#')) continue;
    constexpr std::string_view kBlank = " \t\r,";
    for (std::size_t at = line.find_first_not_of(kBlank); at != std::string::npos;
         at = line.find_first_not_of(kBlank, at)) {
      const std::size_t end = std::min(line.find_first_of(kBlank, at), line.size());
      const auto value = number_from<double>(std::string_view(line).substr(at, end - at));
      require(value && numbers.size() < kMost, "\"" + line.substr(at, std::min<std::size_t>(end - at, 40)) + "\" in " +
                                                   path.string() + "; expected the 16 numbers of a 4 x 4 matrix");
      numbers.push_back(*value);
      at = end;
    }
  }
  require(numbers.size() == kMost,
          std::to_string(numbers.size()) + " numbers in " + path.string() + "; expected the 16 of a 4 x 4 matrix");
  return numbers;
}

/// Reads the map of a matrix without looking at its frame. @throws InputError as `lps_map_of_ras`
AffineMap map_of(std::span<const double, 16> m, const std::string& file) {
  require(std::ranges::all_of(m, [](double value) { return std::isfinite(value); }),
          "a value that is not finite, " + file);
  require(m[12] == 0 && m[13] == 0 && m[14] == 0 && m[15] == 1,
          "a last row other than 0 0 0 1, " + file + "; expected a 4 x 4 matrix, row by row");
  return map_of_rows(m);
}

/// A program, as the option `tool` names it.
struct Tool {
  const char *key, *name;
};
constexpr std::array<Tool, 5> kTools = {{{"greedy", "Greedy"},
                                         {"c3d", "Convert3D"},
                                         {"niftyreg", "NiftyReg"},
                                         {"mrtrix", "MRtrix"},
                                         {"flirt", "FSL flirt"}}};

const Tool* tool_of(const FieldSource& source) {
  const std::string key = source.option("tool");
  const auto* found = std::find_if(kTools.begin(), kTools.end(), [&](const Tool& tool) { return tool.key == key; });
  return found == kTools.end() ? nullptr : found;
}

bool is_flirt(const Tool& tool) { return std::string_view(tool.key) == "flirt"; }

bool recognizes(const std::filesystem::path& path, std::string_view first_bytes) {
  const std::string suffix = lower(path.extension().string());
  if (suffix != ".mat" && suffix != ".txt") return false;
  if (first_bytes.starts_with("#Insight")) return false;
  if (first_bytes.find('\0') != std::string_view::npos) return false;
  const std::size_t begin = first_bytes.find_first_not_of(" \t\r\n");
  if (begin == std::string_view::npos) return false;
  const char first = first_bytes[begin];
  return first == '#' || first == '-' || first == '+' || first == '.' || (first >= '0' && first <= '9');
}

void check_options(const FieldSource& source) {
  const std::string file = source.path.string();
  for (const auto& [key, value] : source.options) {
    require(key == "tool" || key == "source" || key == "reference",
            "the option \"" + key + "\", " + file + "; expected tool, source, reference or invert");
  }
  const Tool* tool = tool_of(source);
  std::string names;
  for (const Tool& known : kTools) names += (names.empty() ? "" : "|") + std::string(known.key);
  require(tool != nullptr, (source.options.contains("tool") ? "tool=" + source.option("tool") + ", "
                                                            : std::string("a matrix does not say whose it is, ")) +
                               file + "; give " + file + ":tool=" + names);
  const bool has_images = source.options.contains("source") && source.options.contains("reference");
  require(has_images || !is_flirt(*tool), "a matrix of flirt is in voxels of its two images, " + file +
                                              "; give both: " + file + ":tool=flirt,source=MOVING,reference=FIXED");
  require(is_flirt(*tool) || (!source.options.contains("source") && !source.options.contains("reference")),
          "images for a matrix of " + std::string(tool->name) + ", " + file + ", which is in RAS mm; leave them out");
}

/// flirt's matrix leads from the source (moving) image to the reference (fixed), both in FSL's coordinates.
TransformFile read_flirt(const FieldSource& source, const AffineMap& map) {
  const auto geometry = [&](const char* key) {
    return read_image_header(source.option(key), source.nifti_frame).geometry;
  };
  const Geometry moving = geometry("source"), fixed = geometry("reference");
  TransformFile result = affine_transform(lps_from_fsl(fixed) * map * fsl_from_lps(moving));
  result.direction = Direction::forward;
  result.frame = "FSL";
  return result;
}

TransformFile read(const FieldSource& source, const std::stop_token&) {
  const std::vector<double> numbers = read_numbers(source.path);
  const std::span<const double, 16> matrix(numbers.data(), 16);
  const Tool& tool = *tool_of(source);
  const std::string file = source.path.string();
  TransformFile result =
      is_flirt(tool) ? read_flirt(source, map_of(matrix, file)) : affine_transform(lps_map_of_ras(matrix, file));
  if (!is_flirt(tool)) {
    result.direction = Direction::pull;
    result.frame = "RAS";
  }
  result.tool = tool.name;
  result.classes = {"4 x 4 matrix"};
  result.basis = FieldBasis::by_option;
  return result;
}

void add_files(const FieldSource& source, std::vector<std::filesystem::path>& files) {
  for (const char* key : {"source", "reference"}) {
    if (source.options.contains(key)) files.emplace_back(source.option(key));
  }
}

}  // namespace

const TransformFormat kTransformFormat_matrix = {recognizes, nullptr, check_options, read, add_files};

AffineMap lps_map_of_ras(std::span<const double, 16> matrix, const std::string& file) {
  AffineMap map = map_of(matrix, file);
  for (int column = 0; column < 3; ++column) map.linear[column] *= kLpsFromRas * kLpsFromRas[column];
  map.offset = kLpsFromRas * map.offset + 0.0;  // + 0.0 makes 0 of -0
  return map;
}

}  // namespace tetwarp
