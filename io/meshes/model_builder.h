// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. What the formats of Abaqus, CalculiX, FEBio and MED have in common.
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "io/meshes/mesh_format.h"

namespace tetwarp {

/// Nodes and elements of a finite element model, gathered in the order of a file and then brought into that of the
/// node numbers.
class ModelBuilder {
 public:
  explicit ModelBuilder(std::string file) : file_(std::move(file)) {}

  void add_node(std::int64_t number, const glm::dvec3& point);
  /// @param nodes   numbers of the corners in the order of Abaqus, whose first triangle of a wedge looks inwards
  /// @param curved  whether the element has further nodes, which are left out
  void add_element(std::int64_t number, CellShape shape, std::span<const std::int64_t> nodes, bool curved);
  /// Counts elements without a volume.
  void leave_out(const std::string& type, std::uint64_t count = 1) { left_out_[type] += count; }

  /// Puts all of it into a reader. @throws InputError for a node or an element that is there twice, a number below 1,
  /// or a node of an element that does not exist
  void build(MeshReader& reader);

 private:
  struct Element {
    std::int64_t number;
    CellShape shape;
    std::size_t first;  ///< of its corners, in `corners_`
  };

  std::string file_;
  std::vector<std::pair<std::int64_t, glm::dvec3>> nodes_;
  std::vector<Element> elements_;
  std::vector<std::int64_t> corners_;
  std::uint64_t curved_ = 0;
  std::map<std::string, std::uint64_t> left_out_;
};

/// The vertex with a number of the file. @param where  what names it, for the message: " in line 3 of FILE"
/// @throws InputError for a number that no vertex has
std::uint32_t vertex_numbered(const MeshReader& reader, std::int64_t number, const std::string& where);

/// The number in a text, with blanks around it. @throws InputError for anything else
/// @param where  for the message: " in line 3 of FILE"
double real_in(std::string_view text, const std::string& where);
std::int64_t whole_in(std::string_view text, const std::string& where);

}  // namespace tetwarp
