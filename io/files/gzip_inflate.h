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

/// Fills `bytes` with the plain bytes from `offset` on; false where the file is damaged there, or was changed since.
/// May be called from many threads, in any order.
using PlainBytes = std::function<bool(std::uint64_t offset, std::span<std::byte> bytes)>;

/// The most plain bytes that are held beside the caller's.
constexpr std::uint64_t kInflateAtMost = std::uint64_t{1} << 30;

/// The `size` plain bytes of the gzip data (RFC 1952) that a file has from `begin` on, inflated by libdeflate: twice as
/// fast as zlib, but it wants a member, and room for what is in it, whole in memory.
///
/// Members that all state their size (`write_gzip`) are read and inflated when a part of them is asked for. Any other
/// file is inflated here and held: `size` bytes, and while that lasts the compressed file. Every CRC of what is
/// inflated is checked. Nothing but zeros may follow the last member (tapes and archives fill up with them; gzip takes
/// them likewise).
/// @return  empty where zlib has to read the file, or to say what is wrong with it (GzipStream): damage, more or fewer
///          than `size` plain bytes, something else behind them; or `size` above `kInflateAtMost` in members that do
///          not state theirs
/// @throws InputError when the file cannot be opened
PlainBytes inflate_at_once(const std::filesystem::path& path, std::uint64_t size, std::uint64_t begin = 0);

/// The same bytes one after the other, inflated by zlib, whatever their number.
class GzipStream {
 public:
  /// @throws InputError when the file cannot be opened
  explicit GzipStream(const std::filesystem::path& path, std::uint64_t begin = 0);
  ~GzipStream();
  GzipStream(const GzipStream&) = delete;
  GzipStream& operator=(const GzipStream&) = delete;

  /// Fills `bytes`. @throws InputError for damage, or too few bytes
  void read(std::span<std::byte> bytes);
  void skip(std::uint64_t count);
  /// To be called behind the last byte that is wanted. @throws InputError for more bytes, damage in what ends a member,
  /// or anything but zeros behind the last member
  void finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tetwarp
