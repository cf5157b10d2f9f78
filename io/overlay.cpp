#include "io/overlay.h"

#include <algorithm>
#include <cmath>

namespace tetwarp {

namespace {

constexpr Colour kEmpty = {0, 160, 160}, kFold = {255, 176, 0}, kInverted = {224, 0, 224}, kShrunk = {32, 96, 255},
                 kGrown = {255, 48, 32};

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

Colour mixed(const Colour& below, const Tint& tint) {
  Colour result;
  for (std::size_t n = 0; n < result.size(); ++n)
    result[n] = static_cast<std::uint8_t>(std::lround(below[n] + tint.share * (tint.colour[n] - below[n])));
  return result;
}

}  // namespace tetwarp
