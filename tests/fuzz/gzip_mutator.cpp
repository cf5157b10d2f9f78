// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Changes what is inside a gzip file, whose check sum keeps random changes of its bytes out of everything behind it.
#include <zlib.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace {

constexpr int kGzip = 15 + 16;                // largest window, gzip's header and trailer
constexpr std::size_t kMostPlain = 1U << 16;  // what is longer is cut
constexpr unsigned kPlainEvery = 8;           // so often the gzip file itself is changed

/// The plain bytes as far as they can be had; room for more behind them.
std::vector<std::uint8_t> inflated(std::uint8_t* data, std::size_t size, std::size_t& plain_size) {
  std::vector<std::uint8_t> plain(kMostPlain);
  z_stream stream{};
  inflateInit2(&stream, kGzip);
  stream.next_in = data;
  stream.avail_in = static_cast<uInt>(size);
  stream.next_out = plain.data();
  stream.avail_out = static_cast<uInt>(plain.size());
  inflate(&stream, Z_FINISH);
  plain_size = plain.size() - stream.avail_out;
  inflateEnd(&stream);
  return plain;
}

/// @return  the size of the gzip file, 0 where it does not fit
std::size_t deflate_into(std::uint8_t* data, std::size_t max_size, std::uint8_t* plain, std::size_t plain_size) {
  z_stream stream{};
  deflateInit2(&stream, 1, Z_DEFLATED, kGzip, 8, Z_DEFAULT_STRATEGY);
  stream.next_in = plain;
  stream.avail_in = static_cast<uInt>(plain_size);
  stream.next_out = data;
  stream.avail_out = static_cast<uInt>(max_size);
  const bool whole = deflate(&stream, Z_FINISH) == Z_STREAM_END;
  const std::size_t size = max_size - stream.avail_out;
  deflateEnd(&stream);
  return whole ? size : 0;
}

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                               unsigned seed) {
  if (seed % kPlainEvery == 0) return LLVMFuzzerMutate(data, size, max_size);
  std::size_t plain_size = 0;
  std::vector<std::uint8_t> plain = inflated(data, size, plain_size), gzip(max_size);
  plain_size = LLVMFuzzerMutate(plain.data(), plain_size, plain.size());
  const std::size_t gzip_size = deflate_into(gzip.data(), max_size, plain.data(), plain_size);
  if (gzip_size == 0) return LLVMFuzzerMutate(data, size, max_size);
  std::copy_n(gzip.begin(), gzip_size, data);
  return gzip_size;
}
