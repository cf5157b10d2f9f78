// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tetwarp::apps {

/// How the cases of a batch are divided into shards (`batch --shard N/M`).
struct Division {
  std::size_t shards = 1;    ///< M; 1: the batch is not divided
  std::string cases_sha256;  ///< hash of the ids, in the order of the manifest

  friend bool operator==(const Division&, const Division&) = default;
};

/// The division of some cases. @param ids  of all cases, in the order of the manifest
Division division_of(std::size_t shards, const std::vector<std::string>& ids);

/// The file of the lock below, in OUTPUT_DIR.
constexpr const char* kDivisionLockName = "batch.lock";

/// A lock that several processes hold at the same time as long as they divide the same cases in the same way, so that
/// no two shards have a case in common. That two processes do not take the same shard is not its work. The kernel keeps
/// it (flock) and releases it when the process ends, however that ends; on a file system without such locks it is
/// always taken.
class DivisionLock {
 public:
  /// Takes the lock; waits up to 1.5 s, for other processes may be beginning or ending.
  /// @param folder  OUTPUT_DIR, whose `batch.lock` states the division
  /// @throws Error where processes with another division hold it, or the file cannot be written; Cancelled
  DivisionLock(const std::filesystem::path& folder, const Division& division);
  ~DivisionLock();
  DivisionLock(const DivisionLock&) = delete;
  DivisionLock& operator=(const DivisionLock&) = delete;

 private:
  bool try_to_take(const Division& division);

  std::filesystem::path path_;
  int file_ = -1;
  Division found_;  ///< division of the processes that hold the lock
};

}  // namespace tetwarp::apps
