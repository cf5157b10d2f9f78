#pragma once

#include <charconv>
#include <cmath>
#include <string>

namespace tetwarp {

/// The way messages show a number: six significant digits, "-0" as "0".
inline std::string number(double value) {
  char text[32];
  const auto end = std::to_chars(text, text + sizeof text, value == 0 ? 0.0 : value, std::chars_format::general, 6).ptr;
  return {text, end};
}

}  // namespace tetwarp
