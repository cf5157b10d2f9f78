// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. Fast reading of gzip files whose plain size the caller knows.
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>

namespace tetwarp {

/// Fills `bytes` with the plain bytes from `offset` on; false where the file is damaged there, or was changed since it
/// was opened. Many threads may call it at a time, in any order.
using PlainBytes = std::function<bool(std::uint64_t offset, std::span<std::byte> bytes)>;

/// How many plain bytes a compressed byte can become, at most: deflate cannot do better than 1032.
constexpr double kDeflateAtMost = 1040;

/// The most plain bytes that are kept in memory beside the caller's.
constexpr std::uint64_t kInflateAtMost = std::uint64_t{1} << 30;

/// Opens the gzip data (RFC 1952) that begin at byte `begin` of a file and have `size` plain bytes, for inflation by
/// libdeflate. It is twice as fast as zlib, but needs a whole member and its content in memory.
///
/// If all members state their size (as `write_gzip` writes them), each is read and inflated when a part of it is first
/// read. Any other file is inflated here and kept: `size` bytes, and meanwhile the compressed file. Every CRC of what
/// is inflated is checked. Only zeros may follow the last member, as tapes and archives append them; gzip accepts
/// these, too.
/// @return empty where zlib (GzipStream) has to read the file, or to say what is wrong with it: damage, another number
/// of plain bytes than `size`, other data behind them, or a `size` above `kInflateAtMost` in members that do not state
/// theirs
/// @throws InputError when the file cannot be opened
PlainBytes inflate_at_once(const std::filesystem::path& path, std::uint64_t size, std::uint64_t begin = 0);

/// Plain bytes of a gzip file in order, inflated by zlib. How many there are need not be known.
class GzipStream {
 public:
  /// @throws InputError when the file cannot be opened
  explicit GzipStream(const std::filesystem::path& path, std::uint64_t begin = 0);
  ~GzipStream();
  GzipStream(const GzipStream&) = delete;
  GzipStream& operator=(const GzipStream&) = delete;

  /// Fills `bytes` with the next plain bytes. @throws InputError for damage, or where fewer are left
  void read(std::span<std::byte> bytes);
  void skip(std::uint64_t count);
  /// Checks the end of the data. To be called after the last byte was read.
  /// @throws InputError for more bytes, a damaged end of a member, or anything but zeros behind the last member
  void finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tetwarp
