#pragma once

#include <cstddef>
#include <functional>
#include <iosfwd>
#include <span>
#include <vector>

namespace tetwarp {

/// The i-th piece of a stream: a view of the caller's memory, or of `scratch` after filling it. Called from many
/// threads.
using PieceSource = std::function<std::span<const std::byte>(std::size_t i, std::vector<std::byte>& scratch)>;

/// Writes the pieces 0 to `count` - 1, one after the other, as one gzip member (RFC 1952), compressed in parallel: each
/// piece is deflated alone and ends on a byte (as pigz -i does). The bytes depend on pieces and level alone, never on
/// threads or clock.
/// @param level  of zlib, 0 to 9
/// @throws Error when zlib fails; a failed write leaves `out` in its fail state
void write_gzip(std::ostream& out, std::size_t count, const PieceSource& piece, int level);

}  // namespace tetwarp
