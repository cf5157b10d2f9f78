// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <zlib.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <limits>
#include <vector>

#include "deform/errors.h"
#include "io/files/gzip_inflate.h"

namespace tetwarp {

namespace {

constexpr std::size_t kBufferBytes = std::size_t{1} << 18;
constexpr int kGzipOnly = MAX_WBITS + 16;

}  // namespace

struct GzipStream::State {
  std::string file;
  std::ifstream stream;
  std::vector<Bytef> buffer = std::vector<Bytef>(kBufferBytes);
  z_stream zlib{};
  bool in_member = false, any_member = false;

  [[noreturn]] void fail(const std::string& why) const {
    throw InputError("truncated or damaged voxels (" + why + "), " + file + "; is the file whole?");
  }

  /// Moves bytes that were read and not used to the front of the buffer, and reads the file's next bytes behind them.
  void fill() {
    std::copy_n(zlib.next_in, zlib.avail_in, buffer.begin());
    stream.read(reinterpret_cast<char*>(buffer.data()) + zlib.avail_in,
                static_cast<std::streamsize>(buffer.size() - zlib.avail_in));
    zlib.next_in = buffer.data();
    zlib.avail_in += static_cast<uInt>(stream.gcount());
  }

  /// Begins the next member, when the one before it has ended. @return false at the end of the file
  bool begin_member() {
    if (zlib.avail_in < 2) fill();
    const bool is_member = zlib.avail_in >= 2 && zlib.next_in[0] == Bytef{0x1f} && zlib.next_in[1] == Bytef{0x8b};
    if (is_member) {
      if (inflateReset(&zlib) != Z_OK) throw Error("zlib: inflateReset failed");
      return in_member = any_member = true;
    }
    if (!any_member) fail("no gzip data begin there");
    while (zlib.avail_in > 0) {
      if (std::any_of(zlib.next_in, zlib.next_in + zlib.avail_in, [](Bytef byte) { return byte != 0; }))
        fail("bytes that are no gzip data follow them");
      zlib.avail_in = 0;
      fill();
    }
    return false;
  }

  /// Inflates one byte or more. @return how many; 0 behind the last member
  std::size_t read_some(std::span<std::byte> bytes) {
    const auto room = static_cast<uInt>(std::min<std::size_t>(bytes.size(), std::numeric_limits<uInt>::max()));
    zlib.next_out = reinterpret_cast<Bytef*>(bytes.data());
    zlib.avail_out = room;
    while (zlib.avail_out == room) {
      if (!in_member && !begin_member()) return 0;
      if (zlib.avail_in == 0) fill();
      if (zlib.avail_in == 0) fail("the file ends early");
      const int status = inflate(&zlib, Z_NO_FLUSH);
      if (status == Z_STREAM_END)
        in_member = false;  // zlib has compared CRC and length
      else if (status != Z_OK && status != Z_BUF_ERROR)
        fail(zlib.msg ? zlib.msg : "no gzip data");
    }
    return room - zlib.avail_out;
  }
};

GzipStream::GzipStream(const std::filesystem::path& path, std::uint64_t begin) : state_(std::make_unique<State>()) {
  state_->file = path.string();
  state_->stream.open(path, std::ios::binary);
  state_->stream.seekg(static_cast<std::streamoff>(begin));
  require(state_->stream.good(), "cannot open, " + path.string());
  state_->zlib.next_in = state_->buffer.data();
  if (inflateInit2(&state_->zlib, kGzipOnly) != Z_OK) throw Error("zlib: inflateInit failed");
}

GzipStream::~GzipStream() { inflateEnd(&state_->zlib); }

void GzipStream::read(std::span<std::byte> bytes) {
  while (!bytes.empty()) {
    const std::size_t count = state_->read_some(bytes);
    if (count == 0) state_->fail("the data end early");
    bytes = bytes.subspan(count);
  }
}

void GzipStream::skip(std::uint64_t count) {
  std::vector<std::byte> part(std::min<std::uint64_t>(count, kBufferBytes));
  for (std::uint64_t n = 0; count > 0; count -= n) {
    n = std::min<std::uint64_t>(count, part.size());
    read(std::span(part).first(static_cast<std::size_t>(n)));
  }
}

void GzipStream::finish() {
  std::array<std::byte, 1> more;
  if (state_->read_some(more) > 0) state_->fail("more bytes follow than the header says");
}

}  // namespace tetwarp
