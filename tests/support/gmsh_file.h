// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <sstream>
#include <string>
#include <vector>

#include "deform/vertex_field.h"

/// How a Gmsh file writes its numbers.
struct GmshStyle {
  std::string version;  ///< 2.2, 4.0 or 4.1
  bool binary = false, big_endian = false;
  int size_bytes = 8;

  std::string name() const {
    return version +
           (!binary      ? " text"
            : big_endian ? " big-endian"
                         : " little-endian") +
           (size_bytes == 4 ? ", sizes of 4 bytes" : "");
  }
};

inline std::vector<GmshStyle> gmsh_styles() {
  std::vector<GmshStyle> styles;
  for (const char* version : {"2.2", "4.0", "4.1"})
    for (const GmshStyle& style : {GmshStyle{version}, GmshStyle{version, true}, GmshStyle{version, true, true}})
      styles.push_back(style);
  styles.push_back({"4.1", true, false, 4});
  return styles;
}

/// Writes numbers of a Gmsh file one after the other.
class GmshBytes {
 public:
  explicit GmshBytes(GmshStyle style) : style_(std::move(style)) {}

  GmshBytes& text(const std::string& text) { return bytes_ += text, *this; }
  GmshBytes& integer(std::int32_t value) { return number(value); }
  GmshBytes& real(double value) { return number(value); }
  GmshBytes& size(std::uint64_t value) {
    return style_.size_bytes == 4 && style_.binary ? number(static_cast<std::uint32_t>(value)) : number(value);
  }
  /// Appends the tag of a node or an element.
  GmshBytes& tag(std::uint64_t value) {
    return style_.version == "4.1" ? size(value) : integer(static_cast<std::int32_t>(value));
  }
  GmshBytes& end_line() { return style_.binary ? *this : text("\n"); }
  const std::string& bytes() const { return bytes_; }

 private:
  template <class Number>
  GmshBytes& number(Number value) {
    if (!style_.binary) {
      std::ostringstream digits;
      digits.precision(17);
      digits << value << ' ';
      return text(digits.str());
    }
    auto raw = std::bit_cast<std::array<char, sizeof(Number)>>(value);
    if (style_.big_endian) std::reverse(raw.begin(), raw.end());
    bytes_.append(raw.data(), raw.size());
    return *this;
  }

  GmshStyle style_;
  std::string bytes_;
};

/// A mesh of two tetrahedra and a triangle at the nodes 20, 3, 7, 11, 1000, in this order. The first two nodes lie on a
/// surface with parametric coordinates. The displacement U of node 20 is (3, 5, 7), all others are at rest. Node 5 is
/// used by the triangle alone.
struct GmshSample {
  std::vector<std::uint64_t> tags = {20, 3, 7, 11, 1000, 5};
  std::vector<glm::dvec3> points = {{8, 0, 0}, {0, 0, 0}, {0, 6, 0}, {0, 0, 5}, {8, 6, 5}, {0.1, 1, 2}};
  std::vector<glm::dvec3> displacement = {{3, 5, 7}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  std::vector<std::vector<std::uint64_t>> tetrahedra = {{3, 20, 7, 11}, {20, 7, 11, 1000}};

  std::string write(const GmshStyle& style) const {
    GmshBytes out(style);
    out.text("$MeshFormat\n" + style.version + (style.binary ? " 1 " : " 0 ") + std::to_string(style.size_bytes) +
             "\n");
    if (style.binary) out.integer(1).text("\n");
    out.text("$EndMeshFormat\n$PhysicalNames\n1\n3 1 \"all\"\n$EndPhysicalNames\n$Nodes\n");
    write_nodes(style, out);
    out.text("\n$EndNodes\n$Elements\n");
    write_elements(style, out);
    out.text("\n$EndElements\n$NodeData\n1\n\"U\"\n1\n0.5\n3\n0\n3\n" + std::to_string(tags.size()) + "\n");
    for (std::size_t n = 0; n < tags.size(); ++n) {
      out.integer(static_cast<std::int32_t>(tags[n]));
      for (int axis = 0; axis < 3; ++axis) out.real(displacement[n][axis]);
      out.end_line();
    }
    return out.text("\n$EndNodeData\n").bytes();
  }

 private:
  static void entity(const GmshStyle& style, GmshBytes& out, int dimension, int tag) {
    style.version == "4.1" ? out.integer(dimension).integer(tag) : out.integer(tag).integer(dimension);
  }

  void point(std::size_t n, GmshBytes& out) const {
    for (int axis = 0; axis < 3; ++axis) out.real(points[n][axis]);
  }

  void write_nodes(const GmshStyle& style, GmshBytes& out) const {
    if (style.version == "2.2") {
      out.text(std::to_string(tags.size()) + "\n");
      for (std::size_t n = 0; n < tags.size(); ++n) {
        out.tag(tags[n]);
        point(n, out);
        out.end_line();
      }
      return;
    }
    out.size(2).size(tags.size());
    if (style.version == "4.1") out.size(3).size(1000);
    out.end_line();
    for (const auto& [begin, end] : {std::pair<std::size_t, std::size_t>{0, 2}, {2, tags.size()}}) {
      const bool surface = begin == 0;
      entity(style, out, surface ? 2 : 3, 1);
      out.integer(surface).size(end - begin).end_line();
      if (style.version == "4.1")
        for (std::size_t n = begin; n < end; ++n) out.tag(tags[n]).end_line();
      for (std::size_t n = begin; n < end; ++n) {
        if (style.version == "4.0") out.tag(tags[n]);
        point(n, out);
        if (surface) out.real(0.25).real(0.75);
        out.end_line();
      }
    }
  }

  void write_elements(const GmshStyle& style, GmshBytes& out) const {
    const std::vector<std::uint64_t> triangle = {3, 7, 5};
    if (style.version == "2.2") {
      out.text(std::to_string(tetrahedra.size() + 1) + "\n");
      if (style.binary) out.integer(2).integer(1).integer(2);
      old_element(style, out, 1, 2, triangle);
      if (style.binary) out.integer(4).integer(static_cast<std::int32_t>(tetrahedra.size())).integer(2);
      for (std::size_t n = 0; n < tetrahedra.size(); ++n) old_element(style, out, 10 + n, 4, tetrahedra[n]);
      return;
    }
    out.size(2).size(tetrahedra.size() + 1);
    if (style.version == "4.1") out.size(1).size(11);
    out.end_line();
    entity(style, out, 2, 1);
    out.integer(2).size(1).end_line().tag(1);
    for (const std::uint64_t node : triangle) out.tag(node);
    out.end_line();
    entity(style, out, 3, 1);
    out.integer(4).size(tetrahedra.size()).end_line();
    for (std::size_t n = 0; n < tetrahedra.size(); ++n) {
      out.tag(10 + n);
      for (const std::uint64_t node : tetrahedra[n]) out.tag(node);
      out.end_line();
    }
  }

  /// Appends an element of MSH 2, with two tags (entities) before its nodes.
  static void old_element(const GmshStyle& style, GmshBytes& out, std::uint64_t number, int type,
                          const std::vector<std::uint64_t>& nodes) {
    out.tag(number);
    if (!style.binary) out.integer(type).integer(2);
    out.integer(1).integer(1);
    for (const std::uint64_t node : nodes) out.tag(node);
    out.end_line();
  }
};
