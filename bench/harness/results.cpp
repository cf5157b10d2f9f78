// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/harness/results.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <iostream>

#include "bench/harness/files.h"
#include "deform/version.h"

namespace tetwarp::bench {

namespace {

using Cells = std::vector<std::pair<std::string, std::string>>;  // of a row, with the names of their columns

bool is_summary(const Json& value) { return value.is_object() && value.contains("q1"); }
bool is_rows(const Json& value) { return value.is_array() && !value.empty() && value[0].is_object(); }

std::string ms_text(const Json& ms) {
  const auto value = ms.get<double>();
  return format("%.*f", value < 10 ? 3 : (value < 100 ? 2 : 1), value);
}

/// @param between  the items of an array
std::string text_of(const Json& value, const char* between = ", ") {
  if (value.is_null()) return "-";
  if (value.is_string()) return value.get<std::string>();
  if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
  if (value.is_number_float()) return format("%.4g", value.get<double>());
  if (is_summary(value))
    return ms_text(value["median"]) + " (" + ms_text(value["q1"]) + "-" + ms_text(value["q3"]) + ")";
  if (!value.is_array()) return value.dump();
  std::string text;
  for (const Json& item : value) text += (text.empty() ? "" : between) + text_of(item, " x ");
  return text;
}

const char* between_items(const std::string& name) {
  return name == "size" || name == "volume" || name == "lattice" ? " x " : ", ";
}

/// What is in an object stands in columns of its own.
void add_cells(const Json& row, const std::string& before, Cells& cells) {
  for (const auto& [name, value] : row.items()) {
    if (value.is_object() && !is_summary(value))
      add_cells(value, before + name + ".", cells);
    else
      cells.emplace_back(before + name, text_of(value, between_items(name)));
  }
}

std::string padded(std::string text, std::size_t width) {
  text.resize(std::max(width, text.size()), ' ');
  return text;
}

std::string table(const Json& rows) {
  std::vector<std::string> names;
  std::vector<std::map<std::string, std::string>> lines;
  for (const Json& row : rows) {
    Cells cells;
    add_cells(row, "", cells);
    for (const auto& [name, text] : cells)
      if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    lines.emplace_back(cells.begin(), cells.end());
  }
  std::string above;
  std::vector<std::string> shown(lines.size() + 1);
  for (const std::string& name : names) {
    std::size_t width = name.size();
    bool same = lines.size() > 1;
    for (auto& line : lines) {
      if (line[name].empty()) line[name] = "-";
      width = std::max(width, line[name].size());
      same = same && line[name] == lines.front()[name];
    }
    if (same && lines.front()[name] != "-") above += name + ": " + lines.front()[name] + "\n";
    if (same) continue;
    shown[0] += padded(name, width + 2);
    for (std::size_t n = 0; n < lines.size(); ++n) shown[n + 1] += padded(lines[n][name], width + 2);
  }
  for (std::string& line : shown) above += line.erase(line.find_last_not_of(' ') + 1) + "\n";
  return above + "\n";
}

std::string title(std::string name) {
  name[0] = static_cast<char>(std::toupper(name[0]));
  std::replace(name.begin(), name.end(), '_', ' ');
  return "## " + name + "\n\n";
}

std::string limit_text(const Floor& floor, const std::optional<double>& limit) {
  if (!limit) return "-";
  return format("%s %g, %s", floor.at_least ? "at least" : "at most", *limit, floor.meets(*limit) ? "met" : "missed");
}

Json limit_json(const Floor& floor, const std::optional<double>& limit) {
  return limit ? Json{{"limit", *limit}, {"met", floor.meets(*limit)}} : Json(nullptr);
}

std::string csv_number(const Json& value) {
  return value.is_number_float() ? format("%.9g", value.get<double>()) : value.dump();
}

/// The columns of a value, and its cells.
void add_csv(const std::string& name, const Json& value, std::string& names, std::string& cells) {
  const auto add = [&](const std::string& column, const std::string& cell) {
    names += (names.empty() ? "" : ",") + column;
    cells += (names == column ? "" : ",") + cell;
  };
  constexpr const char* kSize[] = {"columns", "rows", "slices"};
  constexpr const char* kSummary[] = {"median", "q1", "q3", "min", "max", "frames"};
  if (value.is_array())
    for (std::size_t n = 0; n < value.size(); ++n) add(kSize[n], value[n].dump());
  else if (name.ends_with("_ms"))
    for (const char* part : kSummary) add(name + "_" + part, value.is_null() ? "" : csv_number(value[part]));
  else if (value.is_string())
    add(name,
        value.get<std::string>().find_first_of(":,") == std::string::npos ? value.get<std::string>() : value.dump());
  else
    add(name, value.is_null() ? "" : csv_number(value));
}

}  // namespace

std::string format(const char* pattern, ...) {
  char text[512];
  va_list arguments;
  va_start(arguments, pattern);
  std::vsnprintf(text, sizeof text, pattern, arguments);
  va_end(arguments);
  return text;
}

double quantile(const std::vector<double>& sorted, double fraction) {
  const double place = fraction * static_cast<double>(sorted.size() - 1);
  const auto low = static_cast<std::size_t>(std::floor(place));
  const std::size_t high = std::min(low + 1, sorted.size() - 1);
  return sorted[low] + (place - static_cast<double>(low)) * (sorted[high] - sorted[low]);
}

Json summarize(std::vector<double> values) {
  require(!values.empty(), "no times to summarize; ask for at least one frame");
  std::sort(values.begin(), values.end());
  return {{"median", quantile(values, 0.5)}, {"q1", quantile(values, 0.25)}, {"q3", quantile(values, 0.75)},
          {"min", values.front()},           {"max", values.back()},         {"frames", values.size()}};
}

Json summary_of(const Samples& samples, const std::string& name) {
  const auto found = samples.find(name);
  return found == samples.end() ? Json(nullptr) : summarize(found->second);
}

Json number_or_null(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json size_json(const glm::i64vec3& size) { return {size.x, size.y, size.z}; }

std::optional<double> number(const Json& row, const std::string& pointer) {
  const Json::json_pointer place(pointer);
  if (!row.contains(place)) return {};
  const Json& found = row[place];
  if (is_summary(found)) return found["median"].get<double>();
  return found.is_number() ? std::optional(found.get<double>()) : std::nullopt;
}

const Json& rows_of(const Json& document, const char* list) {
  static const Json kNone = Json::array();
  return document.contains(list) ? document[list] : kNone;
}

const Json* find_row(const Json& rows, const Json& like) {
  for (const Json& row : rows) {
    bool same = true;
    for (const auto& [name, value] : like.items()) same = same && row.contains(name) && row[name] == value;
    if (same) return &row;
  }
  return nullptr;
}

Json begin_document(const std::string& family, const Json& options, const Json& machine, const std::string& kind) {
  Json document{{"program", "tetwarp-bench " + family},
                {"version", version()},
                {"commit", commit()},
                {"machine", machine},
                {"options", options}};
  if (!kind.empty())
    document["input"] = {{"kind", kind}, {"seed", kind == "phantom" ? Json(kPhantomSeed) : Json(nullptr)}};
  return document;
}

bool all_met(const Floors& floors) {
  return std::all_of(floors.begin(), floors.end(),
                     [](const Floor& floor) { return !floor.required || floor.meets(*floor.required); });
}

Json to_json(const Floors& floors) {
  Json array = Json::array();
  for (const Floor& floor : floors)
    array.push_back({{"ratio", floor.ratio},
                     {"where", floor.where},
                     {"value", floor.value},
                     {"at_least", floor.at_least},
                     {"required", limit_json(floor, floor.required)},
                     {"aim", limit_json(floor, floor.aim)}});
  return array;
}

std::string to_text(const Json& document, const Floors& floors) {
  std::string text, lists;
  for (const auto& [name, value] : document.items()) {
    if (is_rows(value)) {
      lists += title(name) + table(value);
    } else if (value.is_object()) {
      Cells cells;
      Json facts = value;
      for (const auto& [part, found] : value.items()) {
        if (!is_rows(found)) continue;
        lists += title(name + ", " + part) + table(found);
        facts.erase(part);
      }
      add_cells(facts, "", cells);
      text += "- " + name + ":";
      for (const auto& [part, found] : cells)
        if (found != "-") text += (text.back() == ':' ? " " : "; ") + part + " " + found;
      text += "\n";
    } else if (name != "program" && name != "version" && name != "commit" && !(value.is_array() && value.empty())) {
      text += "- " + name + ": " + text_of(value, between_items(name)) + "\n";
    }
  }
  Json shown = Json::array();
  for (const Floor& floor : floors)
    shown.push_back({{"ratio", floor.ratio},
                     {"where", floor.where},
                     {"value", format("%.3f", floor.value)},
                     {"required", limit_text(floor, floor.required)},
                     {"aim", limit_text(floor, floor.aim)}});
  if (!shown.empty()) lists += title("floors") + table(shown);
  return "# " + document["program"].get<std::string>() + ", " + document["version"].get<std::string>() + " (" +
         document["commit"].get<std::string>() + ")\n\n" + text + "\n" + lists;
}

std::string to_csv(const Json& rows) {
  std::string csv;
  for (const Json& row : rows) {
    std::string names, cells;
    for (const auto& [name, value] : row.items()) add_csv(name, value, names, cells);
    csv += (csv.empty() ? names + "\n" : "") + cells + "\n";
  }
  return csv;
}

void write_json(const std::filesystem::path& path, const Json& document) {
  write_text(path, nlohmann::json(document).dump(1) + "\n");
}

int conclude(Json document, const Floors& floors, const Options& options) {
  std::cout << to_text(document, floors);
  document["floors"] = to_json(floors);
  write_json(options.json, document);
  if (!options.check || all_met(floors)) return 0;
  std::fprintf(stderr, "tetwarp-bench: a floor is missed; the last table says which\n");
  return 1;
}

}  // namespace tetwarp::bench
