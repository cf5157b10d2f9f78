#pragma once

// Private to io/. Fast reading of gzip files whose plain size the caller knows.
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>

namespace tetwarp {

/// Fills `bytes` with the plain bytes from `offset` on; false where the file is damaged there, or was changed since.
/// May be called from many threads, in any order.
using PlainBytes = std::function<bool(std::uint64_t offset, std::span<std::byte> bytes)>;

/// The most plain bytes that are held beside the caller's.
constexpr std::uint64_t kInflateAtMost = std::uint64_t{1} << 30;

/// The first `size` plain bytes of a gzip file (RFC 1952), inflated by libdeflate: twice as fast as zlib, but it wants
/// a member, and room for what is in it, whole in memory.
///
/// Members that all state their size (`write_gzip`) are read and inflated when a part of them is asked for. Any other
/// file is inflated here and held: `size` bytes, and while that lasts the compressed file. Every CRC of what is
/// inflated is checked. What follows the last member and is not gzip is ignored, as gzip and zlib do.
/// @return  empty where zlib has to read the file, or to say what is wrong with it: damage, fewer than `size` plain
/// bytes,
///          and in members that do not state their size also more than `size`, or `size` above `kInflateAtMost`
/// @throws InputError when the file cannot be opened
PlainBytes inflate_at_once(const std::filesystem::path& path, std::uint64_t size);

}  // namespace tetwarp
