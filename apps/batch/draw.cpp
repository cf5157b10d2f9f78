// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/batch/draw.h"

#include <charconv>
#include <sstream>
#include <vector>

#include "apps/cli/input.h"
#include "deform/fields/elastic.h"
#include "deform/fields/formula.h"

namespace tetwarp::apps {

namespace {

constexpr const char* kDots = "..";

std::vector<std::string> split(const std::string& text, char at) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, at);) parts.push_back(part);
  return parts;
}

std::uint64_t hash_of(std::uint64_t seed, std::uint64_t variant, std::uint64_t field, const std::string& parameter,
                      std::uint64_t component) {
  std::uint64_t hash = split_mix(split_mix(split_mix(seed) + variant) + field);
  for (const char c : parameter) hash = split_mix(hash + static_cast<unsigned char>(c));
  return split_mix(hash + component);
}

/// Takes the number with which a text begins off it. @throws InputError
double take_number(std::string& text, const std::string& range) {
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  require(error == std::errc(), "\"" + range + "\" is no range; LOW..HIGH is expected, such as 2..8 or 2..8vox");
  text.erase(0, static_cast<std::size_t>(end - text.data()));
  return number;
}

std::string drawn(const std::string& range, std::uint64_t hash) {
  std::string rest = range.substr(range.find(kDots) + 2), low_text = range.substr(0, range.find(kDots));
  const double low = take_number(low_text, range), high = take_number(rest, range);
  require(low_text.empty(), "\"" + range + "\" is no range; LOW..HIGH is expected, such as 2..8 or 2..8vox");
  require(low <= high, "the range \"" + range + "\" ends below its begin; turn it round");
  const double part = static_cast<double>(hash >> 11) / 9007199254740992.0;  // 2^53
  return number_text(low + part * (high - low)) + rest;
}

std::string without_ranges(const std::string& value, const std::string& parameter, std::uint64_t seed,
                           std::uint64_t variant, std::uint64_t field) {
  std::string text;
  std::uint64_t component = 0;
  for (const std::string& part : split(value, '/')) {
    if (component > 0) text += '/';
    text +=
        part.find(kDots) == std::string::npos ? part : drawn(part, hash_of(seed, variant, field, parameter, component));
    ++component;
  }
  return text;
}

bool lacks_seed(const std::string& formula) {
  return formula.starts_with("elastic") && formula.find("seed=") == std::string::npos;
}

}  // namespace

bool is_random(const std::string& formula) {
  return is_formula(formula) && (formula.find(kDots) != std::string::npos || lacks_seed(formula));
}

std::string draw(const std::string& formula, std::uint64_t seed, std::uint64_t variant, std::uint64_t field) {
  const std::size_t colon = formula.find(':');
  if (!is_random(formula) || colon == std::string::npos) return formula;
  std::string text = formula.substr(0, colon);
  char before = ':';
  for (const std::string& given : split(formula.substr(colon + 1), ',')) {
    const std::size_t equals = given.find('=');
    const std::string parameter = given.substr(0, equals);
    text += before + given.substr(0, equals);
    if (equals != std::string::npos)
      text += "=" + without_ranges(given.substr(equals + 1), parameter, seed, variant, field);
    before = ',';
  }
  if (lacks_seed(formula)) text += ",seed=" + std::to_string(hash_of(seed, variant, field, "seed", 0) >> 12);
  return text;
}

}  // namespace tetwarp::apps
