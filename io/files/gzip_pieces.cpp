// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/files/gzip_pieces.h"

#include <libdeflate.h>
#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <memory>
#include <ostream>
#include <string>

#include "deform/errors.h"
#include "io/files/gzip_member.h"

namespace tetwarp {
namespace {

struct FreeCompressor {
  void operator()(libdeflate_compressor* compressor) const { libdeflate_free_compressor(compressor); }
};

/// Makes gzip members one after the other, each in the same memory.
class MemberMaker {
 public:
  void make(const PieceSource& piece, std::size_t i, int level) {
    const std::span<const std::byte> plain = piece(i, scratch_);
    require(plain.size() <= kGzipPieceBytes, "a piece of " + std::to_string(plain.size()) +
                                                 " bytes for gzip; expected at most " +
                                                 std::to_string(kGzipPieceBytes));
    if (!compressor_) compressor_.reset(libdeflate_alloc_compressor(level));
    if (!compressor_) throw Error("libdeflate: no memory for a compressor of level " + std::to_string(level));
    const std::size_t room = libdeflate_deflate_compress_bound(compressor_.get(), plain.size());
    member_.resize(kMemberHeaderBytes + room + kMemberTrailerBytes);
    const std::size_t deflated = libdeflate_deflate_compress(compressor_.get(), plain.data(), plain.size(),
                                                             member_.data() + kMemberHeaderBytes, room);
    if (deflated == 0) throw Error("libdeflate: compression failed");
    bytes_ = kMemberHeaderBytes + deflated + kMemberTrailerBytes;
    std::ranges::copy(kMemberStart, member_.begin());
    put_u32(kMemberStart.size(), bytes_);
    put_u32(bytes_ - 8, libdeflate_crc32(0, plain.data(), plain.size()));
    put_u32(bytes_ - 4, plain.size());
  }
  void write(std::ostream& out) const {
    out.write(reinterpret_cast<const char*>(member_.data()), static_cast<std::streamsize>(bytes_));
  }

 private:
  void put_u32(std::size_t at, std::uint64_t value) {
    for (int shift = 0; shift < 32; shift += 8) member_[at++] = static_cast<std::byte>(value >> shift & 0xff);
  }

  std::unique_ptr<libdeflate_compressor, FreeCompressor> compressor_;
  std::vector<std::byte> scratch_, member_;
  std::size_t bytes_ = 0;
};

}  // namespace

void write_gzip(std::ostream& out, std::size_t count, const PieceSource& piece, int level) {
  // At most as many pieces as there are makers are under way, and they leave in order, so no two of them have the same
  // maker.
  std::vector<MemberMaker> makers(4 * static_cast<std::size_t>(tbb::this_task_arena::max_concurrency()));
  std::atomic<bool> failed = false;
  std::size_t next = 0;
  const auto number = [&](tbb::flow_control& control) {
    if (next == count || failed) control.stop();
    return next++;
  };
  const auto compress = [&](std::size_t i) {
    makers[i % makers.size()].make(piece, i, level);
    return i;
  };
  const auto write = [&](std::size_t i) {
    makers[i % makers.size()].write(out);
    if (!out) failed = true;
  };
  tbb::parallel_pipeline(makers.size(),
                         tbb::make_filter<void, std::size_t>(tbb::filter_mode::serial_in_order, number) &
                             tbb::make_filter<std::size_t, std::size_t>(tbb::filter_mode::parallel, compress) &
                             tbb::make_filter<std::size_t, void>(tbb::filter_mode::serial_in_order, write));
}

}  // namespace tetwarp
