// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Reads legacy VTK files, text or big-endian binary, versions 1 to 5.
#include <algorithm>
#include <charconv>
#include <fstream>
#include <iterator>
#include <map>

#include "deform/errors.h"
#include "deform/geometry.h"
#include "deform/text/text_number.h"
#include "io/meshes/slicer_space.h"
#include "io/meshes/vtk_file.h"
#include "io/meshes/vtk_text.h"
#include "io/points/points_document.h"

namespace tetwarp {
namespace {

std::string read_whole(const std::filesystem::path& path) {
  std::string bytes(std::filesystem::file_size(path), '\0');
  std::ifstream stream(path, std::ios::binary);
  stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  require(stream.good(), "cannot be read to its end, " + path.string());
  return bytes;
}

/// A name of an array as it is meant: "my array" for "my%20array".
std::string decoded(std::string_view text) {
  std::string result;
  for (std::size_t n = 0; n < text.size(); ++n) {
    unsigned char code = 0;
    if (text[n] == '%' && n + 2 < text.size() &&
        std::from_chars(text.data() + n + 1, text.data() + n + 3, code, 16).ptr == text.data() + n + 3) {
      result += static_cast<char>(code);
      n += 2;
    } else {
      result += text[n];
    }
  }
  return result;
}

double number_in(std::string_view word, const std::string& where) {
  const auto value = number_from<double>(word);
  require(value.has_value(), "\"" + std::string(word.substr(0, 32)) + "\" where a number is expected" + where);
  return *value;
}

class LegacyFile final : public VtkFile {
 public:
  explicit LegacyFile(const std::filesystem::path& path)
      : VtkFile(path.string()), bytes_(read_whole(path)), text_(bytes_, name) {
    format = "legacy VTK " + text_.dataset;
    dataset = vtk_dataset_called(text_.dataset);
    require(dataset != VtkDataset::other, "DATASET " + text_.dataset.substr(0, 32) + ", " + name +
                                              "; expected STRUCTURED_GRID, STRUCTURED_POINTS, RECTILINEAR_GRID or "
                                              "UNSTRUCTURED_GRID");
    take_frame();
    while (text_.skip_blanks()) take_part();
    require_complete();
  }

  void read(const VtkArray& array, std::uint64_t first, std::span<double> values) const override {
    const VtkValues& lies = values_[array.id];
    const std::string where = at_byte(lies.span.begin, name);
    require(first + values.size() <= lies.count,
            std::to_string(lies.count) + " values" + where + "; expected " + std::to_string(first + values.size()));
    if (text_.binary) {
      const VtkDecoder decode = big_endian_decoder(lies.type, where);
      const std::size_t step = value_bytes(lies.type, where);
      for (std::size_t n = 0; n < values.size(); ++n)
        values[n] = decode(bytes_.data() + lies.span.begin + (first + n) * step);
      return;
    }
    if (next_word_.id != array.id || next_word_.next > first) next_word_ = {array.id, 0, lies.span.begin};
    for (; next_word_.next < first; ++next_word_.next) next_word();
    for (double& value : values) {
      value = number_in(next_word(), where);
      ++next_word_.next;
    }
  }

 protected:
  void require_holds(const VtkArray&) const override {}  // the constructor has checked all arrays

 private:
  void take_frame() {
    if (const auto said = slicer_space(text_.title, name)) frame = to_string(*said);
  }

  void take_part() {
    const std::string where = text_.here();
    const auto words = text_.words();
    const std::string keyword = upper(words[0]);
    const auto word = [&](std::size_t n) { return word_of(words, n, where); };
    const auto count = [&](std::size_t n) { return count_of(word(n), where); };
    const auto number = [&](std::size_t n) { return number_in(word(n), where); };
    if (keyword == "DIMENSIONS") {
      size = glm::i64vec3(count(1), count(2), count(3));
    } else if (keyword == "EXTENT") {
      take_extent(words, where);
    } else if (keyword == "ORIGIN") {
      origin = {number(1), number(2), number(3)};
    } else if (keyword == "SPACING" || keyword == "ASPECT_RATIO") {
      spacing = {number(1), number(2), number(3)};
    } else if (keyword == "X_COORDINATES" || keyword == "Y_COORDINATES" || keyword == "Z_COORDINATES") {
      const auto axis = static_cast<std::size_t>(keyword[0] - 'X');
      coordinates[axis] = added(keyword, 1, count(1), text_.skip_values(count(1), word(2), where));
    } else if (keyword == "POINTS") {
      require(points.tuples == 0, "POINTS twice" + where);
      points = added(keyword, 3, count(1), text_.skip_values(3 * count(1), word(2), where));
    } else if (keyword == "CELLS") {
      take_cells(count(1), count(2), where);
    } else if (keyword == "CELL_TYPES") {
      types_ = added(keyword, 1, count(1), text_.skip_values(count(1), "int", where));
    } else if (keyword == "METADATA") {
      text_.skip_metadata();
    } else if (keyword == "POINT_DATA" || keyword == "CELL_DATA") {
      at_ = keyword == "POINT_DATA" ? At::points : At::cells;
      tuples_ = count(1);
      require(at_ == At::cells || tuples_ == expected_points(), "data of " + std::to_string(tuples_) + " points" +
                                                                    where + "; the file has " +
                                                                    std::to_string(expected_points()));
    } else if (keyword == "FIELD") {
      take_arrays(text_.skip_field(count(2)), where);
    } else {
      require(at_ != At::dataset,
              "\"" + keyword.substr(0, 32) + "\"" + where + "; expected a part of a dataset of this kind");
      take_arrays(text_.skip_data(words, tuples_, where), where);
    }
  }

  void take_extent(const std::vector<std::string_view>& words, const std::string& where) {
    for (int axis = 0; axis < 3; ++axis) {
      const double low = number_in(word_of(words, static_cast<std::size_t>(2 * axis + 1), where), where);
      const double high = number_in(word_of(words, static_cast<std::size_t>(2 * axis + 2), where), where);
      require(std::abs(low) < 1e9 && std::abs(high) < 1e9, "an extent beyond all measure" + where);
      begin[axis] = static_cast<std::int64_t>(low);
      size[axis] = static_cast<std::int64_t>(high) - begin[axis] + 1;
    }
  }

  std::uint64_t expected_points() const {
    return dataset == VtkDataset::unstructured_grid ? points.tuples : vtk_point_count(size, name);
  }

  void take_cells(std::uint64_t first, std::uint64_t second, const std::string& where) {
    require(connectivity_.tuples == 0, "CELLS twice" + where);
    const std::vector<VtkValues> lists = text_.skip_cells(first, second, where);
    offset_kind_ = lists.size() == 1 ? Offsets::lengths : Offsets::bounds;
    if (lists.size() > 1) offsets_ = added("OFFSETS", 1, first, lists[0]);
    connectivity_ = added("CELLS", 1, second, lists.back());
  }

  void take_arrays(const std::vector<VtkTextArray>& arrays, const std::string& where) {
    for (const VtkTextArray& array : arrays) {
      if (at_ == At::cells) continue;
      if (at_ == At::dataset) {
        const bool is_text = array.values.type == "BIT" || array.values.type == "STRING";
        field_data.push_back(added(decoded(array.name), is_text ? 0 : array.components, array.tuples, array.values));
        continue;
      }
      require(array.tuples == tuples_, std::to_string(array.tuples) + " tuples of \"" + decoded(array.name) +
                                           "\" for " + std::to_string(tuples_) + " points" + where);
      const bool is_bits = array.values.type == "BIT";
      point_data.push_back(added(decoded(array.name), is_bits ? 0 : array.components, array.tuples, array.values));
    }
  }

  VtkArray added(std::string title, std::uint64_t components, std::uint64_t tuples, const VtkValues& values) {
    values_.push_back(values);
    return {std::move(title), components, tuples, values_.size() - 1};
  }

  void require_complete() const {
    const auto need = [&](const VtkArray& array, std::uint64_t tuples, const char* what) {
      require(array.tuples > 0, std::string("no ") + what + ", " + name + "; is the file whole?");
      require(array.tuples == tuples, std::to_string(array.tuples) + " values of " + what + ", " + name +
                                          "; expected " + std::to_string(tuples));
    };
    if (dataset == VtkDataset::unstructured_grid) {
      need(points, points.tuples, "POINTS");
      need(connectivity_, connectivity_.tuples, "CELLS");
      need(types_, types_.tuples, "CELL_TYPES");
      return;
    }
    const std::uint64_t count = vtk_point_count(size, name);
    if (dataset == VtkDataset::structured_grid) need(points, count, "POINTS");
    if (dataset != VtkDataset::rectilinear_grid) return;
    for (int axis = 0; axis < 3; ++axis)
      need(coordinates[static_cast<std::size_t>(axis)], static_cast<std::uint64_t>(size[axis]), "coordinates");
  }

  std::string_view next_word() const {
    const std::string_view all = bytes_;
    const std::size_t begin_at = std::min(all.find_first_not_of(" \t\r\n", next_word_.byte), all.size());
    next_word_.byte = std::min(all.find_first_of(" \t\r\n", begin_at), all.size());
    return all.substr(begin_at, next_word_.byte - begin_at);
  }

  /// The place of the next word of a text array, so that reading on need not search from its beginning.
  struct NextWord {
    std::size_t id = SIZE_MAX;
    std::uint64_t next = 0;  ///< number of the value that comes next
    std::size_t byte = 0;
  };

  enum class At : std::uint8_t { dataset, points, cells };
  std::string bytes_;
  VtkText text_;
  At at_ = At::dataset;
  std::uint64_t tuples_ = 0;  ///< number of tuples of the data that follow
  std::vector<VtkValues> values_;
  mutable NextWord next_word_;
};

}  // namespace

std::unique_ptr<VtkFile> open_vtk_legacy(const std::filesystem::path& path) {
  return std::make_unique<LegacyFile>(path);
}

}  // namespace tetwarp
