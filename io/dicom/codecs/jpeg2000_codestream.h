// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: what a JPEG 2000 codestream says before it is decoded.
#include <cstdint>
#include <span>
#include <string>

namespace tetwarp {

/// What the main header says of the image (ITU-T T.800 A.5.1), and where the codestream lies.
struct Jpeg2000Image {
  std::uint32_t rows = 0, columns = 0;
  int components = 0;
  int precision = 0;  ///< bits of a sample of the first component
  bool is_signed = false;
  std::span<const std::uint8_t> codestream;  ///< from its start to its end marker
  std::size_t block_style_at = 0;            ///< in it, the byte with the style of the code-blocks (Table A.19)
};

/// Reads the headers and follows the tile-parts from one to the next; coded data are not looked at.
///
/// Refused is also what would take much more memory than the image: tiles, precincts and code-blocks are counted, for a
/// few bytes can ask for one of each in every pixel. A file of JPEG 2000 (JP2) is taken for the codestream in it.
/// @param problem  why it cannot be decoded, "expected X, found Y"; empty: it may be
Jpeg2000Image read_jpeg_2000(std::span<const std::uint8_t> bytes, std::string& problem);

}  // namespace tetwarp
