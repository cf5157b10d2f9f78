// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/images/nifti_file.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <fstream>
#include <functional>
#include <utility>

#include "deform/errors.h"
#include "io/dicom_text.h"
#include "io/files/gzip_inflate.h"
#include "io/files/gzip_pieces.h"

namespace tetwarp {
namespace {

constexpr std::pair<int, VoxelType> kDatatypes[] = {
    {2, VoxelType::u8},    {256, VoxelType::i8}, {512, VoxelType::u16}, {4, VoxelType::i16},
    {768, VoxelType::u32}, {8, VoxelType::i32},  {16, VoxelType::f32},  {64, VoxelType::f64},
};

VoxelType disk_type(const NiftiHeader& header, const std::string& file) {
  for (const auto& [code, type] : kDatatypes) {
    if (code == header.datatype) return type;
  }
  constexpr std::pair<int, const char*> kRefused[] = {{1, "1 bit"},         {32, "complex64"},    {128, "RGB24"},
                                                      {1024, "int64"},      {1280, "uint64"},     {1536, "float128"},
                                                      {1792, "complex128"}, {2048, "complex256"}, {2304, "RGBA32"}};
  std::string name = "unknown type";
  for (const auto& [code, text] : kRefused) {
    if (code == header.datatype) name = text;
  }
  throw InputError("voxels of " + name + " (datatype " + std::to_string(header.datatype) + "), " + file +
                   "; expected integers of 8 to 32 bits, float32 or float64");
}

/// nifti1.h, "DATA SCALING": slope 0 (and, as niftilib has it, a slope that is not finite) means none.
bool has_slope(const NiftiHeader& header) { return std::isfinite(header.scl_slope) && header.scl_slope != 0; }

bool is_scaled(const NiftiHeader& header) {
  return has_slope(header) && (header.scl_slope != 1 || header.scl_inter != 0);
}

bool starts_like_gzip(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  char magic[2] = {};
  stream.read(magic, 2);
  return magic[0] == '\x1f' && magic[1] == '\x8b';
}

template <class V>
void reverse_bytes(std::span<V> values) {
  for (V& value : values) {
    auto* bytes = reinterpret_cast<std::byte*>(&value);
    std::reverse(bytes, bytes + sizeof(V));
  }
}

/// The values of an image as a file has them: one plane a component, each in pieces of `kGzipPieceBytes`.
class PlanePieces {
 public:
  struct Piece {
    std::size_t component, begin, count;  ///< of values, in the plane
  };

  PlanePieces(const Geometry& grid, std::size_t value_bytes, int components)
      : values_(static_cast<std::size_t>(voxel_count(grid))),
        step_(kGzipPieceBytes / value_bytes),
        per_plane_((values_ + step_ - 1) / step_),
        count_(per_plane_ * static_cast<std::size_t>(components)) {}

  std::size_t count() const { return count_; }
  Piece operator[](std::size_t i) const {
    const std::size_t begin = i % per_plane_ * step_;
    return {i / per_plane_, begin, std::min(step_, values_ - begin)};
  }

 private:
  std::size_t values_, step_, per_plane_, count_;
};

class NiftiReader final : public ImageReader {
 public:
  NiftiReader(const std::filesystem::path& path, ImageHeader image, StoredVoxels stored, NiftiHeader header,
              VoxelType disk)
      : ImageReader(path, std::move(image), stored), nifti_(std::move(header)), disk_(disk) {}

  void read(std::span<std::byte> voxels) const override {
    const PlainBytes plain =
        stored_.encoded ? inflate_at_once(path_, stored_.offset + value_count() * stored_.value_bytes) : PlainBytes{};
    if (!plain || !read_in_parallel(plain, voxels)) read_in_order(voxels);
  }

 private:
  /// With libdeflate. @return  false for a damaged file
  bool read_in_parallel(const PlainBytes& plain, std::span<std::byte> voxels) const {
    std::atomic<bool> good = true;
    const auto one = [&](std::size_t i) {
      if (good && !(i == 0 ? skip(plain) : read_piece(i - 1, plain, voxels))) good = false;
    };
    tbb::parallel_for(std::size_t{0}, pieces().count() + 1, one, tbb::simple_partitioner());
    return good;
  }

  /// What comes before the voxels is read for its CRC.
  bool skip(const PlainBytes& plain) const {
    std::vector<std::byte> piece(std::min<std::uint64_t>(stored_.offset, kGzipPieceBytes));
    for (std::uint64_t begin = 0, n = 0; begin < stored_.offset; begin += n) {
      n = std::min<std::uint64_t>(stored_.offset - begin, piece.size());
      if (!plain(begin, std::span(piece).first(static_cast<std::size_t>(n)))) return false;
    }
    return true;
  }

  /// Of a file that is not compressed, or by zlib. @throws InputError for a damaged file
  void read_in_order(std::span<std::byte> voxels) const {
    if (stored_.encoded) {
      GzipStream stream(path_);
      stream.skip(stored_.offset);
      read_pieces(voxels, [&](std::span<std::byte> bytes) { stream.read(bytes); });
      return stream.finish();
    }
    std::ifstream stream(path_, std::ios::binary);
    stream.seekg(static_cast<std::streamoff>(stored_.offset));
    read_pieces(voxels, [&](std::span<std::byte> bytes) {
      stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
      require(stream.good(), "truncated voxels, " + path_.string() + "; is the file whole?");
    });
  }

  void read_pieces(std::span<std::byte> voxels, const std::function<void(std::span<std::byte>)>& read) const {
    const PlainBytes next = [&](std::uint64_t, std::span<std::byte> bytes) {
      read(bytes);
      return true;
    };
    for (std::size_t i = 0; i < pieces().count(); ++i) read_piece(i, next, voxels);
  }

  PlanePieces pieces() const { return {header_.geometry, stored_.value_bytes, header_.components}; }

  bool read_piece(std::size_t i, const PlainBytes& plain, std::span<std::byte> voxels) const {
    bool read = false;
    dispatch(disk_, [&](auto v) { read = read_piece_as<decltype(v)>(i, plain, voxels); });
    return read;
  }

  /// NIfTI has one plane a component, one after the other; memory has the components of a voxel side by side.
  template <class Disk>
  bool read_piece_as(std::size_t i, const PlainBytes& plain, std::span<std::byte> voxels) const {
    using Scaled = std::conditional_t<std::is_same_v<Disk, double>, double, float>;
    const auto components = static_cast<std::size_t>(header_.components);
    const auto count = static_cast<std::size_t>(voxel_count(header_.geometry));
    const auto [c, begin, n] = pieces()[i];
    const bool scaled = is_scaled(nifti_), direct = !scaled && components == 1;
    std::vector<Disk> piece(direct ? 0 : n);
    const std::span values(direct ? reinterpret_cast<Disk*>(voxels.data()) + begin : piece.data(), n);
    if (!plain(stored_.offset + (c * count + begin) * sizeof(Disk), std::as_writable_bytes(values))) return false;
    if (nifti_.swapped) reverse_bytes(values);
    if (scaled) {
      scale(values.data(), n, reinterpret_cast<Scaled*>(voxels.data()) + begin * components + c, components);
    } else if (!direct) {
      auto* const to = reinterpret_cast<Disk*>(voxels.data()) + begin * components + c;
      for (std::size_t at = 0; at < n; ++at) to[at * components] = values[at];
    }
    return true;
  }

  template <class Disk, class Scaled>
  void scale(const Disk* values, std::size_t n, Scaled* to, std::size_t stride) const {
    for (std::size_t i = 0; i < n; ++i) {
      to[i * stride] = static_cast<Scaled>(static_cast<double>(values[i]) * nifti_.scl_slope + nifti_.scl_inter);
    }
  }

  NiftiHeader nifti_;
  VoxelType disk_;
};

/// What people have to know of the place of a file whose forms differ.
std::string note_of_forms(const NiftiHeader& header, NiftiFrame frame) {
  const bool by_sform = frame == NiftiFrame::sform;
  return "the sform (code " + std::to_string(header.sform_code) + ") and the qform (code " +
         std::to_string(header.qform_code) + ") lie up to " + number(*header.apart_mm) + " mm apart: placed by the " +
         (by_sform ? "sform, --nifti-frame qform takes the other" : "qform, as --nifti-frame says");
}

}  // namespace

int nifti_datatype(VoxelType type) {
  return std::ranges::find(kDatatypes, type, &std::pair<int, VoxelType>::second)->first;
}

std::unique_ptr<ImageReader> open_nifti(const std::filesystem::path& path, NiftiFrame frame, NiftiVectors vectors) {
  const std::string file = path.string();
  NiftiHeader header = read_nifti_header(path, vectors);
  const VoxelType disk = disk_type(header, file);
  require(!has_slope(header) || std::isfinite(header.scl_inter), "scl_slope " + std::to_string(header.scl_slope) +
                                                                     " beside a scl_inter that is no number, " + file +
                                                                     "; correct the header");
  const bool compressed = starts_like_gzip(path);
  require(!compressed || path.extension() != ".nii", "gzip data under a name in .nii, " + file + "; name it .nii.gz");
  ImageHeader image;
  image.geometry = place_of(header, frame, path);
  if (header.apart_mm) image.notes.push_back(note_of_forms(header, frame));
  image.components = header.components;
  image.type = disk;
  image.metadata["descrip"] = header.descrip;
  if (is_scaled(header)) {
    image.type = disk == VoxelType::f64 ? VoxelType::f64 : VoxelType::f32;
    image.metadata["scaled"] = to_string(image.type) + " from " + to_string(disk) + ", scl_slope " +
                               std::to_string(header.scl_slope) + ", scl_inter " + std::to_string(header.scl_inter);
  }
  require(header.vox_offset >= 348 && header.vox_offset < 1e9,
          "vox_offset " + std::to_string(header.vox_offset) + ", " + file + "; expected 352");
  const StoredVoxels stored{static_cast<std::uint64_t>(header.vox_offset), size_bytes(disk), compressed};
  return std::make_unique<NiftiReader>(path, std::move(image), stored, std::move(header), disk);
}

}  // namespace tetwarp
