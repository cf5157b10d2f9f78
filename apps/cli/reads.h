// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/cli/input.h"
#include "apps/cli/options.h"
#include "apps/fields/field_choice.h"

namespace tetwarp::apps {

/// What a command reads, whoever names it: its options, or a file that they name. The one answer for what must not be
/// written over (OutputSet), and for what decides whether a case of a batch is still the same (batch/case_record.h).
class Reads {
 public:
  void add_file(const std::filesystem::path& path);
  /// A volume file, or a DICOM series with all of its slices.
  void add_volume(const InputOptions& volume);
  /// The files of a field, as `files_of` has them.
  void add_field(const FieldChoice& field);

  /// All paths, those first that options name. DICOM is not looked at: see `slices`.
  const std::vector<std::filesystem::path>& paths() const& { return paths_; }
  void paths() const&& = delete;
  /// Files of the series among the volumes, by their headers.
  /// @param opened  one of the volumes whose header is known, with it
  /// @throws what open_input throws
  std::vector<std::filesystem::path> slices(const InputOptions& opened, const InputHeader& header) const;
  /// SHA-256 of each file and volume, hexadecimal, in the order in which they were added.
  /// @throws InputError for one that cannot be read
  std::vector<std::string> digests(int threads) const;

 private:
  struct Input {
    InputOptions volume;  ///< of a file its path alone
    bool is_volume = false;
  };
  std::vector<Input> all_;
  std::vector<std::filesystem::path> paths_;
};

/// Of a command that reads a field and a volume.
Reads reads_of(const FieldChoice& field, const InputOptions& volume);
Reads reads_of(const SimulateOptions& options);

/// SHA-256 of a volume as sidecars give it, without reading voxels. @throws InputError
std::string hash_volume(const InputOptions& volume, int threads);

}  // namespace tetwarp::apps
