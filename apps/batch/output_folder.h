// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/batch/division_lock.h"

namespace tetwarp::apps {

/// A share of the cases: those whose number, from 0, leaves the remainder `number` - 1 when divided by `count`.
struct Shard {
  std::size_t number = 1, count = 1;

  bool holds(std::size_t index) const { return index % count == number - 1; }
  /// What a file's name has before its suffix: ".2-of-4"; empty if there is one shard.
  std::string mark() const { return count == 1 ? "" : "." + std::to_string(number) + "-of-" + std::to_string(count); }
};

/// Parses I/N. @throws UsageError unless 1 <= I <= N
Shard parse_shard(const std::string& text);

/// OUTPUT_DIR of a batch, for one process and one shard. Processes with other shards may write into the same folder at
/// the same time, each to files of its own.
class OutputFolder {
 public:
  /// Creates the folder if it does not exist, and locks the shard and the division, so that no other process makes
  /// these cases.
  /// @param ids              of all cases, those of other shards included
  /// @param manifest_sha256  for the record only: a batch may be resumed with a corrected manifest
  /// @throws Error where the folder is not empty and `resume` is false, where it holds something else than a batch, or
  /// where another process works in it that may make the same cases
  OutputFolder(std::filesystem::path path, const Shard& shard, const std::vector<std::string>& ids,
               const std::string& manifest_sha256, bool resume);
  ~OutputFolder();
  OutputFolder(const OutputFolder&) = delete;
  OutputFolder& operator=(const OutputFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path results() const { return file("results", ".jsonl"); }
  std::filesystem::path timings() const { return file("timings", ".jsonl"); }
  std::filesystem::path summary() const { return file("summary", ".txt"); }
  std::filesystem::path case_folder(const std::string& id) const { return path_ / id; }
  /// Removes what killed runs left of these cases under hidden names, and unfinished files of this run.
  void remove_unfinished(const std::vector<std::string>& ids) const;

 private:
  std::filesystem::path file(const std::string& name, const std::string& suffix) const {
    return path_ / (name + shard_.mark() + suffix);
  }
  void begin(const std::vector<std::string>& ids, bool resume, const std::string& manifest_sha256);

  std::filesystem::path path_;
  Shard shard_;
  bool created_ = false;
  std::optional<DivisionLock> division_;
  int lock_ = -1;
};

/// I and N of a file of a shard, `NAME.I-of-N.SUFFIX`; none for another name.
std::optional<Shard> shard_of(const std::filesystem::path& file, const std::string& name, const std::string& suffix);

/// Whether a batch, or a shard of one, has a file of its own with this name. Upper and lower case are not told apart,
/// since some file systems do not.
bool is_file_of_a_batch(const std::string& name);

/// Bytes that an ordinary user can still write to the file system of a folder.
std::uint64_t free_bytes(std::filesystem::path folder);

/// Writes a text to a file whole or not at all, through StagedOutput. @throws Error
void write_whole(const std::filesystem::path& path, const std::string& text);

}  // namespace tetwarp::apps
