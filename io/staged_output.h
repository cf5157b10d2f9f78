#pragma once

#include <filesystem>

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

  /// Flushes to disk and gives it its name. A folder that is replaced is moved aside first and removed last.
  /// @throws Error naming the path and the system's reason (disk full and so on); nothing is lost then
  void commit();

 private:
  bool check_target() const;  ///< whether something will be replaced; throws where that is not allowed

  std::filesystem::path target_, staged_;
  Kind kind_;
  bool overwrite_, done_ = false;
  bool (*is_ours_)(const std::filesystem::path&);
};

}  // namespace tetwarp
