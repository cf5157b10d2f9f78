// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/meshes/mesh_frd.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <limits>
#include <optional>

#include "deform/errors.h"
#include "io/lower_case.h"
#include "io/meshes/model_builder.h"

namespace tetwarp {
namespace {

/// An element, by its number in the manual of CalculiX GraphiX ("Result Format").
struct FrdElement {
  std::int64_t type;
  std::size_t nodes;
  std::optional<CellShape> shape;
  const char* name;
};
constexpr std::array kElements = std::to_array<FrdElement>({{1, 8, CellShape::hexahedron, "he8"},
                                                            {2, 6, CellShape::wedge, "pe6"},
                                                            {3, 4, CellShape::tetrahedron, "tet4"},
                                                            {4, 20, CellShape::hexahedron, "he20"},
                                                            {5, 15, CellShape::wedge, "pe15"},
                                                            {6, 10, CellShape::tetrahedron, "tet10"},
                                                            {7, 3, {}, "tr3"},
                                                            {8, 6, {}, "tr6"},
                                                            {9, 4, {}, "qu4"},
                                                            {10, 8, {}, "qu8"},
                                                            {11, 2, {}, "be2"},
                                                            {12, 3, {}, "be3"}});

/// The lines of a file, with their columns.
class Lines {
 public:
  explicit Lines(const std::filesystem::path& path) : file_(path.string()), stream_(path, std::ios::binary) {}

  /// A line of the file: where it begins, and its number.
  struct Place {
    std::streamoff byte = 0;
    std::int64_t number = 0;
  };

  /// The place of the line that `next` read.
  Place place() const { return {byte_, number_}; }
  /// Goes to a line of an earlier `place`, which `next` then reads.
  void go_to(const Place& place) {
    stream_.clear();
    stream_.seekg(place.byte);
    number_ = place.number - 1;
  }

  bool next() {
    ++number_;
    byte_ = stream_.tellg();
    if (!std::getline(stream_, line_)) return false;
    if (line_.ends_with('\r')) line_.pop_back();
    return true;
  }
  /// @throws InputError at the end of the file
  void need() {
    require(next(), "truncated after line " + std::to_string(number_ - 1) + ", " + file_ + "; is the file whole?");
  }

  bool starts_with(std::string_view text) const { return line_.starts_with(text); }
  /// Columns of the line, from 0; what is beyond its end is blank.
  std::string_view columns(std::size_t begin, std::size_t count) const {
    return std::string_view(line_).substr(std::min(begin, line_.size()), count);
  }
  std::size_t size() const { return line_.size(); }
  std::int64_t whole(std::size_t begin, std::size_t count) const { return whole_in(columns(begin, count), here()); }
  double real(std::size_t begin, std::size_t count) const { return real_in(columns(begin, count), here()); }
  std::string here() const { return " in line " + std::to_string(number_) + " of " + file_; }

 private:
  std::string file_, line_;
  std::ifstream stream_;
  std::int64_t number_ = 0;
  std::streamoff byte_ = 0;
};

class FrdReader final : public MeshReader {
 public:
  explicit FrdReader(const std::filesystem::path& path) : MeshReader(path), file_(path.string()), model_(file_) {
    format = "CalculiX result, text";
    Lines lines(path);
    bool has_nodes = false, has_elements = false, ended = false;
    while (!ended && lines.next()) {
      if (lines.starts_with("    2C")) {
        require(!has_nodes, "a second block of nodes" + lines.here());
        has_nodes = true;
        take_nodes(lines);
      } else if (lines.starts_with("    3C")) {
        require(!has_elements, "a second block of elements" + lines.here());
        has_elements = true;
        take_elements(lines);
        model_.build(*this);
      } else if (lines.starts_with("  100C")) {
        take_results(lines);
      } else {
        ended = lines.starts_with(" 9999");
      }
    }
    require(has_nodes && ended, "no end of the results (9999), " + file_ + "; is the file whole?");
  }

  std::vector<glm::dvec3> vectors(std::size_t n) const override {
    const Block& block = blocks_[n];
    Lines lines(file_);
    lines.go_to(block.first);
    std::vector<glm::dvec3> values(points.size(), glm::dvec3(std::numeric_limits<double>::quiet_NaN()));
    for (std::size_t count = 0; count < block.values; ++count) {
      lines.need();
      const std::uint32_t vertex = vertex_numbered(*this, lines.whole(3, block.width), lines.here());
      for (int axis = 0; axis < 3; ++axis)
        values[vertex][axis] = lines.real(3 + block.width + 12 * static_cast<std::size_t>(axis), 12);
    }
    return values;
  }

 private:
  /// The values of a result, a line each.
  struct Block {
    Lines::Place first;
    std::size_t width = 0, values = 0;  ///< width of a node's number
  };

  /// Reads the width of a number of a node: the format behind the header of a block. @throws InputError for binary
  std::size_t width_of(const Lines& lines, std::size_t column) const {
    const std::int64_t form = lines.whole(column, lines.size());
    require(form == 0 || form == 1, "a binary block" + lines.here() + "; write the results in text (*NODE FILE)");
    return form == 0 ? 5 : 10;
  }

  void take_nodes(Lines& lines) {
    const std::size_t width = width_of(lines, 73);
    for (lines.need(); !lines.starts_with(" -3"); lines.need()) {
      glm::dvec3 point;
      for (int axis = 0; axis < 3; ++axis)
        point[axis] = lines.real(3 + width + 12 * static_cast<std::size_t>(axis), 12);
      model_.add_node(lines.whole(3, width), point);
    }
  }

  void take_elements(Lines& lines) {
    const std::size_t width = width_of(lines, 73);
    lines.need();
    while (!lines.starts_with(" -3")) {
      require(lines.starts_with(" -1"), "no element" + lines.here());
      const std::int64_t number = lines.whole(3, width), type = lines.whole(3 + width, 5);
      const auto* element = std::ranges::find(kElements, type, &FrdElement::type);
      require(element != kElements.end(), "an element of the type " + std::to_string(type) + lines.here());
      std::vector<std::int64_t> nodes;
      for (lines.need(); lines.starts_with(" -2"); lines.need()) {
        for (std::size_t column = 3; column + width <= lines.size() && nodes.size() < element->nodes; column += width)
          nodes.push_back(lines.whole(column, width));
      }
      require(nodes.size() == element->nodes, std::to_string(nodes.size()) + " nodes of an element " + element->name +
                                                  " before" + lines.here().substr(3));
      if (!element->shape) {
        model_.leave_out(element->name);
        continue;
      }
      const std::size_t corners = corner_count(*element->shape);
      model_.add_element(number, *element->shape, std::span(nodes).first(corners), element->nodes > corners);
    }
  }

  /// Remembers where a block of results is, if it has vectors.
  void take_results(Lines& lines) {
    const std::int64_t expected = lines.whole(24, 12), step = lines.whole(58, 5);
    const std::size_t width = width_of(lines, 73);
    lines.need();
    require(lines.starts_with(" -4"), "no name of the results" + lines.here());
    std::string name(lines.columns(5, 8));
    name.resize(name.find_last_not_of(' ') + 1);
    std::size_t components = 0;
    for (lines.need(); lines.starts_with(" -5"); lines.need())
      components += lines.columns(33, 5).find('1') == std::string_view::npos ? 1 : 0;  // 1: computed, not in the file
    Block block{lines.place(), width, 0};
    for (; lines.starts_with(" -1") || lines.starts_with(" -2"); lines.need())
      block.values += lines.starts_with(" -1") ? 1 : 0;
    require(lines.starts_with(" -3") && static_cast<std::int64_t>(block.values) == expected, [&] {
      return std::to_string(block.values) + " values of " + name + " before" + lines.here().substr(3) + "; " +
             std::to_string(expected) + " are expected";
    });
    if (components != 3) return;
    arrays.push_back({name, step});
    blocks_.push_back(block);
  }

  std::string file_;
  ModelBuilder model_;
  std::vector<Block> blocks_;  ///< for each of `arrays`
};

bool recognizes(const std::filesystem::path& path, std::string_view) {
  return lower(path.extension().string()) == ".frd";
}

std::unique_ptr<MeshReader> open(const std::filesystem::path& path) { return std::make_unique<FrdReader>(path); }

}  // namespace

const MeshFormat kMeshFormat_frd = {".frd", recognizes, nullptr, open};

}  // namespace tetwarp
