// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "deform/errors.h"
#include "io/files/gzip_pieces.h"
#include "io/images/image_writer.h"
#include "io/images/nifti_file.h"
#include "io/images/nifti_forms.h"

namespace tetwarp {
namespace {

constexpr std::size_t kHeaderBytes = 352;  // 348, and four zeros: no extension follows
using Header = std::array<char, kHeaderBytes>;

/// The number at `offset` (nifti1.h), little endian as this machine is.
template <class T>
void put(Header& header, std::size_t offset, T value) {
  std::memcpy(header.data() + offset, &value, sizeof(T));
}

/// Both forms with code 1 (the scanner's), mm. Vectors have intent 1007, and the fifth axis.
Header make_header(const Geometry& grid, VoxelType type, int components, const std::string& descrip) {
  Header header{};
  const auto i16 = [&](std::size_t offset, std::int64_t value) {
    put(header, offset, static_cast<std::int16_t>(value));
  };
  put(header, 0, std::int32_t{348});
  header[38] = 'r';  // the field "regular", for readers of Analyze 7.5
  for (std::size_t n = 0; n < 8; ++n) i16(40 + 2 * n, 1);
  i16(40, components > 1 ? 5 : 3);
  for (int axis = 0; axis < 3; ++axis) i16(42 + 2 * static_cast<std::size_t>(axis), grid.size[axis]);
  if (components > 1) i16(50, components);
  constexpr int kVector = 1007;
  i16(68, components > 1 ? kVector : 0);
  i16(70, nifti_datatype(type));
  i16(72, static_cast<std::int64_t>(8 * size_bytes(type)));
  const NiftiForms forms = nifti_forms(grid);
  put(header, 76, forms.qfac);
  for (int axis = 0; axis < 3; ++axis)
    put(header, 80 + 4 * static_cast<std::size_t>(axis), static_cast<float>(grid.spacing[axis]));
  put(header, 108, static_cast<float>(kHeaderBytes));
  put(header, 112, 1.0f);  // slope; the intercept is 0
  header[123] = 2;         // millimetres
  descrip.copy(header.data() + 148, 79);
  i16(252, 1);
  i16(254, 1);
  for (std::size_t n = 0; n < 3; ++n) {
    put(header, 256 + 4 * n, forms.quatern[n]);
    put(header, 268 + 4 * n, forms.offset[n]);
    put(header, 280 + 16 * n, forms.srow[n]);
  }
  std::memcpy(header.data() + 344, "n+1", 4);
  return header;
}

/// One component of some slices, in the order of the file.
struct PlanePart {
  const ConstVolumeView& slices;
  std::size_t component;

  std::size_t values() const { return static_cast<std::size_t>(voxel_count(slices.buffered)); }
  /// Appends the values from `begin` on.
  void copy_to(std::vector<std::byte>& bytes, std::size_t begin, std::size_t count) const {
    const std::size_t width = size_bytes(slices.type), components = static_cast<std::size_t>(slices.components),
                      had = bytes.size();
    bytes.resize(had + count * width);
    const std::byte* from = slices.voxels + (begin * components + component) * width;
    for (std::size_t i = 0; i < count; ++i)
      std::memcpy(bytes.data() + had + i * width, from + i * components * width, width);
  }
  /// The bytes of some values: a view where the values lie side by side, else a copy in `scratch`.
  std::span<const std::byte> bytes(std::size_t begin, std::size_t count, std::vector<std::byte>& scratch) const {
    const std::size_t width = size_bytes(slices.type);
    if (slices.components == 1) return {slices.voxels + begin * width, count * width};
    scratch.clear();
    copy_to(scratch, begin, count);
    return scratch;
  }
};

/// NIfTI has one plane a component, one after the other.
class NiftiWriter : public ImageWriter {
 public:
  NiftiWriter(const std::filesystem::path& path, const Geometry& grid, VoxelType type, int components)
      : ImageWriter(path, grid, type, components),
        out_(path, std::ios::binary | std::ios::trunc),
        plane_values_(static_cast<std::size_t>(voxel_count(grid))),
        piece_values_(kGzipPieceBytes / size_bytes(type)) {
    if (!out_) fail();
  }

 protected:
  void close() override {
    out_.close();
    if (!out_) fail();
  }

  std::ofstream out_;
  std::size_t plane_values_, piece_values_;
};

class PlainNiftiWriter final : public NiftiWriter {
 public:
  using NiftiWriter::NiftiWriter;
  void begin(const Header& header) {
    out_.write(header.data(), header.size());
    if (!out_) fail();
  }

 private:
  void append(const ConstVolumeView& slices) override {
    const std::size_t width = size_bytes(type_);
    std::vector<std::byte> scratch;
    for (std::size_t c = 0; c < static_cast<std::size_t>(components_) && out_; ++c) {
      const PlanePart part{slices, c};
      if (components_ > 1) out_.seekp(static_cast<std::streamoff>(kHeaderBytes + (c * plane_values_ + done_) * width));
      for (std::size_t begin = 0; begin < part.values() && out_; begin += piece_values_) {
        const auto bytes = part.bytes(begin, std::min(piece_values_, part.values() - begin), scratch);
        out_.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
      }
    }
    if (!out_) fail();
    done_ += PlanePart{slices, 0}.values();
  }

  std::size_t done_ = 0;  ///< values of each plane
};

/// Each plane in members of `kGzipPieceBytes`, the last one shorter. The plane whose turn it is goes to the file, those
/// after it wait.
class GzipNiftiWriter final : public NiftiWriter {
 public:
  GzipNiftiWriter(const std::filesystem::path& path, const Geometry& grid, VoxelType type, int components, int level)
      : NiftiWriter(path, grid, type, components), level_(level), planes_(static_cast<std::size_t>(components)) {}
  void begin(const Header& header) {
    const auto all = [&](std::size_t, std::vector<std::byte>&) { return std::as_bytes(std::span(header)); };
    write_gzip(out_, 1, all, level_);
    if (!out_) fail();
  }

 private:
  struct Plane {
    std::size_t done = 0;          ///< values in members
    std::vector<std::byte> left;   ///< values that do not fill a member yet
    std::optional<Spool> waiting;  ///< members
  };

  std::size_t bytes_at_once() const override {
    constexpr int kPiecesOfThread = 2;
    return kPiecesOfThread * kGzipPieceBytes * planes_.size() *
           static_cast<std::size_t>(tbb::this_task_arena::max_concurrency());
  }

  void append(const ConstVolumeView& slices) override {
    for (std::size_t c = 0; c < planes_.size(); ++c) {
      Plane& plane = planes_[c];
      if (c != turn_ && !plane.waiting) plane.waiting.emplace(path_, "." + std::to_string(c));
      if (c == turn_ && plane.waiting) {
        plane.waiting->copy_to(out_);
        plane.waiting.reset();
      }
      std::ostream& out = plane.waiting ? plane.waiting->out() : out_;
      append_to(plane, {slices, c}, out);
      if (!out) fail();
      if (c == turn_ && plane.done == plane_values_) ++turn_;
    }
  }

  void append_to(Plane& plane, const PlanePart& part, std::ostream& out) const {
    const std::size_t left = plane.left.size() / size_bytes(type_), values = left + part.values();
    const bool last = plane.done + values == plane_values_;
    const std::size_t members = (values + (last ? piece_values_ - 1 : 0)) / piece_values_;
    const PieceSource piece = [&](std::size_t i, std::vector<std::byte>& scratch) -> std::span<const std::byte> {
      const std::size_t begin = i * piece_values_, count = std::min(piece_values_, values - begin);
      if (i > 0 || left == 0) return part.bytes(begin - std::min(begin, left), count, scratch);
      scratch = plane.left;
      part.copy_to(scratch, 0, count - left);
      return scratch;
    };
    write_gzip(out, members, piece, level_);
    const std::size_t taken = std::min(values, members * piece_values_), rest = std::min(values - taken, part.values());
    plane.done += taken;
    if (members > 0) plane.left.clear();
    part.copy_to(plane.left, part.values() - rest, rest);
  }

  int level_;
  std::vector<Plane> planes_;
  std::size_t turn_ = 0;  ///< the first plane that is not whole
};

}  // namespace

std::unique_ptr<ImageWriter> create_nifti(const std::filesystem::path& path, const Geometry& grid, VoxelType type,
                                          int components, const std::string& descrip, int level) {
  const std::string file = path.string();
  for (int axis = 0; axis < 3; ++axis) {
    require(grid.size[axis] <= INT16_MAX,
            "a size of " + to_string(grid.size) + ", " + file + "; NIfTI-1 holds up to 32767 an axis");
  }
  constexpr std::size_t kMostBytes = 64;
  require(static_cast<std::size_t>(components) * size_bytes(type) <= kMostBytes,
          std::to_string(components) + " values a voxel, " + file + "; NIfTI is written with 1 or 3");
  require(descrip.size() <= 79,
          "a description of " + std::to_string(descrip.size()) + " characters, " + file + "; NIfTI holds 79");
  const auto begun = [&](auto writer) -> std::unique_ptr<ImageWriter> {
    writer->begin(make_header(grid, type, components, descrip));
    return writer;
  };
  if (path.extension() == ".nii" || path.extension() == ".NII")
    return begun(std::make_unique<PlainNiftiWriter>(path, grid, type, components));
  return begun(std::make_unique<GzipNiftiWriter>(path, grid, type, components, level));
}

}  // namespace tetwarp
