// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace tetwarp {

/// Red, green and blue of a pixel, 0 to 255.
using Colour = std::array<std::uint8_t, 3>;

/// A picture of RGB pixels. A pixel (x, y) is counted from 0, x from the left and y from the top.
class Picture {
 public:
  /// Makes a picture of one colour, width x height pixels.
  Picture(int width, int height, Colour colour = {0, 0, 0});

  /// Number of columns.
  int width() const { return width_; }
  /// Number of rows.
  int height() const { return height_; }
  /// The bytes of `bytes()`, to be read.
  const std::uint8_t* data() const { return bytes_.data(); }
  /// Red, green and blue of each pixel, x fastest, without gaps: 3 * width() * height() bytes.
  std::span<std::uint8_t> bytes() { return bytes_; }
  /// Colour of a pixel, which must lie in the picture.
  Colour at(int x, int y) const;
  /// Sets a pixel. Nothing happens if it lies outside the picture.
  void set(int x, int y, Colour colour);
  /// Sets all pixels of a rectangle whose upper left one is (x, y). Parts outside the picture are left out.
  void fill(int x, int y, int width, int height, Colour colour);

 private:
  std::size_t offset(int x, int y) const {
    return 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x));
  }

  int width_, height_;
  std::vector<std::uint8_t> bytes_;
};

/// Writes an 8-bit RGB PNG without text or time: the same picture gives the same bytes.
/// @throws Error naming the path and the reason; then no file of that name is left
void write_png(const std::filesystem::path& path, const Picture& picture);
/// The bytes of such a file. @throws Error where there is not enough memory
std::vector<std::uint8_t> png_bytes(const Picture& picture);

}  // namespace tetwarp
