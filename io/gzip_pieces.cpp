#include "io/gzip_pieces.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <ostream>

#include "deform/errors.h"

namespace tetwarp {
namespace {

struct Deflated {
  std::vector<std::byte> scratch, bytes;
  uLong crc = 0;
  std::size_t plain_bytes = 0;
};

/// Raw deflate of one piece, flushed to a byte, or finished when it is the last.
void deflate_piece(std::span<const std::byte> plain, int level, bool last, Deflated& result) {
  require(plain.size() < (std::size_t{1} << 30),
          "a piece of " + std::to_string(plain.size()) + " bytes for gzip; expected under 1 GiB");
  z_stream stream{};
  if (deflateInit2(&stream, level, Z_DEFLATED, -MAX_WBITS, 8, Z_DEFAULT_STRATEGY) != Z_OK)
    throw Error("zlib: deflateInit2 failed");
  const auto size = static_cast<uLong>(plain.size());
  result.bytes.resize(deflateBound(&stream, size) + 16);
  const auto* input = reinterpret_cast<const Bytef*>(plain.data());
  stream.next_in = const_cast<Bytef*>(input);
  stream.avail_in = static_cast<uInt>(size);
  stream.next_out = reinterpret_cast<Bytef*>(result.bytes.data());
  stream.avail_out = static_cast<uInt>(result.bytes.size());
  const int status = deflate(&stream, last ? Z_FINISH : Z_SYNC_FLUSH);
  const bool whole = status == (last ? Z_STREAM_END : Z_OK) && stream.avail_in == 0 && stream.avail_out > 0;
  result.bytes.resize(stream.total_out);
  deflateEnd(&stream);
  if (!whole) throw Error("zlib: deflate failed (" + std::to_string(status) + ")");
  result.crc = crc32(crc32(0, nullptr, 0), input, static_cast<uInt>(size));
  result.plain_bytes = plain.size();
}

void put(std::ostream& out, std::span<const std::byte> bytes) {
  out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

void put_u32(std::ostream& out, std::uint64_t value) {
  for (int shift = 0; shift < 32; shift += 8) out.put(static_cast<char>(value >> shift & 0xff));
}

}  // namespace

void write_gzip(std::ostream& out, std::size_t count, const PieceSource& piece, int level) {
  constexpr std::array<char, 10> kHeader = {'\x1f', '\x8b', 8, 0, 0, 0, 0, 0, 0, '\xff'};  // no name, no time
  out.write(kHeader.data(), kHeader.size());
  std::vector<Deflated> batch(4 * static_cast<std::size_t>(tbb::this_task_arena::max_concurrency()));
  uLong crc = crc32(0, nullptr, 0);
  std::uint64_t plain_bytes = 0;
  for (std::size_t begin = 0; begin < count && out; begin += batch.size()) {
    const std::size_t n = std::min(batch.size(), count - begin);
    tbb::parallel_for(std::size_t{0}, n, [&](std::size_t i) {
      deflate_piece(piece(begin + i, batch[i].scratch), level, begin + i + 1 == count, batch[i]);
    });
    for (std::size_t i = 0; i < n; ++i) {
      put(out, batch[i].bytes);
      crc = crc32_combine(crc, batch[i].crc, static_cast<z_off_t>(batch[i].plain_bytes));
      plain_bytes += batch[i].plain_bytes;
    }
  }
  put_u32(out, crc);
  put_u32(out, plain_bytes);
}

}  // namespace tetwarp
