// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: the layout of members of gzip files, for the function that writes them and the one that reads them.
//
//   byte 0                      16                 20                              n - 8        n - 4           n
//        +-----------------------+------------------+--------------------------------+------------+-------------+
//        | kMemberStart          | n, bytes of the  | deflated data                  | CRC-32 of  | plain bytes |
//        | (RFC 1952, 2.3)       | whole member     |                                | plain data | mod 2^32    |
//        +-----------------------+------------------+--------------------------------+------------+-------------+
//
// Numbers are little endian.
#include <array>
#include <cstddef>

namespace tetwarp {

constexpr std::size_t kMemberHeaderBytes = 20;  // `kMemberStart`, then the size of the whole member
constexpr std::size_t kMemberTrailerBytes = 8;  // CRC and plain size

/// The first bytes of a member (RFC 1952, 2.3), before its size: deflate, an extra field, no time, system unknown; 8
/// bytes of extra field, subfield "IG" of 4 bytes.
constexpr std::array<std::byte, 16> kMemberStart = {std::byte{0x1f}, std::byte{0x8b}, std::byte{8}, std::byte{4},
                                                    std::byte{0},    std::byte{0},    std::byte{0}, std::byte{0},
                                                    std::byte{0},    std::byte{0xff}, std::byte{8}, std::byte{0},
                                                    std::byte{'I'},  std::byte{'G'},  std::byte{4}, std::byte{0}};

}  // namespace tetwarp
