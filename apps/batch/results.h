// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <fstream>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/batch/case_run.h"
#include "apps/batch/output_folder.h"

namespace tetwarp::apps {

/// The lines of a file of JSON Lines by the case to which they belong, the last one if a case has several. Other lines
/// are left out, and so are lines that a killed run left incomplete.
std::map<std::string, nlohmann::json> read_lines(const std::filesystem::path& path);

/// Numbers of cases that are done, and that are not.
struct Tally {
  std::size_t done = 0, failed = 0, missing = 0;
};

/// The results of the cases of one OUTPUT_DIR and shard. Lines are added to the files as cases end, and put into the
/// order of the manifest once the batch ends.
class Results {
 public:
  /// @param ids  of the cases, in the order of the manifest
  Results(const OutputFolder& folder, std::vector<std::string> ids);

  /// Adds a case that an earlier run finished.
  void keep(const nlohmann::json& line);
  /// Adds a case that has ended. Several threads may call it at a time. @throws Error where a line cannot be written
  void add(const CaseOutcome& outcome);
  /// Writes the files again, with lines in the order of the manifest. @throws Error
  void finish() const;

  Tally tally() const;
  /// A table for people with a line for each case, or for each case that is not done.
  std::string table(bool all) const;

 private:
  const OutputFolder& folder_;
  std::vector<std::string> ids_;
  std::map<std::string, nlohmann::json> lines_, timings_;
  std::ofstream growing_results_, growing_timings_;
  mutable std::mutex mutex_;
};

/// Joins the records of all shards of a batch, for `batch --merge`.
/// @throws Error where shards or cases are missing
Tally merge_shards(const std::filesystem::path& folder, const std::vector<std::string>& ids, std::string& table);

}  // namespace tetwarp::apps
