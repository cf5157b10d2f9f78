// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/fields/field_mgz.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <glm/common.hpp>
#include <glm/vector_relational.hpp>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "deform/errors.h"
#include "io/files/gzip_inflate.h"
#include "io/images/image_reader.h"
#include "io/lower_case.h"
#include "io/ras.h"

namespace tetwarp {
namespace {

constexpr std::uint64_t kDataOffset = 284, kHeaderBytes = 90,  // of the voxels; of what is read of the header
    kScanBytes = 20;                                           // of what stands behind the voxels, before the tags
constexpr int kFloat = 3;                                      // MRI_FLOAT

// Tags of FreeSurfer (mri.h, tags.h). Some have no length.
constexpr std::int32_t kTagColours = 1, kTagSurfaceRas = 2, kTagGeometries = 10, kTagMorphType = 11, kTagLabels = 12,
                       kTagMeta = 13, kTagSheared = 15, kTagSurfaceGeometry = 20, kTagOldTransform = 30;

/// The bytes of a file, inflated where they are gzip data. Numbers are big-endian.
class Bytes {
 public:
  explicit Bytes(const std::filesystem::path& path) : name_(path.string()), file_(gzopen(path.c_str(), "rb"), gzclose) {
    require(file_ != nullptr, "cannot open, " + name_);
  }

  /// @return false at the end of the file, before any byte
  bool try_read(std::span<char> bytes) {
    std::size_t done = 0;
    while (done < bytes.size()) {
      const auto wanted = static_cast<unsigned>(std::min<std::size_t>(bytes.size() - done, 1U << 28));
      const int read = gzread(file_.get(), bytes.data() + done, wanted);
      require(read >= 0, "damaged gzip data, " + name_ + "; copy the file again");
      if (read == 0) {
        int error = Z_OK;
        gzerror(file_.get(), &error);
        require(error == Z_OK, "truncated gzip data, " + name_ + "; is the file whole?");
        break;
      }
      done += static_cast<std::size_t>(read);
    }
    require(done == 0 || done == bytes.size(), "truncated, " + name_ + "; is the file whole?");
    return done > 0;
  }
  void read(std::span<char> bytes) { require(try_read(bytes), "truncated, " + name_ + "; is the file whole?"); }

  template <class T>
  T number() {
    std::array<char, sizeof(T)> raw{};
    read(raw);
    return from_big_endian<T>(raw);
  }
  template <class T>
  static T from_big_endian(std::array<char, sizeof(T)> raw) {
    if (std::endian::native == std::endian::little) std::ranges::reverse(raw);
    return std::bit_cast<T>(raw);
  }
  glm::dvec3 vector() {
    glm::dvec3 v;
    for (int axis = 0; axis < 3; ++axis) v[axis] = static_cast<double>(number<float>());
    return v;
  }

  /// Goes on so many bytes. The last of them is read, for gzseek goes beyond the end without a word.
  void skip(std::uint64_t count) {
    if (count == 0) return;
    std::array<char, 1> last{};
    require(count < (std::uint64_t{1} << 40) && gzseek(file_.get(), static_cast<z_off_t>(count - 1), SEEK_CUR) >= 0,
            "truncated or damaged, " + name_);
    read(last);
  }

 private:
  std::string name_;
  std::unique_ptr<gzFile_s, int (*)(gzFile)> file_;
};

/// A volume's place as FreeSurfer has it: cosines, voxel size, and the RAS of the centre, at index size / 2.
Geometry geometry_of(const glm::i64vec3& size, const glm::dvec3& spacing, const glm::dmat3& cosines,
                     const glm::dvec3& centre) {
  Geometry grid;
  grid.size = size;
  grid.spacing = spacing;
  glm::dvec3 origin = centre;
  for (int axis = 0; axis < 3; ++axis) {
    grid.direction[axis] = kLpsFromRas * cosines[axis] + 0.0;
    origin -= cosines[axis] * (spacing[axis] * static_cast<double>(size[axis]) / 2);
  }
  grid.origin = kLpsFromRas * origin + 0.0;
  return grid;
}

/// What a file says.
struct Warp {
  Geometry grid;
  std::optional<std::int32_t> form;  ///< 0, 1: index of the source volume and its difference; 2, 3: the same in RAS mm
  std::optional<Geometry> source;    ///< grid of the volume that the warp takes its values from
};

glm::dmat3 read_cosines(Bytes& bytes) {
  glm::dmat3 cosines;
  for (int axis = 0; axis < 3; ++axis) cosines[axis] = bytes.vector();
  return cosines;
}

/// Reads one geometry of a tag. @return none where the file says that it is not valid
std::optional<Geometry> read_geometry(Bytes& bytes, bool sheared, const std::string& file) {
  constexpr std::size_t kNameBytes = 512;
  const bool valid = bytes.number<std::int32_t>() != 0;
  glm::i64vec3 size;
  for (int axis = 0; axis < 3; ++axis) size[axis] = bytes.number<std::int32_t>();
  const glm::dvec3 spacing = bytes.vector();
  const glm::dmat3 cosines = read_cosines(bytes);
  const glm::dvec3 centre = bytes.vector(), shear = sheared ? bytes.vector() : glm::dvec3(0);
  bytes.skip(kNameBytes);
  if (!valid) return std::nullopt;
  const bool straight = glm::all(glm::lessThanEqual(glm::abs(shear), glm::dvec3(1e-4)));  // beyond rounding
  require(straight, "a sheared volume, " + file + "; resample it onto an orthogonal grid");
  return geometry_of(size, spacing, cosines, centre);
}

/// Reads the geometries of the source and of the target. The target's is the volume's own.
/// @throws InputError where the target has another size: such a warp has a vertex only every few voxels, and its header
/// does not say where
void read_geometries(Bytes& bytes, bool sheared, const std::string& file, Warp& warp) {
  warp.source = read_geometry(bytes, sheared, file);
  const std::optional<Geometry> target = read_geometry(bytes, sheared, file);
  require(!target || target->size == warp.grid.size, [&] {
    return "a warp of " + to_string(warp.grid.size) + " vertices for a target volume of " + to_string(target->size) +
           " voxels, " + file + "; expected one a voxel, as mri_warp_convert writes for a warp of spacing 1";
  });
}

void read_tags(Bytes& bytes, const std::string& file, Warp& warp) {
  std::array<char, 4> raw{};
  while (bytes.try_read(raw)) {
    const auto tag = Bytes::from_big_endian<std::int32_t>(raw);
    if (tag == 0) return;
    if (tag == kTagGeometries || tag == kTagMorphType || tag == kTagLabels) {  // which have no length
      if (tag == kTagGeometries) read_geometries(bytes, false, file, warp);
      if (tag == kTagMorphType) bytes.number<std::int32_t>();
      if (tag == kTagLabels) bytes.skip(sizeof(std::int32_t) * static_cast<std::uint64_t>(voxel_count(warp.grid)));
      continue;
    }
    require(
        tag != kTagColours && tag != kTagSurfaceRas && tag != kTagSurfaceGeometry,
        "a tag " + std::to_string(tag) + " behind the vectors, " + file + "; expected a warp of FreeSurfer 7 or later");
    const auto length =
        tag == kTagOldTransform ? std::int64_t{bytes.number<std::int32_t>()} : bytes.number<std::int64_t>();
    require(length >= 0, "a tag of " + std::to_string(length) + " bytes, " + file);
    if (tag == kTagMeta) {
      require(length >= 4, "a tag 13 of " + std::to_string(length) + " bytes, " + file + "; expected at least 4");
      warp.form = bytes.number<std::int32_t>();
      bytes.skip(static_cast<std::uint64_t>(length) - 4);
    } else if (tag == kTagSheared) {
      read_geometries(bytes, true, file, warp);
    } else {
      bytes.skip(static_cast<std::uint64_t>(length));
    }
  }
}

std::uint64_t vector_bytes(const Geometry& grid) {
  return 3 * sizeof(float) * static_cast<std::uint64_t>(grid.size.x * grid.size.y * grid.size.z);
}

Warp read_warp(const std::filesystem::path& path) {
  const std::string file = path.string();
  require_readable_file(path);
  Bytes bytes(path);
  const auto version = bytes.number<std::int32_t>();
  require((version & 0xff) == 1,
          "not an MGH file (version " + std::to_string(version & 0xff) + ", expected 1), " + file);
  constexpr int kInverseWarp = 4;  // MGZ_INTENT_WARPMAP_INV
  require((version >> 8 & 0xffff) != kInverseWarp,
          "an inverse warp (intent 4), " + file + "; invert it with mri_warp_convert");
  Warp warp;
  glm::i64vec3 size;
  for (int axis = 0; axis < 3; ++axis) {
    size[axis] = bytes.number<std::int32_t>();
    require(size[axis] >= 1 && size[axis] <= 1'000'000,
            "a size of " + std::to_string(size[axis]) + " on axis " + std::to_string(axis) + ", " + file);
  }
  const auto frames = bytes.number<std::int32_t>(), type = bytes.number<std::int32_t>();
  require(frames == 3 && type == kFloat, "no warp but " + std::to_string(frames) + " frames of type " +
                                             std::to_string(type) + ", " + file + "; expected 3 frames of float (3)");
  bytes.number<std::int32_t>();  // degrees of freedom
  require(bytes.number<std::int16_t>() > 0, "no place (goodRASFlag 0), " + file);
  const glm::dvec3 spacing = bytes.vector();
  const glm::dmat3 cosines = read_cosines(bytes);
  warp.grid = geometry_of(size, spacing, cosines, bytes.vector());
  require_valid(warp.grid, file);
  const double held = kDeflateAtMost * static_cast<double>(std::filesystem::file_size(path));
  require(static_cast<double>(vector_bytes(warp.grid)) <= held, "a header that promises too much, " + file);
  bytes.skip(kDataOffset - kHeaderBytes + vector_bytes(warp.grid) + kScanBytes);
  read_tags(bytes, file, warp);
  require(warp.form.has_value(), "the form of the vectors is not stated (tag 13), " + file +
                                     "; expected a warp of FreeSurfer 7 or later, such as mri_synthmorph writes");
  require(*warp.form >= 0 && *warp.form <= 3,
          "vectors of the form " + std::to_string(*warp.form) + ", " + file + "; expected 0 to 3");
  require(*warp.form >= 2 || warp.source.has_value(), "the place of the source volume is not stated, " + file);
  if (warp.source) require_valid(*warp.source, "the source volume of " + file);
  return warp;
}

class MgzReader final : public FieldReader {
 public:
  MgzReader(FieldFileHeader header, std::filesystem::path path, const Warp& warp)
      : FieldReader(std::move(header)), path_(std::move(path)) {
    if (header_.frame == "index") point_from_source_ = point_from_index(*warp.source);
  }

  void read(std::span<glm::vec3> displacement) const override {
    Bytes bytes(path_);
    bytes.skip(kDataOffset);
    std::vector<char> plane(sizeof(float) * static_cast<std::size_t>(header_.grid.size.x * header_.grid.size.y));
    for (int component = 0; component < 3; ++component) {
      std::size_t vertex = 0;
      for (std::int64_t k = 0; k < header_.grid.size.z; ++k) {
        bytes.read(plane);
        for (std::size_t at = 0; at < plane.size(); at += sizeof(float), ++vertex) {
          std::array<char, sizeof(float)> raw{};
          std::copy_n(plane.begin() + static_cast<std::ptrdiff_t>(at), raw.size(), raw.begin());
          displacement[vertex][component] = Bytes::from_big_endian<float>(raw);
        }
      }
    }
    const AffineMap point = point_from_index(header_.grid);
    const glm::i64vec3 size = header_.grid.size;
    for (std::size_t v = 0; v < displacement.size(); ++v) {
      const auto n = static_cast<std::int64_t>(v);
      const glm::dvec3 index(n % size.x, n / size.x % size.y, n / (size.x * size.y));
      displacement[v] = glm::vec3(in_lps(glm::dvec3(displacement[v]), index, point(index)) + 0.0);  // no -0
    }
  }

 private:
  /// The displacement of a vector of the file. Infinity times zero would give NaN, so an infinite one stays.
  glm::dvec3 in_lps(const glm::dvec3& vector, const glm::dvec3& index, const glm::dvec3& point) const {
    if (std::isinf(vector.x) || std::isinf(vector.y) || std::isinf(vector.z)) return vector;
    if (header_.frame == "index") return point_from_source_(header_.absolute ? vector : index + vector) - point;
    return kLpsFromRas * vector - (header_.absolute ? point : glm::dvec3(0));
  }

  std::filesystem::path path_;
  AffineMap point_from_source_;
};

bool recognizes(const std::filesystem::path& path, std::string_view) {
  const std::string suffix = lower(path.extension().string());
  return suffix == ".mgz" || suffix == ".mgh";
}

std::unique_ptr<FieldReader> open(const FieldSource& source) {
  const Warp warp = read_warp(source.path);
  FieldFileHeader header;
  header.grid = warp.grid;
  header.format = "MGH, FreeSurfer warp";
  header.direction = Direction::pull;
  header.frame = *warp.form < 2 ? "index" : "RAS";
  header.units = *warp.form < 2 ? "voxel" : "mm";
  header.absolute = *warp.form % 2 == 0;
  header.direction_basis = FieldBasis::by_format;
  header.frame_basis = header.units_basis = header.absolute_basis = FieldBasis::stated;
  return std::make_unique<MgzReader>(std::move(header), source.path, warp);
}

}  // namespace

const FieldFormat kFieldFormat_mgz = {recognizes, nullptr, nullptr, open};

}  // namespace tetwarp
