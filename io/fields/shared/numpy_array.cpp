// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/fields/shared/numpy_array.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "deform/errors.h"
#include "io/fields/shared/ordered_values.h"
#include "io/images/image_reader.h"

namespace tetwarp {
namespace {

constexpr std::string_view kMagic = "\x93NUMPY";
constexpr std::size_t kLongestHeader = 10'000;  // bytes of the header's text; NumPy itself reads no longer one

std::uint32_t little_endian(std::string_view bytes) {
  std::uint32_t value = 0;
  for (std::size_t i = bytes.size(); i-- > 0;) value = value << 8 | static_cast<unsigned char>(bytes[i]);
  return value;
}

std::string_view without_spaces(std::string_view text) {
  return text.substr(std::min(text.find_first_not_of(' '), text.size()));
}

/// The text behind `'key':` in the header's dictionary. @throws InputError where the key is missing
std::string_view value_of(std::string_view dictionary, const std::string& key, const std::string& file) {
  const std::size_t at = dictionary.find("'" + key + "'");
  const std::string missing = "a header without '" + key + "', " + file + "; expected a .npy file as NumPy writes it";
  require(at != std::string_view::npos, missing);
  const std::string_view rest = without_spaces(dictionary.substr(at + key.size() + 2));
  require(rest.starts_with(':'), missing);
  return without_spaces(rest.substr(1));
}

void parse_type(std::string_view value, const std::string& file, NumpyArray& array) {
  const std::string_view code = value.substr(0, std::min(value.find_first_of(",}"), value.size()));
  constexpr std::array<const char*, 4> kCodes = {"'<f4'", "'>f4'", "'<f8'", "'>f8'"};
  const auto* found =
      std::find_if(kCodes.begin(), kCodes.end(), [&](const char* known) { return value.starts_with(known); });
  require(found != kCodes.end(), "an array of type " + std::string(code.substr(0, 40)) + ", " + file +
                                     "; expected float32 or float64 ('<f4', '>f4', '<f8' or '>f8')");
  const auto n = found - kCodes.begin();
  array.big_endian = n % 2 == 1;
  array.type = n < 2 ? VoxelType::f32 : VoxelType::f64;
}

void parse_shape(std::string_view value, const std::string& file, NumpyArray& array) {
  const std::size_t end = value.find(')');
  require(value.starts_with('(') && end != std::string_view::npos, "a header without a whole 'shape', " + file);
  const std::string text(value.substr(0, end + 1));
  std::size_t axes = 0;
  for (std::string_view rest = without_spaces(std::string_view(text).substr(1)); rest != ")"; ++axes) {
    std::int64_t size = 0;
    const auto [stop, error] = std::from_chars(rest.data(), rest.data() + rest.size(), size);
    require(error == std::errc() && size >= 1,
            "the shape " + text + ", " + file + "; expected at least 1 on every axis");
    rest = without_spaces(rest.substr(static_cast<std::size_t>(stop - rest.data())));
    if (rest.starts_with('L')) rest = without_spaces(rest.substr(1));  // a long integer of Python 2, "42L"
    if (rest.starts_with(',')) rest = without_spaces(rest.substr(1));
    if (axes < 4) array.shape[axes] = size;
  }
  require(axes == 4 && array.shape[3] == 3, "an array of shape " + text + ", " + file +
                                                "; expected three axes of the grid and then 3 components" +
                                                (axes == 4 && array.shape[0] == 3 ? ": numpy.moveaxis(a, 0, -1)" : ""));
}

/// Refuses an array that does not end where its values do.
void require_fits(const NumpyArray& array, std::uint64_t bytes, const std::string& name) {
  double expected = static_cast<double>(size_bytes(array.type));
  for (const std::int64_t size : array.shape) expected *= static_cast<double>(size);
  const double held = static_cast<double>(bytes) - static_cast<double>(array.offset);
  std::string text;
  for (const std::int64_t size : array.shape) text += (text.empty() ? "" : " x ") + std::to_string(size);
  require(held == expected, std::string(held < expected ? "truncated, or a header that promises too much, "
                                                        : "bytes behind the array, ") +
                                name + ": " + std::to_string(static_cast<std::int64_t>(held)) +
                                " bytes of values, but " + text + " x " + to_string(array.type) + " are expected");
}

FieldFileHeader describe(const FieldSource& source, const NumpyArray& array, const std::string& format) {
  FieldFileHeader header;
  const auto& shape = array.shape;
  header.grid.size = source.option("order") == "xyz" ? glm::i64vec3(shape[0], shape[1], shape[2])
                                                     : glm::i64vec3(shape[2], shape[1], shape[0]);
  header.has_own_grid = false;
  header.format = format;
  header.units = source.option("units");
  header.frame = header.units == "voxel" ? "index" : source.option("frame", "lps") == "ras" ? "RAS" : "LPS";
  header.units_basis = FieldBasis::by_option;
  header.frame_basis =
      header.units == "voxel" || source.options.contains("frame") ? FieldBasis::by_option : FieldBasis::assumed;
  if (!source.grid) return header;
  const glm::i64vec3 size = header.grid.size, wanted = source.grid->size;
  const std::string other = source.option("order") == "xyz" ? "zyx" : "xyz";
  require(size == wanted,
          "a field of " + to_string(size) + " vertices for a volume of " + to_string(wanted) + " voxels, " +
              source.path.string() + "; an array has one vertex a voxel" +
              (glm::i64vec3(size.z, size.y, size.x) == wanted ? ": with order=" + other + " it fits" : ""));
  header.grid = *source.grid;
  return header;
}

class NumpyReader final : public FieldReader {
 public:
  NumpyReader(const FieldSource& source, FieldFileHeader header, const NumpyArray& array,
              std::function<std::unique_ptr<std::istream>()> open)
      : FieldReader(std::move(header)),
        path_(source.path),
        array_(array),
        open_(std::move(open)),
        placed_(source.grid.has_value()),
        order_xyz_(source.option("order") == "xyz"),
        components_xyz_(source.option("components", "xyz") == "xyz") {}

  void read(std::span<glm::vec3> displacement) const override {
    require(placed_,
            "a field without a grid, " + path_.string() + "; an array lies where the volume does: give its grid");
    const std::unique_ptr<std::istream> stream = open_();
    stream->seekg(static_cast<std::streamoff>(array_.offset));
    const auto next = [&](std::span<std::byte> bytes) {
      stream->read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
      require(stream->good(), "truncated or damaged values, " + path_.string() + "; is the file whole?");
    };
    auto* const floats = reinterpret_cast<float*>(displacement.data());
    read_values(value_order(), next, [&](std::size_t at, auto value) { floats[at] = static_cast<float>(value); });
    if (header_.frame == "LPS") return;
    const glm::dmat3 mm =
        header_.frame == "RAS" ? glm::dmat3(-1, 0, 0, 0, -1, 0, 0, 0, 1) : point_from_index(header_.grid).linear;
    for (glm::vec3& d : displacement) {
      // Infinity times zero would give NaN, so an infinite vector stays.
      const bool infinite = std::isinf(d.x) || std::isinf(d.y) || std::isinf(d.z);
      if (!infinite) d = glm::vec3(mm * glm::dvec3(d) + 0.0);  // + 0.0 makes 0 of -0
    }
  }

 private:
  ValueOrder value_order() const {
    const auto x = static_cast<std::ptrdiff_t>(header_.grid.size.x),
               y = static_cast<std::ptrdiff_t>(header_.grid.size.y);
    std::array<std::ptrdiff_t, 4> steps = {3, 3 * x, 3 * x * y, components_xyz_ ? 1 : -1};
    if (!order_xyz_) std::swap(steps[0], steps[2]);
    ValueOrder order;
    order.type = array_.type;
    order.big_endian = array_.big_endian;
    for (std::size_t axis = 0; axis < steps.size(); ++axis)
      order.axes[axis] = {static_cast<std::size_t>(array_.shape[axis]), steps[axis]};
    if (array_.fortran) std::ranges::reverse(order.axes);
    return order;
  }

  std::filesystem::path path_;
  NumpyArray array_;
  std::function<std::unique_ptr<std::istream>()> open_;
  bool placed_, order_xyz_, components_xyz_;
};

}  // namespace

NumpyArray read_numpy_header(std::istream& stream, std::uint64_t bytes, const std::string& name) {
  std::string start(12, '\0');
  stream.read(start.data(), static_cast<std::streamsize>(start.size()));
  require(stream.good() && start.starts_with(kMagic), "not a .npy file (it does not begin with \\x93NUMPY), " + name);
  const int version = static_cast<unsigned char>(start[6]);
  require(version >= 1 && version <= 3,
          "version " + std::to_string(version) + " of .npy, " + name + "; expected 1, 2 or 3");
  const std::size_t prefix = version == 1 ? 10 : 12;
  const std::size_t length = little_endian(std::string_view(start).substr(8, prefix - 8));
  require(length <= kLongestHeader, "a header of " + std::to_string(length) + " bytes, " + name +
                                        "; expected at most " + std::to_string(kLongestHeader));
  std::string dictionary(length, '\0');
  stream.seekg(static_cast<std::streamoff>(prefix));
  stream.read(dictionary.data(), static_cast<std::streamsize>(length));
  require(stream.good(), "a header that ends early, " + name + "; is the file whole?");
  NumpyArray array;
  array.offset = prefix + length;
  parse_type(value_of(dictionary, "descr", name), name, array);
  const std::string_view fortran = value_of(dictionary, "fortran_order", name);
  array.fortran = fortran.starts_with("True");
  require(array.fortran || fortran.starts_with("False"), "a 'fortran_order' that is neither True nor False, " + name);
  parse_shape(value_of(dictionary, "shape", name), name, array);
  require_fits(array, bytes, name);
  return array;
}

void check_numpy_options(const FieldSource& source, const std::string& more) {
  struct Known {
    const char *key, *first, *second;
  };
  constexpr std::array<Known, 4> kKnown = {
      {{"order", "zyx", "xyz"}, {"units", "mm", "voxel"}, {"components", "xyz", "zyx"}, {"frame", "lps", "ras"}}};
  const std::string file = source.path.string();
  for (const auto& [key, value] : source.options) {
    const auto* known =
        std::find_if(kKnown.begin(), kKnown.end(), [&name = key](const Known& k) { return k.key == name; });
    require(known != kKnown.end(),
            "the option \"" + key + "\", " + file + "; expected order, units, components, frame" + more);
    require(value == known->first || value == known->second,
            key + "=" + value + ", " + file + "; expected " + known->first + " or " + known->second);
  }
  require(source.options.contains("order") && source.options.contains("units"),
          "an array does not say the order of its axes and the units of its values, " + file + "; give both: " + file +
              ":order=zyx|xyz,units=mm|voxel[,components=xyz|zyx][,frame=lps|ras]");
  require(source.option("units") == "mm" || !source.options.contains("frame"),
          "a frame for voxels, " + file + "; they are along the grid's i, j, k");
}

std::unique_ptr<FieldReader> numpy_reader(const FieldSource& source, const NumpyArray& array, const std::string& format,
                                          std::function<std::unique_ptr<std::istream>()> open) {
  return std::make_unique<NumpyReader>(source, describe(source, array, format), array, std::move(open));
}

}  // namespace tetwarp
