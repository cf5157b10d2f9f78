// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string_view>

#include "io/png.h"

namespace tetwarp {

/// Pixels from one letter to the next, and from one line to the next, at scale 1.
constexpr int kLetterWidth = 6, kLineHeight = 10;

constexpr int text_width(std::string_view text, int scale) {
  return static_cast<int>(text.size()) * kLetterWidth * scale;
}

/// Draws printable ASCII with its upper left corner at (x, y), every dot scale x scale pixels; any other byte shows as
/// '?'.
void draw_text(Picture& picture, int x, int y, std::string_view text, Colour colour, int scale);

}  // namespace tetwarp
