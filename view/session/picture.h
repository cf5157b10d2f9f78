// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tetwarp::viewer {

/// Pixels of a pane, rows from the top, without gaps: a byte a pixel where grey, else red, green and blue.
struct PaneImage {
  int width = 0, height = 0;         ///< pixels
  bool is_grey = false;              ///< whether a pixel is one byte
  std::vector<std::uint8_t> pixels;  ///< width * height of them
};

/// The image as a JPEG file, for pictures of what moves.
/// @throws Error naming the reason
std::vector<std::byte> encode_jpeg(const PaneImage& image);
/// The image as a PNG file, which has every pixel as it is.
/// @throws Error naming the reason
std::vector<std::byte> encode_png(const PaneImage& image);

}  // namespace tetwarp::viewer
