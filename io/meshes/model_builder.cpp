// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/meshes/model_builder.h"

#include <algorithm>
#include <array>
#include <limits>

#include "deform/errors.h"
#include "deform/text/text_number.h"

namespace tetwarp {
namespace {

std::string_view without_blanks(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t\r");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
}

template <class Number>
Number number_in(std::string_view text, const char* what, const std::string& where) {
  const auto number = number_from<Number>(without_blanks(text));
  require(number.has_value(),
          [&] { return "\"" + std::string(text.substr(0, 40)) + "\"" + where + "; expected " + what; });
  return *number;
}

}  // namespace

double real_in(std::string_view text, const std::string& where) { return number_in<double>(text, "a number", where); }

std::int64_t whole_in(std::string_view text, const std::string& where) {
  return number_in<std::int64_t>(text, "a whole number", where);
}

void ModelBuilder::add_node(std::int64_t number, const glm::dvec3& point) {
  require(number >= 1, "the node " + std::to_string(number) + ", " + file_ + "; expected numbers from 1");
  nodes_.emplace_back(number, point);
}

void ModelBuilder::add_element(std::int64_t number, CellShape shape, std::span<const std::int64_t> nodes, bool curved) {
  require(number >= 1, "the element " + std::to_string(number) + ", " + file_ + "; expected numbers from 1");
  elements_.push_back({number, shape, corners_.size()});
  corners_.insert(corners_.end(), nodes.begin(), nodes.end());
  curved_ += curved ? 1 : 0;
}

void ModelBuilder::build(MeshReader& reader) {
  require(nodes_.size() < std::numeric_limits<std::uint32_t>::max(),
          std::to_string(nodes_.size()) + " nodes, " + file_ + "; expected fewer than 2^32 - 1");
  std::ranges::stable_sort(nodes_, {}, [](const auto& node) { return node.first; });
  const auto twice = std::ranges::adjacent_find(nodes_, {}, [](const auto& node) { return node.first; });
  if (twice != nodes_.end()) throw InputError("the node " + std::to_string(twice->first) + " is there twice, " + file_);
  for (const auto& [number, point] : nodes_) {
    reader.tags.push_back(static_cast<std::uint64_t>(number));
    reader.points.push_back(point);
  }
  std::vector<std::int64_t> numbers;
  for (const Element& element : elements_) {
    numbers.push_back(element.number);
    std::array<std::uint32_t, 8> corners{};
    const std::size_t count = corner_count(element.shape);
    const std::string where = " in the element " + std::to_string(element.number) + " of " + file_;
    for (std::size_t n = 0; n < count; ++n) corners[n] = vertex_numbered(reader, corners_[element.first + n], where);
    if (element.shape == CellShape::wedge) {  // the first triangle of VTK looks outwards
      std::swap(corners[1], corners[2]);
      std::swap(corners[4], corners[5]);
    }
    reader.cells.add(element.shape, std::span(corners).first(count), static_cast<std::uint64_t>(element.number));
  }
  std::ranges::sort(numbers);
  const auto again = std::ranges::adjacent_find(numbers);
  if (again != numbers.end()) throw InputError("the element " + std::to_string(*again) + " is there twice, " + file_);
  if (curved_ > 0)
    reader.notes.push_back(std::to_string(curved_) + " quadratic cells are made linear: only their corners are used");
  for (const auto& [type, count] : left_out_)
    reader.notes.push_back(std::to_string(count) + " elements of the type " + type +
                           " are left out: they have no volume, or are no finite elements");
}

std::uint32_t vertex_numbered(const MeshReader& reader, std::int64_t number, const std::string& where) {
  const auto tag = static_cast<std::uint64_t>(number);
  const auto missing = [&] {
    return InputError("the node " + std::to_string(number) + ", which does not exist," + where);
  };
  if (reader.tags.empty()) {
    if (number < 0 || tag >= reader.points.size()) throw missing();
    return static_cast<std::uint32_t>(tag);
  }
  const auto found = std::ranges::lower_bound(reader.tags, tag);
  if (number < 0 || found == reader.tags.end() || *found != tag) throw missing();
  return static_cast<std::uint32_t>(found - reader.tags.begin());
}

}  // namespace tetwarp
