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
  /// Place in `codestream` of the byte with the style of the code-blocks (T.800 Table A.19).
  std::size_t block_style_at = 0;
};

/// Reads the headers and follows the tile-parts from one to the next; coded data are not looked at.
///
/// A codestream that would take much more memory than its image is refused, too: tiles, precincts and code-blocks are
/// counted, for a few bytes can state one of each in every pixel. Of a file of JPEG 2000 (JP2) the codestream within it
/// is read.
/// @param problem  set to why the codestream cannot be decoded, "expected X, found Y"; empty: it can
Jpeg2000Image read_jpeg_2000(std::span<const std::uint8_t> bytes, std::string& problem);

}  // namespace tetwarp
