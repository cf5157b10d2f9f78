// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/overlay.h"

#include <algorithm>
#include <cmath>

namespace tetwarp {

namespace {

constexpr Colour kEmpty = {0, 160, 160}, kFold = {255, 176, 0}, kInverted = {224, 0, 224}, kShrunk = {32, 96, 255},
                 kGrown = {255, 48, 32};

/// Numbers under which Jacobians are stored: 1 for a Jacobian of 1/2, 127 for 1, 253 for 2, in even steps of its
/// logarithm; 255 for an inverted tetrahedron.
constexpr int kNumberOfOne = 127, kNumberInverted = 255;
constexpr double kNumbersAnOctave = 126;

}  // namespace

Tint tint_of(OverlayKind kind, double value) {
  constexpr double kMost = 0.65;
  switch (kind) {
    case OverlayKind::coverage: return {kEmpty, value == 0 ? kMost : 0};
    case OverlayKind::folds: return {kFold, value > 1 ? kMost : 0};
    default: break;
  }
  if (std::isnan(value)) return {};
  if (value <= 0) return {kInverted, kMost};
  const double change = std::log2(value);
  return {change < 0 ? kShrunk : kGrown, kMost * std::min(std::abs(change), 1.0)};
}

std::string legend_of(OverlayKind kind) {
  switch (kind) {
    case OverlayKind::coverage: return "green: nothing maps here";
    case OverlayKind::folds: return "orange: several places map here";
    case OverlayKind::jacobian: return "blue: shrunk (full at 1/2), red: grown (full at 2), violet: inside out";
    default: return "lines: cells of the deformed lattice";
  }
}

std::uint8_t TintScale::number(double value) const {
  if (tint_of(kind_, value).share <= 0) return 0;
  if (kind_ != OverlayKind::jacobian) return 1;
  if (value <= 0) return kNumberInverted;
  return static_cast<std::uint8_t>(
      std::lround(kNumberOfOne + kNumbersAnOctave * std::clamp(std::log2(value), -1.0, 1.0)));
}

double TintScale::value_of(int number) const {
  if (kind_ == OverlayKind::coverage) return 0;
  if (kind_ == OverlayKind::folds) return 2;
  return number == kNumberInverted ? -1 : std::exp2((number - kNumberOfOne) / kNumbersAnOctave);
}

std::vector<glm::vec4> TintScale::colours() const {
  std::vector<glm::vec4> colours = {glm::vec4(0)};
  for (int number = 1; number < 256; ++number) {
    const Tint tint = tint_of(kind_, value_of(number));
    colours.emplace_back(glm::vec3(tint.colour[0], tint.colour[1], tint.colour[2]) / 255.0f,
                         static_cast<float>(tint.share));
  }
  return colours;
}

Colour mixed(const Colour& below, const Tint& tint) {
  Colour result;
  for (std::size_t n = 0; n < result.size(); ++n)
    result[n] = static_cast<std::uint8_t>(std::lround(below[n] + tint.share * (tint.colour[n] - below[n])));
  return result;
}

}  // namespace tetwarp
