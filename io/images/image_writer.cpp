// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/images/image_writer.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "deform/errors.h"

namespace tetwarp {
namespace {

constexpr std::size_t kBufferBytes = std::size_t{1} << 18;

/// Compresses what it is given as one stream: a zlib one (RFC 1950) as MetaIO has it, or a gzip one (RFC 1952) as
/// NRRD's library has it. The bytes are the same for any split.
class Deflater {
 public:
  Deflater(std::ostream& out, int level, bool gzip) : out_(out), gzip_(gzip), buffer_(kBufferBytes) {
    constexpr int kMemory = 8;  // zlib's default
    if (deflateInit2(&stream_, level, Z_DEFLATED, gzip ? -MAX_WBITS : MAX_WBITS, kMemory, Z_DEFAULT_STRATEGY) != Z_OK)
      throw Error("zlib: deflateInit2 failed");
    constexpr std::array<char, 10> kGzipHeader = {'\x1f', '\x8b', Z_DEFLATED, 0, 0, 0, 0, 0, 0, 3};  // 3: Unix
    if (gzip) out_.write(kGzipHeader.data(), kGzipHeader.size());
  }
  ~Deflater() { deflateEnd(&stream_); }
  Deflater(const Deflater&) = delete;
  Deflater& operator=(const Deflater&) = delete;

  void append(std::span<const std::byte> bytes) {
    constexpr std::size_t kMost = std::size_t{1} << 30;  // zlib counts in 32 bits
    for (std::size_t begin = 0; begin < bytes.size() && out_; begin += kMost) {
      const auto part = bytes.subspan(begin, std::min(kMost, bytes.size() - begin));
      if (gzip_) crc_ = crc32(crc_, reinterpret_cast<const Bytef*>(part.data()), static_cast<uInt>(part.size()));
      deflate_all(part, Z_NO_FLUSH);
    }
  }
  void finish() {
    deflate_all({}, Z_FINISH);
    if (!gzip_) return;
    put_u32(crc_);
    put_u32(stream_.total_in);
  }
  std::uint64_t deflated_bytes() const { return stream_.total_out; }

 private:
  void deflate_all(std::span<const std::byte> bytes, int flush) {
    stream_.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(bytes.data()));
    stream_.avail_in = static_cast<uInt>(bytes.size());
    do {
      stream_.next_out = reinterpret_cast<Bytef*>(buffer_.data());
      stream_.avail_out = static_cast<uInt>(buffer_.size());
      deflate(&stream_, flush);
      out_.write(buffer_.data(), static_cast<std::streamsize>(buffer_.size() - stream_.avail_out));
    } while (stream_.avail_out == 0 && out_);
  }
  void put_u32(std::uint64_t value) {
    for (int shift = 0; shift < 32; shift += 8) out_.put(static_cast<char>(value >> shift & 0xff));
  }

  std::ostream& out_;
  bool gzip_;
  z_stream stream_{};
  uLong crc_ = 0;
  std::vector<char> buffer_;
};

class TextImageWriter final : public ImageWriter {
 public:
  TextImageWriter(const std::filesystem::path& path, ImageFormat format, const Geometry& grid, VoxelType type,
                  int components, std::string header, int level)
      : ImageWriter(path, grid, type, components),
        header_(std::move(header)),
        out_(path, std::ios::binary | std::ios::trunc) {
    if (!out_) fail();
    const bool mha = format == ImageFormat::mha;
    if (level > 0 && mha) waiting_.emplace(path, ".voxels");
    if (!waiting_) out_ << header_;
    if (level > 0) deflater_.emplace(waiting_ ? waiting_->out() : out_, level, !mha);
  }

 private:
  void append(const ConstVolumeView& slices) override {
    const std::size_t bytes = static_cast<std::size_t>(voxel_count(slices.buffered)) *
                              static_cast<std::size_t>(components_) * size_bytes(type_);
    if (deflater_)
      deflater_->append({slices.voxels, bytes});
    else
      out_.write(reinterpret_cast<const char*>(slices.voxels), static_cast<std::streamsize>(bytes));
    if (!out_ || (waiting_ && !waiting_->out())) fail();
  }

  void close() override {
    if (deflater_) deflater_->finish();
    if (waiting_) {
      set_text_field(header_, "CompressedDataSize = ", std::to_string(deflater_->deflated_bytes()));
      out_ << header_;
      waiting_->copy_to(out_);
    }
    out_.close();
    if (!out_) fail();
  }

  std::string header_;
  std::ofstream out_;
  std::optional<Spool> waiting_;  ///< compressed voxels of MHA, whose size the header states
  std::optional<Deflater> deflater_;
};

}  // namespace

Spool::Spool(const std::filesystem::path& beside, const std::string& suffix) {
  const std::filesystem::path path = beside.string() + suffix;
  file_.open(path, std::ios::in | std::ios::out | std::ios::binary | std::ios::trunc);
  std::error_code error;
  if (!file_ || !std::filesystem::remove(path, error))
    throw Error("cannot write beside, " + beside.string() + "; check folder, rights and free space");
}

void Spool::copy_to(std::ostream& to) {
  file_.flush();
  file_.seekg(0);
  if (!file_) to.setstate(std::ios::failbit);
  std::vector<char> buffer(kBufferBytes);
  while (to && file_) {
    file_.read(buffer.data(), static_cast<std::streamsize>(buffer.size()));
    to.write(buffer.data(), file_.gcount());
  }
  if (!file_.eof()) to.setstate(std::ios::failbit);
}

std::unique_ptr<ImageWriter> create_text_image(const std::filesystem::path& path, ImageFormat format,
                                               const Geometry& grid, VoxelType type, int components, std::string header,
                                               int level) {
  return std::make_unique<TextImageWriter>(path, format, grid, type, components, std::move(header), level);
}

void set_text_field(std::string& header, const std::string& name, const std::string& value) {
  const std::size_t line = header.starts_with(name) ? 0 : header.find("\n" + name);
  if (line == std::string::npos) throw Error("a header without the field \"" + name + "\"");
  const std::size_t begin = line + name.size() + (line == 0 ? 0 : 1);
  header.replace(begin, header.find('\n', begin) - begin, value);
}

}  // namespace tetwarp
