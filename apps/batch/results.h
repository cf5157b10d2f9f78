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

/// The lines of a file of JSON Lines by the case that they are of, the last where there are several; others, and such
/// as a killed run has torn, are left out.
std::map<std::string, nlohmann::json> read_lines(const std::filesystem::path& path);

/// Numbers of cases that are done, and that are not.
struct Tally {
  std::size_t done = 0, failed = 0, missing = 0;
};

/// What became of the cases of one OUTPUT_DIR and shard. Lines go to the files as cases end, in the order of the
/// manifest once the batch ends.
class Results {
 public:
  /// @param ids  of the manifest, in its order
  Results(const OutputFolder& folder, std::vector<std::string> ids);

  /// A case that an earlier run finished.
  void keep(const nlohmann::json& line);
  /// May be called by several threads. @throws Error where a line cannot be written
  void add(const CaseOutcome& outcome);
  /// Writes the files anew, in order. @throws Error
  void finish() const;

  Tally tally() const;
  /// For people: one line a case, or those of cases that are not done.
  std::string table(bool all) const;

 private:
  const OutputFolder& folder_;
  std::vector<std::string> ids_;
  std::map<std::string, nlohmann::json> lines_, timings_;
  std::ofstream growing_results_, growing_timings_;
  mutable std::mutex mutex_;
};

/// Joins what the shards of a batch have recorded: `batch --merge`.
/// @throws Error where shards or cases are missing
Tally merge_shards(const std::filesystem::path& folder, const std::vector<std::string>& ids, std::string& table);

}  // namespace tetwarp::apps
