// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Reads STL surfaces: 80 bytes, a count and 50 bytes for each facet (little endian), or text.
#include <bit>
#include <cmath>
#include <cstring>
#include <glm/geometric.hpp>

#include "deform/errors.h"
#include "io/lower_case.h"
#include "io/points/points_document.h"

namespace tetwarp {

namespace {

static_assert(std::endian::native == std::endian::little, "STL is read and written as it lies in memory");

constexpr std::size_t kHeaderBytes = 80, kFirstFacet = 84, kFacetBytes = 50;

/// The unit normal of a facet by the right-hand rule; zero where the facet has no area.
glm::dvec3 normal_of(std::span<const glm::dvec3> corners) {
  const glm::dvec3 normal = glm::cross(corners[1] - corners[0], corners[2] - corners[0]);
  const double length = glm::length(normal);
  return length > 0 && std::isfinite(length) ? normal / length : glm::dvec3(0);
}

class BinaryStl : public PointsDocument {
 public:
  BinaryStl(std::string all, const std::string& name) : bytes_(std::move(all)) {
    require(bytes_.size() >= kFirstFacet, std::to_string(bytes_.size()) + " bytes, " + name +
                                              "; expected at least 84 of an STL file, or text that begins with solid");
    std::uint32_t facets = 0;
    std::memcpy(&facets, bytes_.data() + kHeaderBytes, sizeof facets);
    const std::size_t expected = kFirstFacet + kFacetBytes * std::size_t{facets};
    require(bytes_.size() == expected, std::to_string(bytes_.size()) + " bytes, " + name + "; expected " +
                                           std::to_string(expected) + " for " + std::to_string(facets) + " facets");
    take_space(std::string_view(bytes_).substr(0, kHeaderBytes), name);
    points.resize(3 * std::size_t{facets});
    for (std::size_t n = 0; n < points.size(); ++n) {
      float corner[3];
      std::memcpy(corner, bytes_.data() + offset(n), sizeof corner);
      if (!std::isfinite(corner[0]) || !std::isfinite(corner[1]) || !std::isfinite(corner[2]))
        throw InputError("a corner that is not finite" + at_byte(offset(n), name));
      points[n] = {corner[0], corner[1], corner[2]};
    }
  }

  std::string rewritten(std::span<const glm::dvec3> moved, std::span<const PointStatus>) const override {
    std::string result = bytes_;
    for (std::size_t first = 0; first < moved.size(); first += 3) {
      put(result, offset(first) - sizeof(glm::vec3), glm::vec3(normal_of(moved.subspan(first, 3)) + 0.0));
      for (std::size_t n = first; n < first + 3; ++n) put(result, offset(n), glm::vec3(moved[n] + 0.0));
    }
    return result;
  }

 private:
  /// The byte at which a corner begins. The normal of a facet precedes its first corner.
  static std::size_t offset(std::size_t corner) {
    return kFirstFacet + corner / 3 * kFacetBytes + (1 + corner % 3) * sizeof(glm::vec3);
  }
  static void put(std::string& bytes, std::size_t at, const glm::vec3& value) {
    std::memcpy(bytes.data() + at, &value, sizeof value);
  }

  std::string bytes_;
};

class TextStl : public PointsDocument {
 public:
  TextStl(std::string all, const std::string& name) : bytes_(std::move(all)) {
    require(bytes_.find('\0') == std::string::npos, "a byte of zero in text, " + name + "; is it an STL file?");
    // The words with which the lines of a facet begin, in order. A solid may hold any number of facets.
    constexpr const char* kFacet[] = {"facet", "outer", "vertex", "vertex", "vertex", "endloop", "endfacet"};
    Lines lines(bytes_);
    bool in_solid = false;
    for (std::size_t step = 0; lines.next();) {
      const auto words = words_of(lines.line);
      if (words.empty()) continue;
      const std::string word = lower(std::string(words[0])), where = at_line(lines.number, name);
      if (step == 0 && word == (in_solid ? "endsolid" : "solid")) {
        in_solid = !in_solid;
        take_space(lines.line, name);
        continue;
      }
      require(in_solid && word == kFacet[step], "\"" + std::string(words[0]) + "\" where " +
                                                    (in_solid ? kFacet[step] : "solid") + " is expected" + where);
      if (word == "vertex") take_corner(words, where);
      if (word == "facet") take_normal(words, where);
      step = (step + 1) % std::size(kFacet);
    }
    require(!in_solid, "no endsolid at its end, " + name + "; is the file whole?");
  }

  std::string rewritten(std::span<const glm::dvec3> moved, std::span<const PointStatus>) const override {
    Patch patch(bytes_);
    for (std::size_t first = 0; first < moved.size(); first += 3) {
      const TextSpan& normal = normals_[first / 3];
      patch.replace(normal.begin, normal.end, text_of(normal_of(moved.subspan(first, 3))));
      for (std::size_t n = first; n < first + 3; ++n)
        patch.replace(corners_[n].begin, corners_[n].end, text_of(moved[n]));
    }
    return patch.take();
  }

 private:
  TextSpan span_of(std::string_view first, std::string_view last) const {
    return {static_cast<std::size_t>(first.data() - bytes_.data()),
            static_cast<std::size_t>(last.data() + last.size() - bytes_.data())};
  }
  void take_corner(const std::vector<std::string_view>& words, const std::string& where) {
    require(words.size() == 4, std::to_string(words.size() - 1) + " coordinates" + where + "; expected 3");
    points.emplace_back(number_of(words[1], where), number_of(words[2], where), number_of(words[3], where));
    corners_.push_back(span_of(words[1], words[3]));
  }
  void take_normal(const std::vector<std::string_view>& words, const std::string& where) {
    require(words.size() == 5, "no normal of 3 numbers" + where);
    normals_.push_back(span_of(words[2], words[4]));
  }

  std::string bytes_;
  std::vector<TextSpan> corners_, normals_;
};

}  // namespace

std::unique_ptr<PointsDocument> parse_stl_points(std::string bytes, const std::string& name) {
  const bool binary = !bytes.starts_with("solid") || bytes.substr(0, kFirstFacet).find('\0') != std::string::npos;
  if (binary) return std::make_unique<BinaryStl>(std::move(bytes), name);
  return std::make_unique<TextStl>(std::move(bytes), name);
}

}  // namespace tetwarp
