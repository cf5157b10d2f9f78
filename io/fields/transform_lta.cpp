// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/fields/transform_lta.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <glm/matrix.hpp>
#include <optional>
#include <sstream>

#include "deform/errors.h"
#include "deform/text/text_number.h"
#include "io/fields/transform_matrix.h"
#include "io/images/image_reader.h"
#include "io/lower_case.h"

namespace tetwarp {
namespace {

/// The lines of a file without comments, one after the other.
class Lines {
 public:
  explicit Lines(const std::filesystem::path& path) : file_(path.string()) {
    require_readable_file(path);
    stream_.open(path, std::ios::binary);
  }

  /// The next line that has text. @throws InputError at the end of the file
  std::string next() {
    for (std::string line; std::getline(stream_, line);) {
      ++number_;
      line.resize(std::min(line.find_first_of("#\r"), line.size()));
      if (line.find_first_not_of(" \t") != std::string::npos) return line;
    }
    throw InputError("truncated after line " + std::to_string(number_) + ", " + file_ + "; is the file whole?");
  }

  /// The values of the next line, `KEY = VALUES`. @throws InputError for another key, or other than `count` numbers
  std::vector<double> values(const std::string& key, std::size_t count) {
    const std::string line = next();
    const std::size_t equals = line.find('=');
    const std::string found = equals == std::string::npos ? line : line.substr(0, equals);
    require(equals != std::string::npos && words(found) == std::vector<std::string>{key},
            "\"" + found.substr(0, 40) + "\"" + here() + "; expected " + key);
    return numbers(line.substr(equals + 1), count);
  }

  /// @throws InputError unless the text has `count` numbers and nothing else
  std::vector<double> numbers(const std::string& text, std::size_t count) const {
    std::vector<double> numbers;
    for (const std::string& word : words(text)) {
      const auto value = number_from<double>(word);
      require(value && std::isfinite(*value), "\"" + word.substr(0, 40) + "\"" + here() + "; expected a finite number");
      numbers.push_back(*value);
    }
    require(numbers.size() == count,
            std::to_string(numbers.size()) + " numbers" + here() + "; expected " + std::to_string(count));
    return numbers;
  }

  void expect(const std::string& text) {
    const std::string line = next();
    require(words(line) == words(text), "\"" + line.substr(0, 40) + "\"" + here() + "; expected \"" + text + "\"");
  }

  std::string here() const { return " in line " + std::to_string(number_) + " of " + file_; }

 private:
  static std::vector<std::string> words(const std::string& text) {
    std::vector<std::string> words;
    std::istringstream stream(text);
    for (std::string word; stream >> word;) words.push_back(word);
    return words;
  }

  std::string file_;
  std::ifstream stream_;
  std::int64_t number_ = 0;
};

/// The map from voxel index to RAS mm of a volume, whose centre is at index size / 2.
/// @return none where the file says that the place is not valid
std::optional<AffineMap> read_volume(Lines& lines, const std::string& which) {
  lines.expect(which + " volume info");
  const bool valid = lines.values("valid", 1)[0] == 1;
  lines.next();  // file name
  const std::vector<double> size = lines.values("volume", 3), spacing = lines.values("voxelsize", 3);
  AffineMap map;
  glm::dvec3 centre;
  const std::array<const char*, 4> keys = {"xras", "yras", "zras", "cras"};
  for (int column = 0; column < 4; ++column) {
    const std::vector<double> v = lines.values(keys[static_cast<std::size_t>(column)], 3);
    if (column == 3)
      centre = {v[0], v[1], v[2]};
    else
      map.linear[column] = glm::dvec3(v[0], v[1], v[2]) * spacing[static_cast<std::size_t>(column)];
  }
  if (!valid) return std::nullopt;
  require(std::abs(glm::determinant(map.linear)) > 1e-12,
          "the axes of the " + which + " volume have no inverse" + lines.here());
  map.offset = centre - map.linear * (glm::dvec3(size[0], size[1], size[2]) / 2.0);
  return map;
}

bool recognizes(const std::filesystem::path& path, std::string_view) {
  return lower(path.extension().string()) == ".lta";
}

TransformFile read(const FieldSource& source, const std::stop_token&) {
  constexpr double kVoxels = 0, kRas = 1;
  const std::string file = source.path.string();
  Lines lines(source.path);
  const double type = lines.values("type", 1)[0];
  require(type == kVoxels || type == kRas, "a transform of the type " + std::to_string(type) + lines.here() +
                                               "; expected 0 (voxels) or 1 (RAS): convert it with lta_convert");
  const double count = lines.values("nxforms", 1)[0];
  require(count == 1, "nxforms " + std::to_string(count) + lines.here() + "; expected one transform");
  lines.values("mean", 3);
  lines.values("sigma", 1);
  lines.expect("1 4 4");
  std::array<double, 16> matrix{};
  for (std::size_t row = 0; row < 4; ++row) {
    const std::vector<double> values = lines.numbers(lines.next(), 4);
    std::copy(values.begin(), values.end(), matrix.begin() + static_cast<std::ptrdiff_t>(4 * row));
  }
  const std::optional<AffineMap> from = read_volume(lines, "src"), to = read_volume(lines, "dst");
  AffineMap map = lps_map_of_ras(matrix, file);
  if (type == kVoxels) {
    require(from && to, "a matrix between voxels, but the place of a volume is not valid, " + file);
    // The matrix was taken for one between RAS and turned to LPS; the same turn takes the volumes' maps along.
    const AffineMap turn{glm::dmat3(-1, 0, 0, 0, -1, 0, 0, 0, 1), glm::dvec3(0)};
    map = turn * *to * turn * map * turn * inverse_of(*from) * turn;
  }
  TransformFile result = affine_transform(map);
  result.tool = "FreeSurfer";
  result.classes = {type == kVoxels ? "linear, voxel to voxel" : "linear, RAS to RAS"};
  result.direction = Direction::forward;
  result.frame = type == kVoxels ? "index" : "RAS";
  return result;
}

}  // namespace

const TransformFormat kTransformFormat_lta = {recognizes, nullptr, nullptr, read, nullptr};

}  // namespace tetwarp
