// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/batch/output_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>

#include "apps/cli/options.h"
#include "deform/errors.h"
#include "io/lower_case.h"
#include "io/staged_output.h"

namespace tetwarp::apps {

namespace fs = std::filesystem;
using nlohmann::json;

namespace {

std::string reason() { return std::generic_category().message(errno); }

/// Whether a batch was begun in this folder in shards.
bool holds_shards(const fs::path& folder) {
  std::error_code error;
  const fs::directory_iterator entries(folder, error);
  return std::any_of(begin(entries), end(entries),
                     [](const auto& entry) { return shard_of(entry.path(), "batch", ".json").has_value(); });
}

/// Whether a folder holds anything but what a batch leaves that was killed before it was begun: the lock of its
/// division.
bool holds_others(const fs::path& folder) {
  const fs::directory_iterator entries(folder);
  return std::any_of(begin(entries), end(entries),
                     [](const auto& entry) { return entry.path().filename() != kDivisionLockName; });
}

/// Whether a file has a hidden name of StagedOutput, `.tetwarp-partial-PID-NAME`, or one that was given to it when it
/// was dropped, that stands for one of these names.
bool is_unfinished(const std::string& name, const std::vector<std::string>& names) {
  for (const std::string prefix : {".tetwarp-partial-", ".tetwarp-dropped-", ".tetwarp-replaced-"}) {
    if (!name.starts_with(prefix)) continue;
    const std::size_t end = name.find('-', prefix.size());
    if (end == std::string::npos) return false;
    return std::find(names.begin(), names.end(), name.substr(end + 1)) != names.end();
  }
  return false;
}

}  // namespace

Shard parse_shard(const std::string& text) {
  Shard shard;
  const char *from = text.data(), *const end = from + text.size();
  const auto first = std::from_chars(from, end, shard.number);
  if (first.ec == std::errc() && first.ptr != end && *first.ptr == '/') {
    const auto second = std::from_chars(first.ptr + 1, end, shard.count);
    if (second.ec == std::errc() && second.ptr == end && shard.number >= 1 && shard.number <= shard.count) return shard;
  }
  throw UsageError("--shard is \"" + text + "\", expected I/N with I from 1 to N, 2/8");
}

std::optional<Shard> shard_of(const fs::path& file, const std::string& name, const std::string& suffix) {
  Shard shard;
  int end = 0;
  const std::string found = file.filename().string();
  const std::string form = name + ".%zu-of-%zu" + suffix + "%n";
  if (std::sscanf(found.c_str(), form.c_str(), &shard.number, &shard.count, &end) != 2 ||
      end != static_cast<int>(found.size()))
    return std::nullopt;
  return shard;
}

bool is_file_of_a_batch(const std::string& any_case) {
  const std::string name = lower(any_case), start = name.substr(0, name.find('.'));
  const auto is_of = [&](std::initializer_list<const char*> starts, const char* suffix) {
    return name.ends_with(suffix) && std::ranges::find(starts, start) != starts.end();
  };
  return is_of({"results", "timings"}, ".jsonl") || is_of({"summary"}, ".txt") || is_of({"batch"}, ".json") ||
         is_of({"batch"}, ".lock");
}

OutputFolder::OutputFolder(fs::path path, const Shard& shard, const std::vector<std::string>& ids,
                           const std::string& manifest_sha256, bool resume)
    : path_(path.has_filename() ? std::move(path) : path.parent_path()), shard_(shard) {
  std::error_code error;
  if (fs::exists(path_, error) && !fs::is_directory(path_, error))
    throw Error(path_.string() + " is no folder; choose another name");
  created_ = fs::create_directory(path_, error);
  if (error) throw Error("cannot make the folder " + path_.string() + ": " + error.message());
  begin(ids, resume, manifest_sha256);
}

void OutputFolder::begin(const std::vector<std::string>& ids, bool resume, const std::string& manifest_sha256) {
  const fs::path mark = file("batch", ".json");
  const bool begun = fs::exists(mark) || (shard_.count == 1 && holds_shards(path_));
  if (begun && !resume)
    throw Error("a batch was begun in " + path_.string() + "; continue it with --resume, or choose another folder");
  if (!begun && shard_.count == 1 && !created_ && holds_others(path_))
    throw Error(path_.string() + " is not empty, and no batch was begun in it; choose another folder");
  division_.emplace(path_, division_of(shard_.count, ids));
  lock_ = ::open(mark.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (lock_ < 0) throw Error("cannot write " + mark.string() + ": " + reason());
  if (::flock(lock_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
    throw Error("another process works on this batch, " + path_.string() + "; wait until it has ended");
  const json document = {{"manifest_sha256", manifest_sha256}, {"shard", shard_.number}, {"shards", shard_.count}};
  const std::string text = document.dump() + "\n";
  if (::ftruncate(lock_, 0) != 0 || ::pwrite(lock_, text.data(), text.size(), 0) != static_cast<ssize_t>(text.size()) ||
      ::fsync(lock_) != 0)
    throw Error("cannot write " + mark.string() + ": " + reason());
}

OutputFolder::~OutputFolder() {
  if (lock_ >= 0) ::close(lock_);
}

void OutputFolder::remove_unfinished(const std::vector<std::string>& ids) const {
  std::vector<std::string> names = ids;
  for (const fs::path& own : {results(), timings(), summary()}) names.push_back(own.filename().string());
  std::error_code ignored;
  std::vector<fs::path> partial;
  for (const auto& entry : fs::directory_iterator(path_, ignored)) {
    if (is_unfinished(entry.path().filename().string(), names)) partial.push_back(entry.path());
  }
  for (const fs::path& path : partial) {
    // It is renamed first, so that a process that still works on it cannot give it its final name when it is half
    // removed.
    const std::string name = path.filename().string();
    const fs::path dropped = path_ / (".tetwarp-dropped-" + std::to_string(::getpid()) +
                                      name.substr(name.find('-', sizeof ".tetwarp-partial-")));
    fs::rename(path, dropped, ignored);
    fs::remove_all(ignored ? path : dropped, ignored);
  }
}

std::uint64_t free_bytes(fs::path folder) {
  std::error_code error;
  while (!folder.empty() && !fs::exists(folder, error) && folder.has_relative_path()) folder = folder.parent_path();
  const fs::space_info space = fs::space(folder.empty() ? fs::path(".") : folder, error);
  return error ? UINT64_MAX : space.available;
}

void write_whole(const fs::path& path, const std::string& text) {
  StagedOutput staged(path, StagedOutput::Kind::file, true);
  std::ofstream file(staged.path(), std::ios::binary | std::ios::trunc);
  file << text;
  file.close();
  if (!file) throw Error("cannot be written whole, " + path.string() + "; is the disk full?");
  staged.commit();
}

}  // namespace tetwarp::apps
