// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Reads legacy VTK polydata, text or big-endian binary
// (https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html). NORMALS are no longer true after a deformation
// and are left out; everything else is kept byte for byte.
#include <bit>
#include <cmath>

#include "deform/errors.h"
#include "io/meshes/vtk_text.h"
#include "io/points/points_document.h"

namespace tetwarp {

namespace {

template <class Number, class Bits>
void add_big_endian(std::string& bytes, Number value) {
  const auto bits = std::bit_cast<Bits>(value);
  for (std::size_t n = sizeof bits; n-- > 0;) bytes += static_cast<char>(bits >> (8 * n) & 0xFF);
}

class VtkDocument : public PointsDocument {
 public:
  VtkDocument(std::string all, const std::string& name) : bytes_(std::move(all)), name_(name), text_(bytes_, name) {
    take_space(text_.title, name);
    require(text_.dataset == "POLYDATA", "no polydata" + text_.here() + "; expected DATASET POLYDATA");
    while (text_.skip_blanks()) take_part();
    if (dropped_) notes.push_back(name + ": its normals do not hold any more and are left out");
  }

  std::string rewritten(std::span<const glm::dvec3> moved, std::span<const PointStatus>) const override {
    Patch patch(bytes_);
    for (const TextSpan& part : edits_) {
      const bool is_points = part.begin == points_at_.begin && part.end == points_at_.end;
      patch.replace(part.begin, part.end, is_points ? values_of(moved) : "");
    }
    return patch.take();
  }

 private:
  void take_part() {
    const std::size_t begin = text_.at();
    const std::string where = text_.here();
    const auto words = text_.words();
    const std::string keyword = upper(words[0]);
    const auto word = [&](std::size_t n) { return word_of(words, n, where); };
    if (keyword == "POINTS") return take_points(count_of(word(1), where), word(2), where);
    if (keyword == "VERTICES" || keyword == "LINES" || keyword == "POLYGONS" || keyword == "TRIANGLE_STRIPS") {
      text_.skip_cells(count_of(word(1), where), count_of(word(2), where), where);
    } else if (keyword == "FIELD") {
      text_.skip_field(count_of(word(2), where));
    } else if (keyword == "METADATA") {
      text_.skip_metadata();
    } else if (keyword == "POINT_DATA" || keyword == "CELL_DATA") {
      tuples_ = count_of(word(1), where);
      require(
          keyword == "CELL_DATA" || tuples_ == points.size(),
          "data of " + std::to_string(tuples_) + " points" + where + "; the file has " + std::to_string(points.size()));
    } else {
      text_.skip_data(words, tuples_, where);
      if (keyword == "NORMALS") drop(begin);
    }
  }

  void take_points(std::size_t count, std::string_view type, const std::string& where) {
    require(points.empty(), "POINTS twice" + where);
    const VtkValues values = text_.skip_values(3 * count, type, where);
    require(values.type == "FLOAT" || values.type == "DOUBLE",
            "points of the type " + values.type + where + "; expected float or double");
    double_ = values.type == "DOUBLE";
    decode_ = big_endian_decoder(values.type, where);
    points_at_ = values.span;
    edits_.push_back(points_at_);
    points.resize(count);
    std::size_t value_at = points_at_.begin;
    for (std::size_t n = 0; n < 3 * count; ++n) points[n / 3][static_cast<int>(n % 3)] = value(value_at);
  }

  /// The coordinate at byte `at`, which is moved behind it.
  double value(std::size_t& at) const {
    if (!text_.binary) {
      at = bytes_.find_first_not_of(" \t\r\n", at);
      const std::size_t end = std::min(bytes_.find_first_of(" \t\r\n", at), bytes_.size());
      const double number = number_of(std::string_view(bytes_).substr(at, end - at), at_byte(at, name_));
      at = end;
      return number;
    }
    const double number = decode_(bytes_.data() + at);
    if (!std::isfinite(number)) throw InputError("a coordinate that is not finite" + at_byte(at, name_));
    at += double_ ? sizeof(double) : sizeof(float);
    return number;
  }

  /// Leaves out the part of the file from `begin` to here, with the metadata that follow it.
  void drop(std::size_t begin) {
    if (text_.next_is("METADATA")) {
      text_.line();
      text_.skip_metadata();
    }
    text_.skip_blanks();
    edits_.push_back({begin, text_.at()});
    dropped_ = true;
  }

  std::string values_of(std::span<const glm::dvec3> moved) const {
    std::string text;
    for (std::size_t n = 0; n < 3 * moved.size(); ++n) {
      const double number = moved[n / 3][static_cast<int>(n % 3)] + 0.0;
      if (text_.binary) {
        if (double_) {
          add_big_endian<double, std::uint64_t>(text, number);
        } else {
          add_big_endian<float, std::uint32_t>(text, static_cast<float>(number));
        }
        continue;
      }
      if (n > 0) text += n % 3 == 0 ? '\n' : ' ';
      text += double_ ? text_of(number) : text_of(static_cast<float>(number));
    }
    return text;
  }

  std::string bytes_, name_;
  VtkText text_;
  std::size_t tuples_ = 0;  ///< number of tuples of the data that follow
  TextSpan points_at_;
  std::vector<TextSpan> edits_;  ///< what is replaced: the points, and the parts that are left out
  VtkDecoder decode_ = nullptr;  ///< decodes a coordinate of a binary file
  bool double_ = false, dropped_ = false;
};

}  // namespace

std::unique_ptr<PointsDocument> parse_vtk_points(std::string bytes, const std::string& name) {
  return std::make_unique<VtkDocument>(std::move(bytes), name);
}

}  // namespace tetwarp
