// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/fields/field_mif.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "deform/errors.h"
#include "io/fields/shared/ordered_values.h"
#include "io/files/gzip_inflate.h"
#include "io/images/header_words.h"
#include "io/images/image_reader.h"
#include "io/lower_case.h"
#include "io/ras.h"

namespace tetwarp {
namespace {

constexpr std::string_view kFirstLine = "mrtrix image";
constexpr std::size_t kLongestHeader = std::size_t{1} << 20;  // bytes; a header may hold a long history of commands

/// The bytes of a file in order, inflated where they are gzip data.
class Bytes {
 public:
  explicit Bytes(const std::filesystem::path& path) : name_(path.string()), file_(path, std::ios::binary) {
    std::array<char, 2> first{};
    file_.read(first.data(), first.size());
    if (file_.good() && first[0] == '\x1f' && first[1] == '\x8b') packed_.emplace(path);
    file_.clear();
    file_.seekg(0);
  }

  bool is_packed() const { return packed_.has_value(); }
  void read(std::span<std::byte> bytes) {
    if (packed_) return packed_->read(bytes);
    file_.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    require(file_.good(), "truncated, " + name_ + "; is the file whole?");
  }
  void skip(std::uint64_t count) {
    if (packed_) return packed_->skip(count);
    file_.seekg(static_cast<std::streamoff>(count), std::ios::cur);
  }
  /// Looks at the end of packed data. That of others is known by the length of the file.
  void finish() {
    if (packed_) packed_->finish();
  }

 private:
  std::string name_;
  std::ifstream file_;
  std::optional<GzipStream> packed_;
};

/// The lines of a header, without what stands behind a #.
class HeaderText {
 public:
  HeaderText(Bytes& bytes, std::string file) : file_(std::move(file)) {
    require(line(bytes).starts_with(kFirstLine),
            "not an image of MRtrix, " + file_ + "; expected \"" + std::string(kFirstLine) + "\" in the first line");
    for (std::string text; (text = trimmed(line(bytes))) != "END";) {
      const std::size_t colon = text.find(':');
      if (colon == std::string::npos) continue;  // as MRtrix leaves it out
      lines_[lower(trimmed(text.substr(0, colon)))].push_back(trimmed(text.substr(colon + 1)));
    }
  }

  std::uint64_t size_bytes() const { return size_bytes_; }
  bool has(const std::string& key) const { return lines_.contains(key); }
  /// All lines of a key. @throws InputError where there is none
  const std::vector<std::string>& all(const std::string& key) const {
    const auto found = lines_.find(key);
    require(found != lines_.end(), "a header without \"" + key + "\", " + file_ + "; expected an image of MRtrix");
    return found->second;
  }
  /// The line of a key that stands once.
  const std::string& one(const std::string& key) const {
    const auto& lines = all(key);
    require(lines.size() == 1, std::to_string(lines.size()) + " lines of \"" + key + "\", " + file_ + "; expected one");
    return lines.front();
  }

 private:
  /// The next line, without its end.
  std::string line(Bytes& bytes) {
    std::string text;
    for (char byte = 0; bytes.read(std::as_writable_bytes(std::span(&byte, 1))), byte != '\n'; text += byte) {
      require(++size_bytes_ < kLongestHeader, "a header that does not end, " + file_ + "; expected END within 1 MiB");
    }
    ++size_bytes_;
    return text.substr(0, text.find('#'));
  }

  std::string file_;
  std::uint64_t size_bytes_ = 0;
  std::map<std::string, std::vector<std::string>> lines_;
};

/// The parts of a value, between commas and blanks.
std::vector<std::string> parts_of(std::string text) {
  std::ranges::replace(text, ',', ' ');
  return words(text);
}

/// The numbers of a line. @throws InputError unless there are at least `least` of them
std::vector<double> numbers_of(const std::string& text, const std::string& key, std::size_t least,
                               const std::string& file) {
  std::vector<double> numbers;
  for (const std::string& part : parts_of(text)) {
    const std::optional<double> number = to_number(part);
    require(number.has_value(), "\"" + key + ": " + text.substr(0, 80) + "\", " + file + "; expected numbers");
    numbers.push_back(*number);
  }
  require(numbers.size() >= least,
          "\"" + key + ": " + text.substr(0, 80) + "\", " + file + "; expected " + std::to_string(least) + " numbers");
  return numbers;
}

/// What a header says.
struct Warp {
  Geometry grid;
  ValueOrder order;
  std::uint64_t offset = 0;  ///< of the first value, in the inflated bytes
};

void parse_size(const HeaderText& text, const std::string& file, Geometry& grid) {
  const std::string dim = text.one("dim");
  std::vector<std::int64_t> sizes;
  for (const std::string& part : parts_of(dim)) {
    const std::optional<std::int64_t> size = to_whole_number(part);
    require(size && *size >= 1, "\"dim: " + dim.substr(0, 80) + "\", " + file + "; expected whole numbers from 1 on");
    sizes.push_back(*size);
  }
  require(sizes.size() != 5 || sizes[3] != 3,
          "a full warp of mrregister (five axes), " + file +
              "; make a deformation of it with warpconvert warpfull2deformation -template IMAGE");
  require(sizes.size() == 4 && sizes[3] == 3,
          "no warp but an image of " + dim.substr(0, 80) + " values, " + file + "; expected four axes, the last of 3");
  for (int axis = 0; axis < 3; ++axis) grid.size[axis] = sizes[static_cast<std::size_t>(axis)];
}

/// Takes the place of the grid: three rows of a matrix from the voxels' axes, in mm, to RAS. The order in which the
/// values are stored does not matter to it.
void parse_place(const HeaderText& text, const std::string& file, Geometry& grid) {
  const std::vector<double> spacing = numbers_of(text.one("vox"), "vox", 3, file);
  const auto& rows = text.all("transform");
  require(rows.size() == 3 || (rows.size() == 4 && numbers_of(rows[3], "transform", 4, file) ==
                                                       std::vector<double>{0, 0, 0, 1}),  // which MRtrix 0.2 wrote
          std::to_string(rows.size()) + " lines of \"transform\", " + file + "; expected three");
  glm::dmat3 cosines(1);
  glm::dvec3 origin(0);
  for (int row = 0; row < 3; ++row) {
    const std::vector<double> numbers = numbers_of(rows[static_cast<std::size_t>(row)], "transform", 4, file);
    for (int axis = 0; axis < 3; ++axis) cosines[axis][row] = numbers[static_cast<std::size_t>(axis)];
    origin[row] = numbers[3];
  }
  for (int axis = 0; axis < 3; ++axis) {
    grid.spacing[axis] = spacing[static_cast<std::size_t>(axis)];
    grid.direction[axis] = kLpsFromRas * cosines[axis] + 0.0;
  }
  grid.origin = kLpsFromRas * origin + 0.0;
  require_valid(grid, file);
  require_orthogonal(grid, file);
}

void parse_type(const HeaderText& text, const std::string& file, ValueOrder& order) {
  const std::string type = lower(text.one("datatype"));
  constexpr std::array<const char*, 4> kTypes = {"float32le", "float32be", "float64le", "float64be"};
  const auto* found = std::ranges::find(kTypes, type);
  require(found != kTypes.end(), "values of the type " + type.substr(0, 40) + ", " + file +
                                     "; expected Float32LE, Float32BE, Float64LE or Float64BE");
  order.type = found - kTypes.begin() < 2 ? VoxelType::f32 : VoxelType::f64;
  order.big_endian = (found - kTypes.begin()) % 2 == 1;
  // MRtrix spends it on whole numbers, but leaves floats as they are.
  require(!text.has("scaling") || numbers_of(text.one("scaling"), "scaling", 2, file) == std::vector<double>{0, 1},
          "floats with a scaling, " + file + "; write the file again with mrconvert");
}

/// Takes the order of the values: for each axis, how many axes are faster, and - where its last value comes first. The
/// header counts along the axes upwards whatever their signs are.
void parse_layout(const HeaderText& text, const std::string& file, Warp& warp) {
  const std::string layout = text.one("layout");
  const auto x = static_cast<std::ptrdiff_t>(warp.grid.size.x), y = static_cast<std::ptrdiff_t>(warp.grid.size.y);
  const std::array<std::ptrdiff_t, 4> steps = {3, 3 * x, 3 * x * y, 1};
  const std::vector<std::string> parts = parts_of(layout);
  std::array<bool, 4> taken{};
  bool good = parts.size() == steps.size();
  for (std::size_t axis = 0; good && axis < steps.size(); ++axis) {
    const std::string& part = parts[axis];
    const bool backwards = part.starts_with('-'), is_signed = backwards || part.starts_with('+');
    const std::string digit = part.substr(is_signed ? 1 : 0);
    good = digit.size() == 1 && digit[0] >= '0' && digit[0] <= '3';
    if (!good) break;
    const std::size_t place = 3 - static_cast<std::size_t>(digit[0] - '0');  // the slowest first
    good = !taken[place];
    taken[place] = true;
    const std::int64_t size = axis < 3 ? warp.grid.size[static_cast<int>(axis)] : 3;
    warp.order.axes[place] = {static_cast<std::size_t>(size), backwards ? -steps[axis] : steps[axis]};
  }
  require(good,
          "\"layout: " + layout.substr(0, 80) + "\", " + file + "; expected 0, 1, 2, 3 in any order, each with + or -");
}

void parse_offset(const HeaderText& text, const std::string& file, Warp& warp) {
  const std::vector<std::string> parts = words(text.one("file"));
  require(!parts.empty() && parts[0] == ".", "values in another file (" +
                                                 (parts.empty() ? "" : parts[0].substr(0, 80)) + "), " + file +
                                                 "; make one file of them: mrconvert " + file + " OUTPUT.mif");
  const std::int64_t offset = parts.size() == 2 ? to_whole_number(parts[1]).value_or(-1) : -1;
  require(offset >= static_cast<std::int64_t>(text.size_bytes()),
          "\"file: " + text.one("file").substr(0, 80) + "\", " + file +
              "; expected a dot, and the byte behind the header at which the values begin");
  warp.offset = static_cast<std::uint64_t>(offset);
}

/// Refuses a header that promises more values than the file can hold, and bytes behind the values.
void require_holds(const Warp& warp, bool packed, const std::filesystem::path& path) {
  const std::string file = path.string(), values = to_string(warp.grid.size) + " x 3 x " + to_string(warp.order.type);
  const double expected = 3.0 * static_cast<double>(size_bytes(warp.order.type)) *
                          static_cast<double>(warp.grid.size.x) * static_cast<double>(warp.grid.size.y) *
                          static_cast<double>(warp.grid.size.z);
  const double size = static_cast<double>(std::filesystem::file_size(path)), offset = static_cast<double>(warp.offset);
  require(offset + expected <= (packed ? kDeflateAtMost * size : size),
          "truncated, or a header that promises too much (" + values + "), " + file + "; is the file whole?");
  require(packed || offset + expected == size,
          "bytes behind the values (" + values + "), " + file + "; expected none, is the file whole?");
}

Warp read_warp(const std::filesystem::path& path) {
  const std::string file = path.string();
  require_readable_file(path);
  Bytes bytes(path);
  const HeaderText text(bytes, file);
  Warp warp;
  parse_size(text, file, warp.grid);
  parse_offset(text, file, warp);
  parse_type(text, file, warp.order);
  require_holds(warp, bytes.is_packed(), path);
  parse_place(text, file, warp.grid);
  parse_layout(text, file, warp);
  return warp;
}

class MifReader final : public FieldReader {
 public:
  MifReader(FieldFileHeader header, std::filesystem::path path, const Warp& warp)
      : FieldReader(std::move(header)), path_(std::move(path)), order_(warp.order), offset_(warp.offset) {}

  void read(std::span<glm::vec3> displacement) const override {
    Bytes bytes(path_);
    bytes.skip(offset_);
    const AffineMap point = point_from_index(header_.grid);
    const glm::dmat3 rows = glm::transpose(point.linear);
    const glm::i64vec3 size = header_.grid.size;
    // The components of a vector may lie far apart, so each is taken by itself.
    const auto take = [&](std::size_t at, auto value) {
      const auto n = static_cast<std::int64_t>(at / 3);
      const auto c = static_cast<int>(at % 3);
      double mm = kLpsFromRas[c] * static_cast<double>(value);
      if (header_.absolute) {
        const glm::dvec3 index(n % size.x, n / size.x % size.y, n / (size.x * size.y));
        mm -= glm::dot(rows[c], index) + point.offset[c];
      }
      displacement[at / 3][c] = static_cast<float>(mm + 0.0);  // no -0
    };
    read_values(
        order_, [&](std::span<std::byte> next) { bytes.read(next); }, take);
    bytes.finish();
  }

 private:
  std::filesystem::path path_;
  ValueOrder order_;
  std::uint64_t offset_;
};

bool recognizes(const std::filesystem::path& path, std::string_view first_bytes) {
  const std::string name = lower(path.filename().string());
  return name.ends_with(".mif") || name.ends_with(".mif.gz") || name.ends_with(".mih") ||
         first_bytes.starts_with(kFirstLine);
}

void check_options(const FieldSource& source) {
  const std::string file = source.path.string();
  for (const auto& [key, value] : source.options) {
    const bool values = key == "values", frame = key == "frame";
    require(values || frame, "the option \"" + key + "\", " + file + "; expected values");
    require(!values || value == "displacements" || value == "positions",
            "values=" + value + ", " + file + "; expected displacements or positions");
    require(!frame || value == "ras",
            "frame=" + value + ", " + file + "; the vectors of MRtrix are in RAS, leave it out");
  }
  require(source.options.contains("values"), "a file that does not say whether it holds displacements or positions, " +
                                                 file + "; give " + file + ":values=displacements|positions");
}

std::unique_ptr<FieldReader> open(const FieldSource& source) {
  check_options(source);
  const Warp warp = read_warp(source.path);
  FieldFileHeader header;
  header.grid = warp.grid;
  header.format = "MIF, MRtrix warp";
  header.direction = Direction::pull;
  header.frame = "RAS";
  header.absolute = source.option("values") == "positions";
  header.direction_basis = header.frame_basis = header.units_basis = FieldBasis::by_format;
  header.absolute_basis = FieldBasis::by_option;
  return std::make_unique<MifReader>(std::move(header), source.path, warp);
}

}  // namespace

const FieldFormat kFieldFormat_mif = {recognizes, nullptr, check_options, open};

}  // namespace tetwarp
