// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/fields/parameter_text.h"

#include <algorithm>

#include "deform/errors.h"

namespace tetwarp {

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (;;) {
    const std::size_t end = text.find(separator);
    parts.push_back(text.substr(0, end));
    if (end == std::string_view::npos) return parts;
    text.remove_prefix(end + 1);
  }
}

ParameterText parse_parameters(std::string_view text, const std::string& about) {
  ParameterText parsed{name_of(text), {}};
  if (parsed.name.size() == text.size()) return parsed;
  for (const std::string_view part : split(text.substr(parsed.name.size() + 1), ',')) {
    const std::size_t equals = part.find('=');
    require(equals != std::string_view::npos, about + ": \"" + std::string(part) + "\" is not of the form key=value");
    const std::string_view key = part.substr(0, equals);
    const bool is_new = std::none_of(parsed.values.begin(), parsed.values.end(),
                                     [&](const auto& before) { return before.first == key; });
    require(is_new, about + ": " + std::string(key) + " is given twice");
    parsed.values.emplace_back(key, part.substr(equals + 1));
  }
  return parsed;
}

}  // namespace tetwarp
