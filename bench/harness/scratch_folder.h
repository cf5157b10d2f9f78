// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>

namespace tetwarp::bench {

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

}  // namespace tetwarp::bench
