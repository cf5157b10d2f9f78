// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/view_picture.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "io/pictures/lettering.h"

namespace tetwarp {

std::string direction_letters(const glm::dvec3& direction) {
  constexpr std::array<const char*, 3> kLess = {"R", "A", "I"}, kMore = {"L", "P", "S"};
  constexpr double kBetween = 0.38;  // sin 22.5 degrees, so that each direction has an eighth of the circle
  std::array<std::size_t, 3> axes = {0, 1, 2};
  const auto part = [&](std::size_t axis) { return direction[static_cast<int>(axis)]; };
  std::stable_sort(axes.begin(), axes.end(),
                   [&](std::size_t a, std::size_t b) { return std::abs(part(a)) > std::abs(part(b)) + 1e-9; });
  std::string letters;
  for (const std::size_t axis : {axes[0], axes[1]}) {
    if (letters.empty() || std::abs(part(axis)) > kBetween) letters += part(axis) < 0 ? kLess[axis] : kMore[axis];
  }
  return letters;
}

void annotate(Picture& picture, const ViewPlane& plane, const ViewCaption& caption) {
  const Lettering lettering(picture);
  const int line = lettering.line(), margin = line / 2;
  lettering.write(margin, margin, lettering.cut(caption.title), kTextColour);
  int y = margin;
  for (const std::string& detail : caption.details)
    lettering.write(margin, y += line, lettering.cut(detail), kFaintColour);
  const std::string left = direction_letters(-plane.right), right = direction_letters(plane.right),
                    top = direction_letters(-plane.down), bottom = direction_letters(plane.down);
  const int middle_x = picture.width() / 2, middle_y = (picture.height() - line) / 2;
  lettering.write(margin, middle_y, left, kLetterColour);
  lettering.write(picture.width() - margin - lettering.width(right), middle_y, right, kLetterColour);
  lettering.write(middle_x - lettering.width(top) / 2, y + line, top, kLetterColour);
  lettering.write(middle_x - lettering.width(bottom) / 2, picture.height() - line - margin / 2, bottom, kLetterColour);
  lettering.draw_bar(margin, picture.height() - line, plane.pixel_mm);
}

}  // namespace tetwarp
