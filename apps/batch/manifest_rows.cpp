// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/batch/manifest_rows.h"

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "deform/errors.h"
#include "io/csv_record.h"
#include "io/opened_file.h"
#include "io/shown_text.h"

namespace tetwarp::apps {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

constexpr std::uintmax_t kMostBytes = std::uintmax_t{64} << 20;
constexpr std::size_t kMostShown = 100;

std::string read_all(const fs::path& path) {
  std::error_code error;
  require(!fs::is_other(fs::status(path, error)), "neither a file nor a folder, " + shown(path) + "; name a manifest");
  std::ifstream file = opened(path);
  const std::uintmax_t bytes = fs::file_size(path, error);
  require(!error && bytes <= kMostBytes, "the manifest is larger than 64 MiB, " + shown(path) + "; divide it");
  std::ostringstream text;
  text << file.rdbuf();
  require(file.good(), "the manifest cannot be read, " + shown(path));
  const std::string all = text.str(), mark = "\xEF\xBB\xBF";
  return all.starts_with(mark) ? all.substr(mark.size()) : all;
}

/// The parts of a cell, which `;` separates, without blanks around them.
std::vector<std::string> split_list(const std::string& cell) {
  std::vector<std::string> parts;
  std::istringstream text(cell);
  for (std::string part; std::getline(text, part, ';');) {
    const std::string plain = unquoted(part);
    if (!plain.empty()) parts.push_back(plain);
  }
  return parts;
}

std::vector<ManifestRow> csv_rows(const std::string& text, const std::string& name, bool (*is_list)(const std::string&),
                                  ManifestErrors& errors) {
  std::vector<ManifestRow> rows;
  std::vector<std::string> keys;
  CsvRecords records(text, 0, name, true);
  const auto next = [&] {
    try {
      return records.next();
    } catch (const InputError& error) {  // reading ends here, for it is not known where the next record begins
      errors.add(records.line, error.what());
      return false;
    }
  };
  while (next()) {
    if (records.is_blank() || records.raw(0).starts_with('#')) continue;
    std::vector<std::string> cells;
    for (std::size_t n = 0; n < records.fields.size(); ++n) cells.push_back(unquoted(records.raw(n)));
    if (keys.empty()) {
      keys = cells;
      for (std::size_t n = 0; n < keys.size(); ++n) {
        if (std::count(keys.begin(), keys.end(), keys[n]) > 1 &&
            std::find(keys.begin(), keys.end(), keys[n]) == keys.begin() + static_cast<std::ptrdiff_t>(n))
          errors.add(records.line, "the column \"" + keys[n] + "\" stands there twice; keep one");
      }
      continue;
    }
    if (cells.size() != keys.size()) {
      errors.add(records.line, std::to_string(cells.size()) + " cells, the first line names " +
                                   std::to_string(keys.size()) + " columns; put text with commas in quotes");
      continue;
    }
    ManifestRow row{records.line, {}};
    for (std::size_t n = 0; n < keys.size(); ++n) {
      std::vector<std::string> values = is_list(keys[n]) ? split_list(cells[n]) : std::vector{cells[n]};
      if (!values.empty() && !values.front().empty()) row.values[keys[n]] = std::move(values);
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

/// A value of JSON as texts; none for null. @throws InputError for an object or a list of lists
std::vector<std::string> texts_of(const std::string& key, const json& value) {
  if (value.is_null()) return {};
  if (value.is_string()) return {value.get<std::string>()};
  if (value.is_boolean() || value.is_number()) return {value.dump()};
  require(value.is_array(), "\"" + key + "\" is an object; a text, a number, true, false or a list is expected");
  std::vector<std::string> texts;
  for (const json& item : value) {
    require(item.is_string(), "\"" + key + "\" holds something that is no text; a list of texts is expected");
    texts.push_back(item.get<std::string>());
  }
  return texts;
}

ManifestRow json_row(const std::string& line, bool (*is_list)(const std::string&)) {
  std::set<std::string> seen;
  std::string twice;
  const auto look = [&](int depth, json::parse_event_t event, json& parsed) {
    if (event == json::parse_event_t::key && depth == 1 && !seen.insert(parsed.get<std::string>()).second)
      twice = parsed.get<std::string>();
    return true;
  };
  const json document = json::parse(line, look, false);
  require(document.is_object(), "no JSON object; one in each line is expected");
  require(twice.empty(), "the key \"" + twice + "\" stands there twice; keep one");
  ManifestRow row;
  for (const auto& [key, value] : document.items()) {
    std::vector<std::string> texts = texts_of(key, value);
    require(texts.size() <= 1 || is_list(key), "\"" + key + "\" is a list; one value is expected");
    if (!texts.empty() && !texts.front().empty()) row.values[key] = std::move(texts);
  }
  return row;
}

std::vector<ManifestRow> json_rows(const std::string& text, bool (*is_list)(const std::string&),
                                   ManifestErrors& errors) {
  std::vector<ManifestRow> rows;
  std::istringstream lines(text);
  std::size_t number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    if (unquoted(line.ends_with('\r') ? line.substr(0, line.size() - 1) : line).empty()) continue;
    try {
      rows.push_back(json_row(line, is_list));
      rows.back().line = number;
    } catch (const InputError& error) {
      errors.add(number, error.what());
    }
  }
  return rows;
}

}  // namespace

bool is_plain_name(const std::string& name) {
  const auto is_letter = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0; };
  return !name.empty() && name.size() <= kLongestName && is_letter(name.front()) &&
         std::all_of(name.begin(), name.end(),
                     [&](char c) { return is_letter(c) || c == '.' || c == '_' || c == '-'; });
}

void ManifestErrors::add(std::size_t line, const std::string& what) { lines_.emplace(line, what); }

void ManifestErrors::throw_if_any() const {
  if (lines_.empty()) return;
  std::string text;
  std::set<std::string> said;
  for (const auto& [line, what] : lines_) {
    const std::string one = shown(name_) + ":" + std::to_string(line) + ": " + what;
    if (!said.insert(one).second) continue;
    if (said.size() > kMostShown) {
      text += "\nand more";
      break;
    }
    text += (text.empty() ? "" : "\n") + one;
  }
  throw InputError(text);
}

std::vector<ManifestRow> read_rows(const fs::path& manifest, bool (*is_list)(const std::string&),
                                   ManifestErrors& errors) {
  const std::string suffix = manifest.extension().string();
  require(suffix == ".csv" || suffix == ".jsonl" || suffix == ".ndjson",
          "unknown suffix of the manifest " + shown(manifest) + "; .csv, .jsonl and .ndjson are read");
  const std::string text = read_all(manifest);
  return suffix == ".csv" ? csv_rows(text, shown(manifest), is_list, errors) : json_rows(text, is_list, errors);
}

}  // namespace tetwarp::apps
