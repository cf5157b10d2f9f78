// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to programs: what must not be written over.
#include <sys/types.h>

#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

namespace tetwarp {

/// Where a path leads, as the system resolves it when a file is opened: links first, then "..". What does not exist
/// yet, also behind a link that leads nowhere, is named in the deepest folder that does.
std::filesystem::path real_path(const std::filesystem::path& path);

/// Files and folders that are read, by what they are on the disk: another spelling, a link, a hard link or a folder
/// that is mounted twice is the same place.
class ReadPlaces {
 public:
  /// A path that leads nowhere counts by its name.
  void add(const std::filesystem::path& path);

  /// Of what is read, as it was added: what an output is, is inside or is around; nothing if it is clear of all.
  std::optional<std::filesystem::path> touched_by(const std::filesystem::path& output) const;

 private:
  using Identity = std::pair<dev_t, ino_t>;
  static std::optional<Identity> identity_of(const std::filesystem::path& path);
  std::filesystem::path in_real_folder(const std::filesystem::path& path);
  void add_around(const std::filesystem::path& inner, std::size_t number);

  std::vector<std::filesystem::path> given_;
  std::map<std::filesystem::path, std::size_t> names_;  ///< real paths, and which was given
  /// By identity: which of the given paths it is, and which has that folder around it.
  std::map<Identity, std::size_t> identities_, around_;
  std::set<std::filesystem::path> seen_around_;  ///< folders whose parents are all known
  std::map<std::filesystem::path, std::filesystem::path> real_folders_;
};

}  // namespace tetwarp
