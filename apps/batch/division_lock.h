// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tetwarp::apps {

/// How the cases of a batch are shared out.
struct Division {
  std::size_t shards = 1;
  std::string cases_sha256;  ///< of the ids, in the order of the manifest

  friend bool operator==(const Division&, const Division&) = default;
};

/// @param ids  of all cases
Division division_of(std::size_t shards, const std::vector<std::string>& ids);

/// A lock that processes hold side by side as long as they divide the same cases in the same way, so that no two have
/// a case in common. It is the kernel's (flock) and ends with the process, however that ends.
class DivisionLock {
 public:
  /// @param folder  OUTPUT_DIR, whose `batch.lock` says what the division is
  /// @throws Error where processes with another division hold it, or the file cannot be written; Cancelled
  DivisionLock(const std::filesystem::path& folder, const Division& division);
  ~DivisionLock();
  DivisionLock(const DivisionLock&) = delete;
  DivisionLock& operator=(const DivisionLock&) = delete;

 private:
  bool try_to_take(const Division& division);

  std::filesystem::path path_;
  int file_ = -1;
  Division found_;  ///< of those who hold it
};

}  // namespace tetwarp::apps
