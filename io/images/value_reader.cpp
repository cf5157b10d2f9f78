// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/images/value_reader.h"

#include <tbb/parallel_for.h>
#include <zlib.h>

#include <algorithm>
#include <atomic>
#include <fstream>
#include <vector>

#include "deform/errors.h"
#include "io/files/gzip_inflate.h"
#include "io/files/gzip_pieces.h"
#include "io/images/text_values.h"

namespace tetwarp {
namespace {

class ValueReader final : public ImageReader {
 public:
  ValueReader(const std::filesystem::path& path, ImageHeader header, const StoredVoxels& stored,
              const ValueLayout& layout)
      : ImageReader(path, std::move(header), stored), layout_(layout) {}

  void read(std::span<std::byte> voxels) const override {
    switch (layout_.encoding) {
      case Encoding::raw: read_raw(voxels); break;
      case Encoding::zlib: read_zlib(voxels); break;
      case Encoding::gzip: read_gzip(voxels); break;
      case Encoding::text: read_text(voxels); break;
      case Encoding::hex: read_hex(voxels); break;
      case Encoding::bzip2:
        throw InputError("unreadable voxels (in bzip2), " + path_.string() + "; compress them with gzip instead");
    }
    if (layout_.big_endian && layout_.encoding != Encoding::text) reverse_values(voxels);
    if (layout_.plane_count > 1 && header_.components > 1) interleave(voxels);
  }

 private:
  std::ifstream open() const {
    std::ifstream stream(path_, std::ios::binary);
    stream.seekg(static_cast<std::streamoff>(stored_.offset));
    require(stream.good(), "cannot open, " + path_.string());
    return stream;
  }

  void read_raw(std::span<std::byte> voxels) const {
    std::ifstream stream = open();
    stream.read(reinterpret_cast<char*>(voxels.data()), static_cast<std::streamsize>(voxels.size()));
    require(stream.good(), "truncated voxels, " + path_.string() + "; is the file whole?");
  }

  void read_zlib(std::span<std::byte> voxels) const {
    std::ifstream stream = open();
    z_stream inflater{};
    if (inflateInit(&inflater) != Z_OK) throw Error("zlib: inflateInit failed");
    const std::unique_ptr<z_stream, int (*)(z_stream*)> end(&inflater, inflateEnd);
    std::vector<char> input(std::size_t{1} << 18);
    int status = Z_OK;
    for (std::size_t done = 0; status == Z_OK;) {
      if (inflater.avail_in == 0) {
        stream.read(input.data(), static_cast<std::streamsize>(input.size()));
        inflater.next_in = reinterpret_cast<Bytef*>(input.data());
        inflater.avail_in = static_cast<uInt>(stream.gcount());
      }
      const std::size_t room = std::min(voxels.size() - done, std::size_t{1} << 30);
      inflater.next_out = reinterpret_cast<Bytef*>(voxels.data() + done);
      inflater.avail_out = static_cast<uInt>(room);
      status = inflate(&inflater, Z_NO_FLUSH);
      done += room - inflater.avail_out;
    }
    const std::string file = path_.string();
    require(status == Z_STREAM_END, std::string("truncated or damaged voxels (") +
                                        (inflater.msg ? inflater.msg : "the stream does not end with them") + "), " +
                                        file + "; is the file whole?");
    require(inflater.total_out == voxels.size(), std::to_string(inflater.total_out) + " bytes of voxels, " + file +
                                                     "; the header says " + std::to_string(voxels.size()));
    require(inflater.avail_in == 0 && stream.peek() == std::char_traits<char>::eof(),
            "bytes behind the compressed voxels, " + file + "; expected none, is the file whole?");
  }

  void read_text(std::span<std::byte> voxels) const {
    std::ifstream stream = open();
    read_decimal_values(stream, header_.type, voxels, path_.string());
  }

  void read_hex(std::span<std::byte> voxels) const {
    std::ifstream stream = open();
    read_hexadecimal_bytes(stream, voxels, path_.string());
  }

  void read_gzip(std::span<std::byte> voxels) const {
    if (const PlainBytes plain = inflate_at_once(path_, layout_.skip + voxels.size(), stored_.offset);
        plain && read_in_parallel(plain, voxels))
      return;
    GzipStream stream(path_, stored_.offset);
    stream.skip(layout_.skip);
    stream.read(voxels);
    stream.finish();
  }

  /// @return  false for a damaged file. What is skipped is read too, for its check sums
  bool read_in_parallel(const PlainBytes& plain, std::span<std::byte> voxels) const {
    const std::uint64_t size = layout_.skip + voxels.size();
    std::atomic<bool> good = true;
    tbb::parallel_for(std::uint64_t{0}, (size + kGzipPieceBytes - 1) / kGzipPieceBytes, [&](std::uint64_t i) {
      const std::uint64_t begin = i * kGzipPieceBytes, end = std::min<std::uint64_t>(begin + kGzipPieceBytes, size);
      if (begin >= layout_.skip) {
        const auto part = voxels.subspan(static_cast<std::size_t>(begin - layout_.skip), end - begin);
        if (!plain(begin, part)) good = false;
        return;
      }
      std::vector<std::byte> part(static_cast<std::size_t>(end - begin));
      if (!plain(begin, part)) good = false;
      if (end > layout_.skip)
        std::copy(part.end() - static_cast<std::ptrdiff_t>(end - layout_.skip), part.end(), voxels.begin());
    });
    return good;
  }

  void reverse_values(std::span<std::byte> voxels) const {
    const std::size_t bytes = stored_.value_bytes;
    for (std::size_t at = 0; at < voxels.size(); at += bytes)
      std::reverse(voxels.data() + at, voxels.data() + at + bytes);
  }

  /// From planes of components to the components of a voxel side by side.
  void interleave(std::span<std::byte> voxels) const {
    const std::vector<std::byte> planes(voxels.begin(), voxels.end());
    const std::size_t bytes = stored_.value_bytes, per_plane = layout_.plane_count,
                      components = static_cast<std::size_t>(header_.components);
    const std::byte* from = planes.data();
    for (std::size_t begin = 0; begin < voxels.size(); begin += per_plane * components * bytes) {
      for (std::size_t c = 0; c < components; ++c) {
        for (std::size_t n = 0; n < per_plane; ++n, from += bytes)
          std::copy_n(from, bytes, voxels.data() + begin + (n * components + c) * bytes);
      }
    }
  }

  ValueLayout layout_;
};

}  // namespace

std::unique_ptr<ImageReader> make_value_reader(const std::filesystem::path& path, ImageHeader header,
                                               const StoredVoxels& stored, const ValueLayout& layout) {
  return std::make_unique<ValueReader>(path, std::move(header), stored, layout);
}

}  // namespace tetwarp
