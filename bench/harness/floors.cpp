// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/harness/floors.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "bench/harness/markdown.h"

namespace tetwarp::bench {

namespace {

using Json = nlohmann::json;

constexpr char kNote[] = R"(## Floors

Ratios, of medians where they are of times, and counts of this run. A floor is required, an aim is not.

)";

std::string limit_cell(const Floor& floor, const std::optional<double>& limit) {
  return limit ? format("%s %g", floor.at_least ? "at least" : "at most", *limit) : "";
}

Json limit_json(const Floor& floor, const std::optional<double>& limit) {
  return limit ? Json{{"limit", *limit}, {"met", floor.meets(*limit)}} : Json(nullptr);
}

Json to_json(const Floor& floor) {
  return {{"ratio", floor.ratio},
          {"where", floor.where},
          {"value", floor.value},
          {"at_least", floor.at_least},
          {"required", limit_json(floor, floor.required)},
          {"aim", limit_json(floor, floor.aim)}};
}

}  // namespace

bool all_met(const std::vector<Floor>& floors) {
  return std::all_of(floors.begin(), floors.end(),
                     [](const Floor& floor) { return !floor.required || floor.meets(*floor.required); });
}

std::string to_markdown(const std::vector<Floor>& floors) {
  std::string text = kNote + heading({"ratio", "where", "value", "required", "", "aim", ""});
  for (const Floor& floor : floors) {
    const auto word = [&](const std::optional<double>& limit, const char* yes, const char* no) -> std::string {
      return limit ? (floor.meets(*limit) ? yes : no) : "";
    };
    text += row({floor.ratio, floor.where, format("%.3f", floor.value), limit_cell(floor, floor.required),
                 word(floor.required, "met", "missed"), limit_cell(floor, floor.aim),
                 word(floor.aim, "reached", "not reached")});
  }
  return text;
}

nlohmann::json to_json(const std::vector<Floor>& floors) {
  Json array = Json::array();
  for (const Floor& floor : floors) array.push_back(to_json(floor));
  return array;
}

}  // namespace tetwarp::bench
