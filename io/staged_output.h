// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string_view>

namespace tetwarp {

/// A file or folder that appears under its name only when it is complete.
///
/// Work goes to `path()`, a hidden file or folder beside the target with the same suffix (`.tetwarp-partial-PID-NAME`).
/// It exists, empty, from the start, so that a place which cannot be written is known before the work begins; `commit`
/// renames it. If the object is destroyed before that it is removed, and whatever has the target's name is untouched. A
/// process that is killed leaves it under its hidden name. A target that is a symbolic link stays one: the file to
/// which it leads is written. Several objects may be used by several threads at a time, each by one of them.
class StagedOutput {
 public:
  /// Whether the output is a file or a folder.
  enum class Kind {
    file,   ///< a regular file
    folder  ///< a folder with files
  };

  /// @param target     name of the output
  /// @param kind       file or folder
  /// @param overwrite  whether an existing target may be replaced; an empty folder counts as absent
  /// @param is_ours    tells whether Tetwarp wrote a regular file. A folder is replaced only if this holds for all of
  ///         its files.
  /// @throws Error when the target exists and may not be replaced, or its parent is missing or cannot be written
  StagedOutput(std::filesystem::path target, Kind kind, bool overwrite,
               bool (*is_ours)(const std::filesystem::path&) = nullptr);
  /// Removes the output unless it has its name.
  ~StagedOutput();
  StagedOutput(const StagedOutput&) = delete;
  StagedOutput& operator=(const StagedOutput&) = delete;

  /// Where to write.
  const std::filesystem::path& path() const { return staged_; }
  /// Name of the complete output.
  const std::filesystem::path& target() const { return target_; }

  /// Flushes the output to disk and gives it its name. A folder that is replaced changes places with the new one and is
  /// removed last.
  /// @throws Error with the path and the reason that the system gives, such as a full disk; then nothing is lost
  void commit();

  // What `commit` does, in steps, so that of several outputs all can be written before the first gets its name.

  /// First step of `commit`: flushes what was written to disk.
  /// @throws Error
  void flush_content() const;
  /// Second step of `commit`: gives the output its name. The entry of its folder is not yet flushed.
  /// @throws Error
  void give_name();
  /// Undoes `give_name` where the name was free before. An output that replaced something stays.
  void take_name_back();

 private:
  /// Whether something will be replaced. Throws where that is not allowed.
  bool check_target() const;

  std::filesystem::path target_, staged_;
  Kind kind_;
  bool overwrite_, done_ = false, replaced_ = false;
  bool (*is_ours_)(const std::filesystem::path&);
};

/// Writes a file that is not there yet. It appears when it is complete.
/// @throws Error where it exists, or cannot be written
void write_new_file(const std::filesystem::path& path, std::string_view bytes);

/// Removes all outputs of this process that have no name yet, for a process that ends without running destructors.
/// After this call no StagedOutput can be made or destroyed; end the process.
void remove_unfinished_outputs() noexcept;

/// Commits several outputs: all are flushed to disk, then renamed one right after another. A process that is killed
/// leaves all or none of them, except at the moment of renaming.
/// @throws Error, after which no output has its name unless it replaced something
void commit_together(std::span<const std::unique_ptr<StagedOutput>> outputs);

}  // namespace tetwarp
