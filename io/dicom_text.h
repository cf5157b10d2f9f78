// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <charconv>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>

#include "deform/text/text_number.h"

namespace tetwarp {

/// The way messages show a number: six significant digits, "-0" as "0".
inline std::string number(double value) {
  char text[32];
  const auto end = std::to_chars(text, text + sizeof text, value == 0 ? 0.0 : value, std::chars_format::general, 6).ptr;
  return {text, end};
}

/// "1 slice", "2 slices".
inline std::string plural(std::size_t count, const std::string& noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

/// A coded value as messages show it: one of those that the standard defines, and of any other text only that it is
/// none, for scanners and people write names into such attributes too.
inline std::string known_code(std::string_view value, std::initializer_list<std::string_view> defined) {
  return std::string(std::find(defined.begin(), defined.end(), value) != defined.end() ? value : "no known value");
}

/// A number as the file spells it; of any other text only that it is none.
inline std::string stated_number(std::string_view text) {
  return text.size() <= 16 && text.find_first_not_of("+-.0123456789eE") == std::string_view::npos ? std::string(text)
                                                                                                  : "no number";
}

/// A Decimal String (PS3.5 6.2) whatever the locale; none unless all of it is one finite number.
inline std::optional<double> decimal(std::string_view text) {
  const auto value = number_from<double>(text);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

}  // namespace tetwarp
