// Legacy VTK polydata, text or big-endian binary (https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html).
// NORMALS do not hold after a deformation and are left out; everything else is kept byte for byte.
#include <algorithm>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstring>
#include <map>

#include "deform/errors.h"
#include "io/points_document.h"

namespace tetwarp {

namespace {

std::string upper(std::string_view text) {
  std::string result(text);
  std::transform(result.begin(), result.end(), result.begin(), [](unsigned char c) { return std::toupper(c); });
  return result;
}

/// Bits of a value of a type in a binary file. @throws InputError for one of unknown length
std::size_t bits_of(std::string_view type, const std::string& where) {
  static const std::map<std::string, std::size_t> kBits = {
      {"BIT", 1},           {"CHAR", 8},           {"UNSIGNED_CHAR", 8},
      {"SIGNED_CHAR", 8},   {"SHORT", 16},         {"UNSIGNED_SHORT", 16},
      {"INT", 32},          {"UNSIGNED_INT", 32},  {"VTKIDTYPE", 32},
      {"FLOAT", 32},        {"LONG", 64},          {"UNSIGNED_LONG", 64},
      {"VTKTYPEINT64", 64}, {"VTKTYPEUINT64", 64}, {"DOUBLE", 64}};
  const auto found = kBits.find(upper(type));
  require(found != kBits.end(), "values of the type \"" + std::string(type) + "\"" + where + "; expected numbers");
  return found->second;
}

/// Values in a tuple.
std::size_t width_of(std::string_view text, const std::string& where) {
  const std::size_t width = count_of(text, where);
  require(width <= 65536, std::to_string(width) + " values in a tuple" + where);
  return width;
}

template <class Number, class Bits>
Number from_big_endian(const char* bytes) {
  Bits bits = 0;
  for (std::size_t n = 0; n < sizeof bits; ++n) bits = bits << 8 | static_cast<unsigned char>(bytes[n]);
  return std::bit_cast<Number>(bits);
}

template <class Number, class Bits>
void add_big_endian(std::string& bytes, Number value) {
  const auto bits = std::bit_cast<Bits>(value);
  for (std::size_t n = sizeof bits; n-- > 0;) bytes += static_cast<char>(bits >> (8 * n) & 0xFF);
}

/// Walks through a file, part by part.
class VtkDocument : public PointsDocument {
 public:
  VtkDocument(std::string all, const std::string& name) : bytes_(std::move(all)), name_(name) {
    const std::string_view first = line();
    require(first.starts_with("# vtk DataFile Version"), "not a legacy VTK file, " + name);
    take_space(line(), name);
    const std::string form = upper(next_words("ASCII or BINARY")[0]);
    require(form == "ASCII" || form == "BINARY", "\"" + form + "\"" + here() + "; expected ASCII or BINARY");
    binary_ = form == "BINARY";
    const auto dataset = next_words("DATASET POLYDATA");
    require(dataset.size() == 2 && upper(dataset[0]) == "DATASET" && upper(dataset[1]) == "POLYDATA",
            "no polydata" + here() + "; expected DATASET POLYDATA");
    while (skip_blanks()) take_part();
    if (dropped_) notes.push_back(name + ": its normals do not hold any more and are left out");
  }

  std::string rewritten(std::span<const glm::dvec3> moved, std::span<const PointStatus>) const override {
    Patch patch(bytes_);
    for (const Span& part : edits_) {
      const bool is_points = part.begin == points_at_.begin && part.end == points_at_.end;
      patch.replace(part.begin, part.end, is_points ? values_of(moved) : "");
    }
    return patch.take();
  }

 private:
  std::string here() const { return at_byte(at_, name_); }

  /// The rest of the line, without its end.
  std::string_view line() {
    const std::size_t begin = at_, end = std::min(bytes_.find('\n', at_), bytes_.size());
    at_ = std::min(end + 1, bytes_.size());
    std::string_view text = std::string_view(bytes_).substr(begin, end - begin);
    if (text.ends_with('\r')) text.remove_suffix(1);
    return text;
  }

  /// @return false at the end of the file
  bool skip_blanks() {
    at_ = std::min(bytes_.find_first_not_of(" \t\r\n", at_), bytes_.size());
    return at_ < bytes_.size();
  }

  /// The words of the next line that has any.
  std::vector<std::string_view> next_words(const char* what) {
    require(skip_blanks(), std::string("ends where ") + what + " is expected" + here() + "; is the file whole?");
    return words_of(line());
  }

  bool next_is(const char* keyword) {
    const std::size_t length = std::strlen(keyword);
    return skip_blanks() && upper(std::string_view(bytes_).substr(at_, length)) == keyword;
  }

  /// Values behind the line of their header: in binary from here on, in text words. @return where they are
  Span skip_values(std::size_t count, std::string_view type, const std::string& where) {
    const std::size_t bits = bits_of(type, where);
    Span values{at_, at_};
    if (binary_) {
      values.end += (count * bits + 7) / 8;
      require(values.end <= bytes_.size(), std::to_string(bytes_.size() - at_) + " bytes of " +
                                               std::to_string(values.end - at_) + " left for the values" + here() +
                                               "; is the file whole?");
      at_ = values.end;
      return values;
    }
    for (std::size_t n = 0; n < count; ++n) {
      if (!skip_blanks()) {
        throw InputError(std::to_string(n) + " of " + std::to_string(count) + " values" + where +
                         "; is the file whole?");
      }
      if (n == 0) values.begin = at_;
      at_ = std::min(bytes_.find_first_of(" \t\r\n", at_), bytes_.size());
    }
    values.end = at_;
    return values;
  }

  void take_part() {
    const std::size_t begin = at_;
    const std::string where = here();
    const auto words = words_of(line());
    const std::string keyword = upper(words[0]);
    const auto word = [&](std::size_t n) {
      require(n < words.size(), keyword + " of " + std::to_string(words.size() - 1) + " words" + where);
      return words[n];
    };
    if (keyword == "POINTS") return take_points(count_of(word(1), where), upper(word(2)), where);
    if (keyword == "VERTICES" || keyword == "LINES" || keyword == "POLYGONS" || keyword == "TRIANGLE_STRIPS")
      return skip_cells(count_of(word(1), where), count_of(word(2), where), where);
    if (keyword == "FIELD") return skip_field(count_of(word(2), where));
    if (keyword == "METADATA") return skip_metadata();
    if (keyword == "POINT_DATA" || keyword == "CELL_DATA") {
      tuples_ = count_of(word(1), where);
      require(
          keyword == "CELL_DATA" || tuples_ == points.size(),
          "data of " + std::to_string(tuples_) + " points" + where + "; the file has " + std::to_string(points.size()));
      return;
    }
    if (keyword == "SCALARS") {
      const std::size_t components = words.size() > 3 ? width_of(words[3], where) : 1;
      require(next_is("LOOKUP_TABLE"), "SCALARS without LOOKUP_TABLE" + where);
      line();
      skip_values(tuples_ * components, word(2), where);
    } else if (keyword == "COLOR_SCALARS") {
      skip_values(tuples_ * width_of(word(2), where), "unsigned_char", where);
    } else if (keyword == "LOOKUP_TABLE") {
      skip_values(4 * count_of(word(2), where), "unsigned_char", where);
    } else if (keyword == "TEXTURE_COORDINATES") {
      skip_values(tuples_ * width_of(word(2), where), word(3), where);
    } else {
      skip_values(tuples_ * components_of(keyword, where), word(2), where);
    }
    if (keyword == "NORMALS") drop(begin);
  }

  static std::size_t components_of(const std::string& keyword, const std::string& where) {
    static const std::map<std::string, std::size_t> kComponents = {
        {"VECTORS", 3},    {"NORMALS", 3},      {"TENSORS", 9},   {"TENSORS6", 6},
        {"GLOBAL_IDS", 1}, {"PEDIGREE_IDS", 1}, {"EDGE_FLAGS", 1}};
    const auto found = kComponents.find(keyword);
    require(found != kComponents.end(), "\"" + keyword.substr(0, 32) + "\"" + where + "; expected a part of polydata");
    return found->second;
  }

  void take_points(std::size_t count, const std::string& type, const std::string& where) {
    require(points.empty(), "POINTS twice" + where);
    require(type == "FLOAT" || type == "DOUBLE", "points of the type " + type + where + "; expected float or double");
    double_ = type == "DOUBLE";
    points_at_ = skip_values(3 * count, type, where);
    edits_.push_back(points_at_);
    points.resize(count);
    std::size_t value_at = points_at_.begin;
    for (std::size_t n = 0; n < 3 * count; ++n) points[n / 3][static_cast<int>(n % 3)] = value(value_at);
  }

  /// One coordinate; `at` goes on to the next.
  double value(std::size_t& at) const {
    if (!binary_) {
      at = bytes_.find_first_not_of(" \t\r\n", at);
      const std::size_t end = std::min(bytes_.find_first_of(" \t\r\n", at), bytes_.size());
      const double number = number_of(std::string_view(bytes_).substr(at, end - at), at_byte(at, name_));
      at = end;
      return number;
    }
    const char* from = bytes_.data() + at;
    const double number =
        double_ ? from_big_endian<double, std::uint64_t>(from) : double{from_big_endian<float, std::uint32_t>(from)};
    if (!std::isfinite(number)) throw InputError("a coordinate that is not finite" + at_byte(at, name_));
    at += double_ ? sizeof(double) : sizeof(float);
    return number;
  }

  void skip_cells(std::size_t first, std::size_t second, const std::string& where) {
    if (!next_is_offsets()) {
      skip_values(second, "int", where);
      return;
    }
    for (const std::size_t count : {first, second}) {  // OFFSETS type, CONNECTIVITY type: version 5
      const auto words = next_words("OFFSETS or CONNECTIVITY");
      require(words.size() == 2, "no type of OFFSETS or CONNECTIVITY" + here());
      skip_values(count, words[1], here());
    }
  }

  /// In a binary file of version 4 the numbers begin right here: nothing may be skipped.
  bool next_is_offsets() const { return std::string_view(bytes_).substr(at_).starts_with("OFFSETS "); }

  void skip_field(std::size_t arrays) {
    for (std::size_t n = 0; n < arrays; ++n) {
      while (next_is("METADATA")) {
        line();
        skip_metadata();
      }
      const auto words = next_words("an array of a field");
      const std::string where = here();
      require(words.size() == 4, "an array of a field without name, components, tuples and type" + where);
      skip_values(width_of(words[1], where) * count_of(words[2], where), words[3], where);
    }
  }

  /// To the blank line that ends it.
  void skip_metadata() {
    while (at_ < bytes_.size() && !words_of(line()).empty()) continue;
  }

  /// The part from `begin` to here, with what is said of it.
  void drop(std::size_t begin) {
    if (next_is("METADATA")) {
      line();
      skip_metadata();
    }
    skip_blanks();
    edits_.push_back({begin, at_});
    dropped_ = true;
  }

  std::string values_of(std::span<const glm::dvec3> moved) const {
    std::string text;
    for (std::size_t n = 0; n < 3 * moved.size(); ++n) {
      const double number = moved[n / 3][static_cast<int>(n % 3)] + 0.0;
      if (binary_) {
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
  std::size_t at_ = 0;
  std::size_t tuples_ = 0;  ///< of the data that follow
  Span points_at_;
  std::vector<Span> edits_;  ///< the points, and what is left out
  bool binary_ = false, double_ = false, dropped_ = false;
};

}  // namespace

std::unique_ptr<PointsDocument> parse_vtk_points(std::string bytes, const std::string& name) {
  return std::make_unique<VtkDocument>(std::move(bytes), name);
}

}  // namespace tetwarp
