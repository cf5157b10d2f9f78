// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/batch/progress.h"

#include <unistd.h>

#include <cstdio>
#include <ctime>
#include <nlohmann/json.hpp>

#include "io/dicom_text.h"
#include "io/shown_text.h"

namespace tetwarp::apps {

using nlohmann::json;

namespace {

constexpr int kBarWidth = 30;

std::string utc_now() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  gmtime_r(&now, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts);
  return text;
}

std::string duration_text(double seconds) {
  char text[32];
  const long whole = static_cast<long>(seconds + 0.5);
  if (whole >= 3600)
    std::snprintf(text, sizeof text, "%ld h %02ld min", whole / 3600, whole / 60 % 60);
  else if (whole >= 60)
    std::snprintf(text, sizeof text, "%ld min %02ld s", whole / 60, whole % 60);
  else
    std::snprintf(text, sizeof text, "%ld s", whole);
  return text;
}

const char* name_of(CaseStatus status) {
  return status == CaseStatus::done ? "done" : status == CaseStatus::failed ? "failed" : "refused";
}

}  // namespace

BatchProgress::BatchProgress(Form form) : form_(form), terminal_(isatty(STDERR_FILENO) != 0) {}

void BatchProgress::begin(std::size_t cases, std::size_t finished) {
  const std::lock_guard lock(mutex_);
  cases_ = cases;
  start_ = std::chrono::steady_clock::now();
  print({{"event", "batch"}, {"cases", cases}, {"finished_before", finished}});
}

BatchProgress::~BatchProgress() { clear(); }

void BatchProgress::clear() {
  if (visible_) std::fprintf(stderr, "\r\033[K");
  visible_ = false;
}

void BatchProgress::print(const json& event) {
  if (form_ != Form::machine) return;
  json timed = event;
  timed["time"] = utc_now();
  std::fprintf(stderr, "%s\n", timed.dump(-1, ' ', false, json::error_handler_t::replace).c_str());
}

void BatchProgress::print(const std::string& line) {
  if (form_ != Form::person) return;
  clear();
  std::fprintf(stderr, "%s\n", shown_lines(line).c_str());
}

void BatchProgress::started(const std::string& id) {
  const std::lock_guard lock(mutex_);
  print({{"event", "start"}, {"case", id}});
}

void BatchProgress::ended(const CaseOutcome& outcome) {
  const std::lock_guard lock(mutex_);
  const std::string id = outcome.line.document()["case"];
  ++(outcome.status == CaseStatus::done ? done_ : failed_);
  json event = {{"event", name_of(outcome.status)}, {"case", id}, {"done", done_}, {"failed", failed_}};
  if (outcome.status != CaseStatus::done) {
    event["reason"] = outcome.reason;
    const std::string said = "tetwarp: case " + id + " " + name_of(outcome.status) + ": " + outcome.reason;
    print(said);
    // True for a de-identified case, whose reason no file names.
    const bool only_here = outcome.line.document()["reason"] != outcome.reason;
    if (only_here && form_ == Form::none) std::fprintf(stderr, "%s\n", shown_lines(said).c_str());
  }
  if (!outcome.made_again.empty()) {
    event["made_again"] = outcome.made_again;
    for (const std::string& reason : outcome.made_again)
      print("tetwarp: warning: case " + id + " was made again: " + reason);
  }
  print(event);
}

void BatchProgress::warn(const std::string& text) {
  const std::lock_guard lock(mutex_);
  print("tetwarp: warning: " + text);
  print({{"event", "warning"}, {"text", text}});
}

void BatchProgress::again(const std::string& reason, const std::vector<std::string>& ids) {
  constexpr std::size_t kMostShown = 10;
  const std::lock_guard lock(mutex_);
  std::string listed;
  for (std::size_t n = 0; n < std::min(ids.size(), kMostShown); ++n) listed += (n == 0 ? "" : ", ") + ids[n];
  if (ids.size() > kMostShown) listed += " and " + std::to_string(ids.size() - kMostShown) + " more";
  print("tetwarp: made again: " + plural(ids.size(), "case") + ", " + reason + ": " + listed);
  print({{"event", "again"}, {"cases", ids.size()}, {"reason", reason}, {"ids", ids}});
}

void BatchProgress::draw() {
  const std::lock_guard lock(mutex_);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  if (form_ != Form::person || !terminal_ || seconds < 1 || cases_ == 0) return;
  const std::size_t ended = done_ + failed_;
  const int filled = static_cast<int>(kBarWidth * ended / cases_);
  std::string line = "[" + std::string(static_cast<std::size_t>(filled), '#') +
                     std::string(static_cast<std::size_t>(kBarWidth - filled), '.') + "] " + std::to_string(ended) +
                     " of " + std::to_string(cases_) + " cases";
  if (failed_ > 0) line += ", " + std::to_string(failed_) + " failed";
  if (ended > 0) {
    char rate[32];
    std::snprintf(rate, sizeof rate, "%.3g", 60 * static_cast<double>(ended) / seconds);
    line += std::string(", ") + rate + " a minute, " +
            duration_text(seconds / static_cast<double>(ended) * static_cast<double>(cases_ - ended)) + " left";
  }
  visible_ = true;
  std::fprintf(stderr, "\r\033[K%s", line.c_str());
  std::fflush(stderr);
}

void BatchProgress::end(const json& summary) {
  const std::lock_guard lock(mutex_);
  clear();
  json event = summary;
  event["event"] = "end";
  print(event);
}

}  // namespace tetwarp::apps
