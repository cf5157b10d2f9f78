// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/pictures/lettering.h"

#include <algorithm>
#include <cmath>

#include "io/pictures/text_raster.h"
#include "io/preview_scale.h"

namespace tetwarp {

namespace {

constexpr Colour kShadow = {0, 0, 0};

int scale_for(int width, int height) { return std::max(1, (std::min(width, height) + 160) / 320); }

}  // namespace

int lettering_line(int width, int height) { return kLineHeight * scale_for(width, height); }

Lettering::Lettering(Picture& picture) : picture_(picture), scale_(scale_for(picture.width(), picture.height())) {}

int Lettering::line() const { return kLineHeight * scale_; }

int Lettering::width(std::string_view text) const { return text_width(text, scale_); }

void Lettering::write(int x, int y, std::string_view text, Colour colour) const {
  for (const auto& [dx, dy] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}})
    draw_text(picture_, x + dx, y + dy, text, kShadow, scale_);
  draw_text(picture_, x, y, text, colour, scale_);
}

std::string Lettering::cut(const std::string& text) const {
  const auto fits = static_cast<std::size_t>(std::max(4, (picture_.width() - line()) / (kLetterWidth * scale_)));
  return text.size() <= fits ? text : text.substr(0, fits - 3) + "...";
}

void Lettering::draw_bar(int x, int y, double pixel_mm) const {
  const double length_mm = round_down_125(0.25 * picture_.width() * pixel_mm);
  const int length = std::max(1, static_cast<int>(std::lround(length_mm / pixel_mm))), thick = scale_;
  picture_.fill(x - 1, y - 1, length + 2, thick + 2, kShadow);
  for (const int end : {x, x + length - thick}) {
    picture_.fill(end - 1, y - 2 * thick - 1, thick + 2, 5 * thick + 2, kShadow);
    picture_.fill(end, y - 2 * thick, thick, 5 * thick, kTextColour);
  }
  picture_.fill(x, y, length, thick, kTextColour);
  write(x + length + line() / 2, y - 3 * thick, short_number(length_mm) + " mm", kTextColour);
}

}  // namespace tetwarp
