// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/batch/results.h"

#include <algorithm>
#include <cstdio>

#include "deform/errors.h"

namespace tetwarp::apps {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

std::string dumped(const json& line) { return line.dump(-1, ' ', false, json::error_handler_t::replace) + "\n"; }

std::string in_order(const std::vector<std::string>& ids, const std::map<std::string, json>& lines) {
  std::string text;
  for (const std::string& id : ids) {
    if (const auto line = lines.find(id); line != lines.end()) text += dumped(line->second);
  }
  return text;
}

bool is_done(const json& line) { return line.value("status", "") == "done"; }

std::string share_of(const json& report) {
  const double covered = report.value("covered", 0.0), all = covered + report.value("uncovered", 0.0);
  char text[32];
  std::snprintf(text, sizeof text, "%.2f %%", all > 0 ? 100 * covered / all : 0);
  return text;
}

/// A row of the table with its columns: case, status, covered, folds, reason.
std::string row(std::size_t width, const std::string& id, const std::string& status, const std::string& covered,
                const std::string& folds, const std::string& reason) {
  const auto padded = [](std::string text, std::size_t to) {
    if (text.size() < to) text.append(to - text.size(), ' ');
    return text;
  };
  std::string line = padded(id, width) + "  " + padded(status, 7) + "  " + padded(covered, 9) + "  " +
                     padded(folds, 8) + "  " + reason;
  line.erase(line.find_last_not_of(' ') + 1);
  return line + "\n";
}

Tally tally_of(const std::vector<std::string>& ids, const std::map<std::string, json>& lines) {
  Tally tally;
  for (const std::string& id : ids) {
    const auto line = lines.find(id);
    if (line == lines.end())
      ++tally.missing;
    else
      ++(is_done(line->second) ? tally.done : tally.failed);
  }
  return tally;
}

std::string table_of(const std::vector<std::string>& ids, const std::map<std::string, json>& lines, bool all) {
  std::size_t width = 4;
  for (const std::string& id : ids) width = std::max(width, id.size());
  std::string text;
  for (const std::string& id : ids) {
    const auto found = lines.find(id);
    if (found == lines.end()) {
      if (all) text += row(width, id, "not run", "", "", "");
      continue;
    }
    const json& line = found->second;
    if (is_done(line) && !all) continue;
    const json report = line.value("report", json::object());
    const std::string folds =
        report.empty()
            ? ""
            : std::to_string(report.value("inverted", std::uint64_t{0}) + report.value("degenerate", std::uint64_t{0}));
    text += row(width, id, line.value("status", ""), report.empty() ? "" : share_of(report), folds,
                line.value("reason", ""));
  }
  if (!text.empty()) text = row(width, "case", "status", "covered", "folded", "") + text;
  const Tally tally = tally_of(ids, lines);
  text += std::to_string(tally.done) + " of " + std::to_string(ids.size()) + " cases done";
  if (tally.failed > 0) text += ", " + std::to_string(tally.failed) + " failed";
  if (tally.missing > 0) text += ", " + std::to_string(tally.missing) + " not run";
  return text + "\n";
}

}  // namespace

std::map<std::string, json> read_lines(const fs::path& path) {
  std::map<std::string, json> lines;
  std::ifstream file(path, std::ios::binary);
  for (std::string text; std::getline(file, text);) {
    json line = json::parse(text, nullptr, false);
    if (!line.is_object() || !line.contains("case") || !line["case"].is_string()) continue;
    const std::string id = line["case"];
    lines[id] = std::move(line);
  }
  return lines;
}

Results::Results(const OutputFolder& folder, std::vector<std::string> ids)
    : folder_(folder), ids_(std::move(ids)), timings_(read_lines(folder.timings())) {}

void Results::keep(const json& line) {
  const std::lock_guard lock(mutex_);
  lines_[line["case"]] = line;
}

void Results::add(const CaseOutcome& outcome) {
  const std::lock_guard lock(mutex_);
  if (!growing_results_.is_open()) {
    growing_results_.open(folder_.results(), std::ios::binary | std::ios::app);
    growing_timings_.open(folder_.timings(), std::ios::binary | std::ios::app);
  }
  const json &line = outcome.line.document(), &timing = outcome.timing.document();
  const std::string id = line["case"];
  lines_[id] = line;
  timings_[id] = timing;
  growing_results_ << dumped(line) << std::flush;
  growing_timings_ << dumped(timing) << std::flush;
}

void Results::finish() const {
  const std::lock_guard lock(mutex_);
  write_whole(folder_.results(), in_order(ids_, lines_));
  write_whole(folder_.timings(), in_order(ids_, timings_));
  write_whole(folder_.summary(), table_of(ids_, lines_, true));
}

Tally Results::tally() const {
  const std::lock_guard lock(mutex_);
  return tally_of(ids_, lines_);
}

std::string Results::table(bool all) const {
  const std::lock_guard lock(mutex_);
  return table_of(ids_, lines_, all);
}

namespace {

/// The number N in the names of files results.I-of-N.jsonl in a folder. @throws Error where there is no such file, or N
/// differs between them
std::size_t shard_count(const fs::path& folder) {
  std::size_t count = 0;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::optional<Shard> shard = shard_of(entry.path(), "results", ".jsonl");
    if (!shard) continue;
    if (count != 0 && count != shard->count) {
      throw Error("the folder has results of " + std::to_string(count) + " shards and of " +
                  std::to_string(shard->count) + ", " + folder.string() + "; remove those that are not meant");
    }
    count = shard->count;
  }
  if (error) throw Error("cannot list " + folder.string() + ": " + error.message());
  if (count == 0) throw Error("no results of shards, " + folder.string() + "; run them with --shard I/N first");
  return count;
}

}  // namespace

Tally merge_shards(const fs::path& folder, const std::vector<std::string>& ids, std::string& table) {
  const std::size_t count = shard_count(folder);
  const DivisionLock lock(folder, division_of(count, ids));
  std::map<std::string, json> lines, timings;
  for (std::size_t number = 1; number <= count; ++number) {
    const std::string mark = Shard{number, count}.mark();
    lines.merge(read_lines(folder / ("results" + mark + ".jsonl")));
    timings.merge(read_lines(folder / ("timings" + mark + ".jsonl")));
  }
  std::string missing;
  std::size_t how_many = 0;
  for (std::size_t n = 0; n < ids.size(); ++n) {
    if (lines.contains(ids[n])) continue;
    if (++how_many <= 10)
      missing += (missing.empty() ? "" : ", ") + ids[n] + " (shard " + std::to_string(n % count + 1) + ")";
  }
  if (how_many > 0) {
    throw Error(std::to_string(how_many) + " cases have no result, " + folder.string() + ": " + missing +
                (how_many > 10 ? " and others" : "") + "; run their shards with --resume");
  }
  write_whole(folder / "results.jsonl", in_order(ids, lines));
  write_whole(folder / "timings.jsonl", in_order(ids, timings));
  table = table_of(ids, lines, true);
  write_whole(folder / "summary.txt", table);
  return tally_of(ids, lines);
}

}  // namespace tetwarp::apps
