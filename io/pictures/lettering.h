// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>
#include <string_view>

#include "io/png.h"

namespace tetwarp {

constexpr Colour kTextColour = {235, 235, 235}, kFaintColour = {160, 160, 168}, kLetterColour = {255, 214, 64};

/// Pixels from one line to the next in a picture of a size.
int lettering_line(int width, int height);

/// Writes into a picture, in a size that goes with its own, with a dark edge, so that it is read on bone too.
class Lettering {
 public:
  explicit Lettering(Picture& picture);

  int line() const;
  int scale() const { return scale_; }
  int width(std::string_view text) const;
  void write(int x, int y, std::string_view text, Colour colour) const;
  /// The text, or as much of it as fits the width of the picture.
  std::string cut(const std::string& text) const;
  /// A bar of a round length, from (x, y) on, with its length beside it.
  void draw_bar(int x, int y, double pixel_mm) const;

 private:
  Picture& picture_;
  int scale_;
};

}  // namespace tetwarp
