// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace tetwarp {

using Colour = std::array<std::uint8_t, 3>;  ///< red, green, blue

/// An RGB picture, rows from the top.
class Picture {
 public:
  Picture(int width, int height, Colour colour = {0, 0, 0});

  int width() const { return width_; }
  int height() const { return height_; }
  const std::uint8_t* data() const { return bytes_.data(); }
  /// Red, green and blue of each pixel, rows from the top.
  std::span<std::uint8_t> bytes() { return bytes_; }
  Colour at(int x, int y) const;
  /// Pixels outside the picture are not drawn.
  void set(int x, int y, Colour colour);
  void fill(int x, int y, int width, int height, Colour colour);

 private:
  std::size_t offset(int x, int y) const {
    return 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x));
  }

  int width_, height_;
  std::vector<std::uint8_t> bytes_;
};

/// Writes an 8-bit RGB PNG without text or time: the same picture gives the same bytes.
/// @throws Error naming the path and the reason; nothing is left under the name then
void write_png(const std::filesystem::path& path, const Picture& picture);

}  // namespace tetwarp
