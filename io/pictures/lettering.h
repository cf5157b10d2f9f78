// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>
#include <string_view>

#include "io/png.h"

namespace tetwarp {

constexpr Colour kTextColour = {235, 235, 235}, kFaintColour = {160, 160, 168}, kLetterColour = {255, 214, 64};

/// Pixels from one line of text to the next in a picture of this size.
int lettering_line(int width, int height);

/// Writes into a picture, in a size that fits the picture's. Letters have a dark edge, so that they can be read on
/// bone, too.
class Lettering {
 public:
  explicit Lettering(Picture& picture);

  int line() const;
  int scale() const { return scale_; }
  int width(std::string_view text) const;
  void write(int x, int y, std::string_view text, Colour colour) const;
  /// The text, or as much of its beginning as fits the width of the picture.
  std::string cut(const std::string& text) const;
  /// Draws a scale bar of a round length that begins at (x, y), with its length beside it.
  void draw_bar(int x, int y, double pixel_mm) const;

 private:
  Picture& picture_;
  int scale_;
};

}  // namespace tetwarp
