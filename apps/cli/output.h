// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <vector>

#include "apps/cli/console.h"
#include "apps/cli/record.h"
#include "deform/residuals.h"
#include "io/dicom_series.h"
#include "io/read_places.h"
#include "io/staged_output.h"

namespace tetwarp::apps {

class Reads;

/// Whether an output's name means a folder that receives a DICOM series: no suffix, or a trailing slash.
/// @throws UsageError for a suffix that is not one of a volume file
bool is_series_output(const std::filesystem::path& output);

/// The outputs of one command: checked and begun before any work, given their names together at its end.
class OutputSet {
 public:
  /// @param folder  that all outputs are to lie in, directly, and that appears as a whole; empty: each by itself
  /// @param only_look  names are checked, and nothing is begun: for a folder whose place does not exist yet
  /// @throws Error where the folder cannot be begun
  OutputSet(const Reads& reads, bool overwrite, const std::filesystem::path& folder = {}, bool only_look = false);

  /// More that is read, as it becomes known. @throws UsageError where an output touches it
  void add_reads(const std::vector<std::filesystem::path>& files);
  /// @throws UsageError for a place that is, is inside or is around what is read
  void refuse_reads(const std::filesystem::path& target) const;

  /// Begins an output.
  /// @return where to write it; empty for an empty target, which stands for no output
  /// @throws UsageError where it is equal to, inside or around an input or another output
  /// @throws Error where it cannot be begun
  std::filesystem::path add(const std::filesystem::path& target, StagedOutput::Kind kind = StagedOutput::Kind::file);
  void commit();
  /// Where the folder is staged. @pre there is one
  const std::filesystem::path& folder() const { return staged_.front()->path(); }

  /// Runs `write`; an Error that names the place where an output is staged names the output itself instead.
  void write(const std::function<void()>& write);

 private:
  void take_place(const std::filesystem::path& target);

  ReadPlaces reads_;
  std::vector<std::filesystem::path> targets_;
  std::map<std::filesystem::path, std::filesystem::path> places_;  // from where a target really lies to its name
  bool overwrite_, together_, only_look_;
  std::vector<std::unique_ptr<StagedOutput>> staged_;
};

/// @throws UsageError for an output that is, is inside or is around what is read
void refuse_reads(const ReadPlaces& reads, const std::filesystem::path& output);

/// What a folder of outputs says of itself, and by which it is known as Tetwarp's: `files`, names relative to it.
inline constexpr const char* kFolderRecord = "case.json";

/// OUTPUT.json beside OUTPUT.
std::filesystem::path sidecar_of(const std::filesystem::path& output);

/// STEM.json beside STEM.nii or STEM.nii.gz; empty beside anything else.
std::filesystem::path bids_sidecar_of(const std::filesystem::path& output);

/// Where the Nth of several outputs goes: OUTPUT with the number before its suffix, `field.0020.nii.gz`.
/// @param most  the highest number, whose digits all of them have, at least four
std::filesystem::path frame_path(const std::filesystem::path& output, int number, int most);

nlohmann::json to_json(const Geometry& geometry);
nlohmann::json to_json(const Residuals& residuals);

/// Version, commit, command: what every sidecar and report begins with.
nlohmann::json provenance(const std::string& command);

}  // namespace tetwarp::apps
