// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/images/header_words.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <sstream>

namespace tetwarp {

std::string trimmed(const std::string& text) {
  const auto begin = text.find_first_not_of(" \t\r"), end = text.find_last_not_of(" \t\r");
  return begin == std::string::npos ? "" : text.substr(begin, end - begin + 1);
}

std::vector<std::string> words(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> all;
  for (std::string word; stream >> word;) all.push_back(word);
  return all;
}

std::optional<double> to_number(std::string_view word) {
  if (word.starts_with('+')) {
    word.remove_prefix(1);
    if (word.starts_with('-')) return {};
  }
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (word.empty() || end != word.data() + word.size() || error == std::errc::invalid_argument) return {};
  if (error == std::errc()) return value;
  return std::strtod(std::string(word).c_str(), nullptr);  // beyond all doubles, or nearer to 0 than any
}

std::optional<std::int64_t> to_whole_number(std::string_view word) {
  constexpr double kMost = 1e15;  // and each whole number up to it is a double
  const std::optional<double> value = to_number(word);
  if (!value || !(*value >= 0 && *value <= kMost) || *value != std::floor(*value)) return {};
  return static_cast<std::int64_t>(*value);
}

std::string exact(const glm::dvec3& v, const char* separator) {
  std::array<char, 96> text;
  std::snprintf(text.data(), text.size(), "%.17g%s%.17g%s%.17g", v.x, separator, v.y, separator, v.z);
  return text.data();
}

double snapped_cosine(double cosine) {
  if (std::abs(std::abs(cosine) - 1) < 1e-15) return std::copysign(1.0, cosine);
  return cosine + 0.0;  // -0 to 0
}

}  // namespace tetwarp
