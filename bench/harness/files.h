// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tetwarp::bench {

/// Throws before the work where `write_text` could not write after it, or would write over what is read. An empty path
/// is no file.
void require_writable(const std::filesystem::path& path, const std::vector<std::filesystem::path>& reads = {});

/// The file appears when it is complete; one that is there is replaced. An empty path writes nothing. @throws Error
void write_text(const std::filesystem::path& path, const std::string& text);

/// A folder of its own under another, removed with all that is in it.
class ScratchFolder {
 public:
  /// @param parent  empty: the system's folder for temporary files
  /// @throws Error naming the folder and the system's reason
  explicit ScratchFolder(const std::filesystem::path& parent);
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// Runs a program to its end, with this program's environment and standard streams.
/// @param arguments  the first is the program's path
/// @throws Error when it cannot be run or fails
void run_program(const std::vector<std::string>& arguments);

}  // namespace tetwarp::bench
