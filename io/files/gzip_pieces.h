// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>
#include <functional>
#include <iosfwd>
#include <span>
#include <vector>

namespace tetwarp {

/// The most plain bytes of a piece, and so of a member of the gzip files written here.
constexpr std::size_t kGzipPieceBytes = std::size_t{1} << 20;

/// Gives the i-th piece of a stream: a view of the caller's memory, or of `scratch` after filling it. Many threads may
/// call it at a time.
using PieceSource = std::function<std::span<const std::byte>(std::size_t i, std::vector<std::byte>& scratch)>;

/// Writes the pieces 0 to `count` - 1 as a gzip file (RFC 1952) of one member a piece, compressed in parallel. The
/// bytes depend on pieces and level alone (and on the release of libdeflate), never on threads or clock.
///
/// libdeflate compresses ten times as fast as zlib, but cannot continue a stream: hence the members. Each states its
/// size in the extra field of its header, as the Python packages mgzip and pgzip have it: subfield "IG" of 4 bytes, the
/// member with header and trailer, little endian. `inflate_at_once` finds the members by it.
/// @param piece  of at most `kGzipPieceBytes`
/// @param level  of libdeflate, 0 to 9
/// @throws Error when memory is short; a failed write leaves `out` in its fail state
void write_gzip(std::ostream& out, std::size_t count, const PieceSource& piece, int level);

}  // namespace tetwarp
