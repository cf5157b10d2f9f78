// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <memory>
#include <span>

namespace tetwarp {

/// A file or folder that appears under its name only when it is complete.
///
/// Work goes to `path()`, a hidden sibling of the same suffix (`.tetwarp-partial-PID-NAME`), which exists, empty, from
/// the start (so a place that cannot be written to is known before the work) and which `commit` renames. If the object
/// dies before that, the sibling is removed and whatever had the name is untouched. A target that is a symbolic link
/// stays one: what it names is written.
class StagedOutput {
 public:
  enum class Kind { file, folder };

  /// @throws Error when `target` exists and `overwrite` is false (an empty folder counts as absent), when its parent is
  ///         missing or not writable; for a folder to be replaced: when a file in it is not Tetwarp's
  ///         (`is_ours` decides for each regular file; sidecars are outside the folder)
  StagedOutput(std::filesystem::path target, Kind kind, bool overwrite,
               bool (*is_ours)(const std::filesystem::path&) = nullptr);
  ~StagedOutput();
  StagedOutput(const StagedOutput&) = delete;
  StagedOutput& operator=(const StagedOutput&) = delete;

  const std::filesystem::path& path() const { return staged_; }
  const std::filesystem::path& target() const { return target_; }

  /// Flushes to disk and gives it its name. A folder that is replaced changes places with this one and is removed last.
  /// @throws Error naming the path and the system's reason (disk full and so on); nothing is lost then
  void commit();

  // What `commit` does, in steps, so that of several outputs all can be written before the first gets its name.

  /// Flushes what was written to disk. @throws Error
  void flush_content() const;
  /// Gives it its name; the folder's entry is not flushed yet. @throws Error
  void give_name();
  /// Removes what `give_name` gave a name that was free before; what it replaced something by stays.
  void take_name_back();

 private:
  bool check_target() const;  ///< whether something will be replaced; throws where that is not allowed

  std::filesystem::path target_, staged_;
  Kind kind_;
  bool overwrite_, done_ = false, replaced_ = false;
  bool (*is_ours_)(const std::filesystem::path&);
};

/// Removes what the StagedOutputs of this process have not given a name yet, for one that ends without destructors.
/// No other can be created or destroyed behind it: end the process.
void remove_unfinished_outputs() noexcept;

/// Gives several outputs their names, one right after the other once all of them are on the disk, so that a process
/// that is killed leaves all or none of them but for the instant of the renames. @throws Error, and no output has its
/// name that had been free
void commit_together(std::span<const std::unique_ptr<StagedOutput>> outputs);

}  // namespace tetwarp
