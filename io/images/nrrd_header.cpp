// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/images/nrrd_header.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <sstream>
#include <string_view>
#include <vector>

#include "deform/errors.h"
#include "io/images/header_words.h"
#include "io/images/nrrd_names.h"
#include "io/lower_case.h"
#include "io/shown_text.h"

namespace tetwarp {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// One axis of the array, of those of the grid and of the components.
struct Axis {
  std::int64_t size = 0;
  NrrdKind kind;
  std::array<double, 3> step = {kUnknown, kUnknown, kUnknown};  ///< in the space
  double spacing = kUnknown, min = kUnknown, max = kUnknown;
  bool has_units = false, at_nodes = false;

  bool has_step() const { return std::isfinite(step[0]); }
};

/// The fields of one file, read one after another.
class NrrdFields {
 public:
  NrrdFields(const TextHeader& text, const std::string& file) : text_(text), file_(file) {}

  NrrdHeader read() {
    read_array();
    read_axes();
    read_space();
    require_no_contradiction();
    NrrdHeader header = read_components();
    header.image.metadata = text_.metadata;
    header.image.geometry = place();
    note_assumed_space(header.image);
    return header;
  }

 private:
  bool has(const char* field) const { return text_.fields.contains(field); }

  [[noreturn]] void refuse(const std::string& field, const std::string& expected) const {
    throw InputError("unreadable header (the field \"" + field + "\" is \"" + shown(text_[field].substr(0, 60)) +
                     "\"), " + file_ + "; expected " + expected);
  }

  /// Type, number of axes, encoding and order of bytes.
  void read_array() {
    for (const char* field : {"type", "dimension", "sizes", "encoding"})
      require(has(field), "unreadable header (no field \"" + std::string(field) + "\"), " + file_);
    type_ = nrrd_type(text_["type"], file_);
    const auto encoding = nrrd_encoding(text_["encoding"]);
    if (!encoding) refuse("encoding", "raw, gzip, text or hex");
    encoding_ = *encoding;
    const std::string endian = lower(text_["endian"]);
    if (has("endian") && endian != "little" && endian != "big") refuse("endian", "little or big");
    require(has("endian") || size_bytes(type_) == 1 || encoding_ == Encoding::text,
            "the field \"endian\" is \"\", " + file_ + "; expected little or big");
    big_endian_ = endian == "big";
    const auto dimension = to_whole_number(trimmed(text_["dimension"]));
    if (!dimension || *dimension < 1 || *dimension > 16) refuse("dimension", "1 to 16");
    axes_.resize(static_cast<std::size_t>(*dimension));
    if (to_whole_number(trimmed(text_["block size"])).value_or(0) > 0) refuse("block size", "none, for numbers");
    for (const char* field : {"old min", "old max"}) {
      if (const auto value = to_number(trimmed(text_[field])); has(field) && (!value || std::isinf(*value)))
        refuse(field, "a number");
    }
  }

  void read_axes() {
    read_words("sizes", [&](Axis& axis, const std::string& word) {
      const auto size = to_whole_number(word);
      axis.size = size.value_or(0);
      return axis.size > 0;
    });
    double values = 1;
    for (const Axis& axis : axes_) values *= static_cast<double>(axis.size);
    constexpr double kMostValues = 1e18;  // whose bytes can be counted
    if (values > kMostValues) refuse("sizes", "fewer values");
    read_words("kinds", [&](Axis& axis, const std::string& word) {
      const auto kind = nrrd_kind(word);
      axis.kind = kind.value_or(NrrdKind());
      return kind && (kind->size == 0 || kind->size == axis.size);
    });
    read_words("centerings", [&](Axis& axis, const std::string& word) {
      const std::string centre = lower(word);
      axis.at_nodes = centre == "node";
      return axis.at_nodes || centre == "cell" || centre == "none" || centre == "???";
    });
    const auto read_numbers = [&](const char* field, double Axis::*member, auto&& is_valid) {
      read_words(field, [&](Axis& axis, const std::string& word) {
        const auto value = to_number(word);
        if (member) axis.*member = value.value_or(kUnknown);
        return value && !std::isinf(*value) && (std::isnan(*value) || is_valid(*value));
      });
    };
    const auto any = [](double) { return true; };
    read_numbers("spacings", &Axis::spacing, [](double value) { return value != 0; });
    read_numbers("axis mins", &Axis::min, any);
    read_numbers("axis maxs", &Axis::max, any);
    read_numbers("thicknesses", nullptr, [](double value) { return value >= 0; });
    read_quoted("labels", axes_.size());
    const std::vector<std::string> units = read_quoted("units", axes_.size());
    for (std::size_t n = 0; n < units.size(); ++n) axes_[n].has_units = !units[n].empty();
  }

  /// Gives each axis its word of a field, of which there must be as many as axes.
  /// @param take  says whether the word is one that the field may have
  template <class Take>
  void read_words(const char* field, const Take& take) {
    if (!has(field)) return;
    const std::vector<std::string> all = words(text_[field]);
    bool good = all.size() == axes_.size();
    for (std::size_t n = 0; good && n < axes_.size(); ++n) good = take(axes_[n], all[n]);
    if (!good) refuse(field, std::to_string(axes_.size()) + " values that it may have, one an axis");
  }

  /// The texts of a field that are in quotes, in which \" is a quote.
  std::vector<std::string> read_quoted(const char* field, std::size_t count) const {
    if (!has(field)) return {};
    const std::string text = text_[field];
    std::vector<std::string> all;
    std::size_t at = text.find_first_not_of(" \t");
    while (at != std::string::npos && text[at] == '"' && all.size() <= count) {
      std::string part;
      for (++at; at < text.size() && text[at] != '"'; ++at) {
        if (text[at] == '\\' && at + 1 < text.size() && text[at + 1] == '"') ++at;
        part += text[at];
      }
      if (at == text.size()) refuse(field, "texts in quotes");
      all.push_back(part);
      at = text.find_first_not_of(" \t", at + 1);
    }
    if (at != std::string::npos || all.size() != count) refuse(field, std::to_string(count) + " texts in quotes");
    return all;
  }

  void read_space() {
    if (has("space")) {
      if (has("space dimension")) refuse("space dimension", "none beside a space");
      const auto space = nrrd_space(text_["space"]);
      if (!space) refuse("space", "left-posterior-superior");
      space_ = space->name;
      space_axes_ = static_cast<std::size_t>(space->dimensions);
    } else if (has("space dimension")) {
      const auto dimension = to_whole_number(trimmed(text_["space dimension"]));
      if (!dimension || *dimension > 8) refuse("space dimension", "3");
      space_axes_ = static_cast<std::size_t>(*dimension);
    }
    const auto grid_axes =
        static_cast<std::size_t>(std::ranges::count_if(axes_, [](const Axis& axis) { return axis.kind.is_place; }));
    require(grid_axes == 3, "an image of " + std::to_string(grid_axes) + " axes, " + file_ + "; expected 3");
    require(space_axes_ == 0 || space_axes_ == 3,
            "unreadable header (a space of " + std::to_string(space_axes_) + " axes around an image of 3), " + file_);
    for (const char* field : {"space directions", "space origin", "space units", "measurement frame"})
      require(space_axes_ == 3 || !has(field),
              "unreadable header (\"" + std::string(field) + "\" in no space), " + file_);
    if (has("space directions")) {
      const auto steps = read_vectors("space directions", axes_.size(), false);
      for (std::size_t n = 0; n < axes_.size(); ++n) axes_[n].step = steps[n];
      // NaN is what files of old have for an axis that lies in no space; ITK makes up a direction for it.
      const auto known = std::ranges::count_if(axes_, [](const Axis& axis) { return axis.has_step(); });
      require(known >= 3, "\"space directions\" with steps of " + std::to_string(known) + " axes, " + file_ +
                              "; expected those of 3, correct the header");
    }
    if (has("space origin")) origin_ = read_vectors("space origin", 1, true)[0];
    if (has("measurement frame")) {
      const auto frame = read_vectors("measurement frame", 3, false);
      if (!std::ranges::all_of(frame,
                               [&](const auto& column) { return std::isnan(column[0]) == std::isnan(frame[0][0]); }))
        refuse("measurement frame", "vectors, or none for all");
    }
    read_quoted("space units", space_axes_);
  }

  /// Vectors of the space, "(x,y,z)" or "none".
  /// @param more  whether anything may follow the last
  std::vector<std::array<double, 3>> read_vectors(const char* field, std::size_t count, bool more) const {
    const std::string whole = text_[field];
    std::string_view text = whole;
    const auto skip_blanks = [&] { text.remove_prefix(std::min(text.find_first_not_of(" \t"), text.size())); };
    std::vector<std::array<double, 3>> vectors(count, {kUnknown, kUnknown, kUnknown});
    for (auto& vector : vectors) {
      skip_blanks();
      constexpr std::string_view kNone = "none";
      if (text.starts_with(kNone)) {
        text.remove_prefix(kNone.size());
        if (!text.empty() && text[0] != ' ' && text[0] != '\t') refuse(field, "vectors (x,y,z)");
        continue;
      }
      const auto end = text.find(')');
      if (!text.starts_with('(') || end == std::string_view::npos ||
          !take_vector(std::string(text.substr(1, end - 1)), vector))
        refuse(field, "vectors (x,y,z)");
      text.remove_prefix(end + 1);
    }
    skip_blanks();
    if (!text.empty() && !more) refuse(field, std::to_string(count) + " vectors (x,y,z)");
    return vectors;
  }

  /// @return  whether the text is three numbers between commas, all of them known or none, none infinite
  static bool take_vector(const std::string& text, std::array<double, 3>& vector) {
    std::istringstream parts(text + ",");
    std::size_t n = 0;
    for (std::string part; std::getline(parts, part, ','); ++n) {
      const auto value = to_number(trimmed(part));
      if (n == 3 || !value || std::isinf(*value)) return false;
      vector[n] = *value;
    }
    const auto unknown = std::ranges::count_if(vector, [](double value) { return std::isnan(value); });
    return n == 3 && (unknown == 0 || unknown == 3);
  }

  void require_no_contradiction() const {
    for (std::size_t n = 0; n < axes_.size(); ++n) {
      const Axis& axis = axes_[n];
      const bool placed = std::isfinite(axis.spacing) || std::isfinite(axis.min) || std::isfinite(axis.max);
      require(!axis.has_step() || (!placed && !axis.has_units),
              "unreadable header (axis " + std::to_string(n) +
                  " has a space direction, and a spacing, minimum, maximum or unit beside it), " + file_);
      require(space_axes_ == 0 || !axis.kind.is_place || !std::isfinite(axis.spacing),
              "unreadable header (axis " + std::to_string(n) + " has a spacing, in a space), " + file_);
    }
  }

  NrrdHeader read_components() const {
    NrrdHeader header;
    header.image.type = type_;
    header.encoding = encoding_;
    header.big_endian = big_endian_ && size_bytes(type_) > 1;
    const auto is_range = [](const Axis& axis) { return !axis.kind.is_place; };
    const auto count = std::ranges::count_if(axes_, is_range);
    require(count <= 1, "unreadable header (" + std::to_string(count) + " axes of components), " + file_);
    const auto range = std::ranges::find_if(axes_, is_range);
    if (range == axes_.end()) return header;
    require(range->kind.pixel.empty(),
            "voxels that are " + range->kind.pixel + ", " + file_ + "; expected numbers or vectors");
    require(range->size <= std::numeric_limits<int>::max(),
            std::to_string(range->size) + " components a voxel, " + file_);
    header.image.components = static_cast<int>(range->size);
    if (range->size == 1) return header;
    for (auto axis = axes_.begin(); axis != range; ++axis) header.plane_count *= static_cast<std::uint64_t>(axis->size);
    return header;
  }

  /// In LPS, whatever the space.
  Geometry place() const {
    const bool ras = space_ == "ras", las = space_ == "las";
    const std::array<double, 3> lps = {ras ? -1.0 : 1.0, ras || las ? -1.0 : 1.0, 1.0};
    Geometry grid;
    int a = 0;
    for (const Axis& axis : axes_) {
      if (!axis.kind.is_place) continue;
      grid.size[a] = axis.size;
      if (std::isfinite(axis.spacing)) grid.spacing[a] = axis.spacing;
      if (axis.has_step()) {
        const auto& [x, y, z] = axis.step;
        grid.spacing[a] = std::sqrt(x * x + y * y + z * z);
        for (std::size_t row = 0; row < 3; ++row)
          grid.direction[a][static_cast<int>(row)] = cosine(lps[row] * axis.step[row], grid.spacing[a], las);
      }
      if (space_axes_ == 0) place_without_space(grid, a);
      ++a;
    }
    const bool has_origin = std::isfinite(origin_[0]);
    require(!las || (has_origin && has("space directions")),
            "the space left-anterior-superior without \"space origin\" or \"space directions\", " + file_);
    for (std::size_t row = 0; has_origin && row < 3; ++row)
      grid.origin[static_cast<int>(row)] = las ? lps[row] * origin_[row] + 0.0 : lps[row] * origin_[row];
    return grid;
  }

  /// Part of a step by its length. Both ways round differently in the last bit; each space has kept its own.
  static double cosine(double part, double length, bool divided) {
    return divided ? part / length + 0.0 : snapped_cosine(1.0 / length * part);
  }

  /// By the least place along each axis, of the borders of voxels or (at nodes) of their centres, where all are stated.
  void place_without_space(Geometry& grid, int a) const {
    std::vector<const Axis*> placed;
    for (const Axis& axis : axes_) {
      if (axis.kind.is_place) placed.push_back(&axis);
    }
    const bool all_reach = std::ranges::all_of(
        placed, [](const Axis* axis) { return std::isfinite(axis->max) || std::isfinite(axis->spacing); });
    if (!std::isfinite(placed[0]->min) || !all_reach) return;
    const Axis& axis = *placed[static_cast<std::size_t>(a)];
    const auto intervals = static_cast<double>(axis.at_nodes ? axis.size - 1 : axis.size);
    const double spacing = std::isfinite(axis.spacing) ? axis.spacing : (axis.max - axis.min) / intervals;
    grid.origin[a] = axis.min + (axis.at_nodes ? 0.0 : spacing / 2);
  }

  void note_assumed_space(ImageHeader& image) const {
    if (space_ == "lps" || space_ == "ras" || space_ == "las") return;
    image.notes.push_back(space_.empty() ? "the file does not say its space: taken as LPS"
                                         : "the space \"" + space_ + "\" is none of a patient: taken as LPS");
  }

  const TextHeader& text_;
  const std::string& file_;
  VoxelType type_ = VoxelType::i16;
  Encoding encoding_ = Encoding::raw;
  bool big_endian_ = false;
  std::vector<Axis> axes_;
  std::string space_;
  std::size_t space_axes_ = 0;
  std::array<double, 3> origin_ = {kUnknown, kUnknown, kUnknown};
};

}  // namespace

NrrdHeader parse_nrrd_header(const TextHeader& text, const std::string& file) { return NrrdFields(text, file).read(); }

std::string nrrd_header(const Geometry& grid, VoxelType type, int components,
                        const std::map<std::string, std::string>& metadata, bool gzip) {
  const bool vectors = components > 1;
  std::ostringstream out;
  out << "NRRD0004\n# Complete NRRD file format specification at:\n# http://teem.sourceforge.net/nrrd/format.html\n"
      << "type: " << nrrd_type_name(type) << "\ndimension: " << (vectors ? 4 : 3)
      << "\nspace: left-posterior-superior\nsizes:";
  if (vectors) out << ' ' << components;
  out << ' ' << grid.size.x << ' ' << grid.size.y << ' ' << grid.size.z
      << "\nspace directions:" << (vectors ? " none" : "");
  for (int axis = 0; axis < 3; ++axis) out << " (" << exact(grid.spacing[axis] * grid.direction[axis], ",") << ')';
  out << "\nkinds:" << (vectors ? " vector" : "") << " domain domain domain\n";
  if (size_bytes(type) > 1) out << "endian: little\n";
  out << "encoding: " << (gzip ? "gzip" : "raw") << "\nspace origin: (" << exact(grid.origin, ",") << ")\n";
  const auto escaped = [](std::string text) {
    for (std::size_t at = 0; (at = text.find('\\', at)) != std::string::npos; at += 2) text.insert(at, 1, '\\');
    return text;
  };
  for (const auto& [key, value] : metadata) out << escaped(key) << ":=" << escaped(value) << '\n';
  out << '\n';
  return out.str();
}

}  // namespace tetwarp
