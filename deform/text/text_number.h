// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <charconv>
#include <optional>
#include <string_view>

namespace tetwarp {

/// The number that a whole text is, whatever the locale; a plus sign may stand before it. None for any other text and
/// for a number that the type does not hold.
template <class Number>
std::optional<Number> number_from(std::string_view text) {
  if (text.starts_with('+')) {  // which from_chars does not take
    text.remove_prefix(1);
    if (text.starts_with('-')) return std::nullopt;
  }
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

}  // namespace tetwarp
