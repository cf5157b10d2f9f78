// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/read_places.h"

#include <sys/stat.h>

#include <algorithm>
#include <system_error>

namespace tetwarp {

namespace fs = std::filesystem;

namespace {

constexpr int kMostLinks = 40;  // as many as the kernel follows

fs::path folder_of(const fs::path& path) { return path.has_parent_path() ? path.parent_path() : fs::path("."); }

}  // namespace

fs::path real_path(const fs::path& path) {
  std::error_code error;
  int links = 0;
  fs::path rest, there = path.has_filename() ? path : path.parent_path();
  for (;;) {
    const fs::path real = fs::canonical(there.empty() ? fs::path(".") : there, error);
    if (!error) return rest.empty() ? real : (real / rest).lexically_normal();
    if (fs::is_symlink(there, error) && ++links <= kMostLinks) {  // also a link that leads nowhere yet
      there = folder_of(there) / fs::read_symlink(there, error);
      if (!error) continue;
    }
    if (!there.has_relative_path()) break;
    rest = rest.empty() ? there.filename() : there.filename() / rest;
    there = there.parent_path();
  }
  return path.lexically_normal();  // the root, or the working folder, cannot be read
}

std::optional<ReadPlaces::Identity> ReadPlaces::identity_of(const fs::path& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return std::nullopt;
  return Identity(status.st_dev, status.st_ino);
}

void ReadPlaces::add_around(const fs::path& inner, std::size_t number) {
  for (fs::path folder = inner.parent_path(); seen_around_.insert(folder).second; folder = folder.parent_path()) {
    if (const auto identity = identity_of(folder)) around_.emplace(*identity, number);
  }
}

/// The path with its folder resolved but its own name as it is, whether or not it is a link. A folder of many files is
/// resolved once.
fs::path ReadPlaces::in_real_folder(const fs::path& path) {
  const fs::path plain = path.has_filename() ? path : path.parent_path(), name = plain.filename();
  if (name.empty() || name == "." || name == "..") return real_path(plain);
  const auto [folder, is_new] = real_folders_.try_emplace(folder_of(plain));
  if (is_new) folder->second = real_path(folder->first);
  return folder->second / name;
}

void ReadPlaces::add(const fs::path& path) {
  const std::size_t number = given_.size();
  given_.push_back(path);
  const fs::path there = in_real_folder(path);
  std::error_code error;
  const fs::path real = fs::is_symlink(there, error) ? real_path(there) : there;
  names_.emplace(real, number);
  if (const auto identity = identity_of(real)) identities_.emplace(*identity, number);
  add_around(real, number);
  add_around(there, number);  // for a link, the folder in which it lies is not to be overwritten either
}

std::optional<fs::path> ReadPlaces::touched_by(const fs::path& output) const {
  const fs::path real = real_path(output);
  for (fs::path place = real;; place = place.parent_path()) {
    if (const auto found = names_.find(place); found != names_.end()) return given_[found->second];
    if (const auto identity = identity_of(place)) {
      if (const auto found = identities_.find(*identity); found != identities_.end()) return given_[found->second];
    }
    if (place == place.parent_path()) break;
  }
  if (const auto identity = identity_of(real)) {
    if (const auto found = around_.find(*identity); found != around_.end()) return given_[found->second];
  }
  for (const auto& [name, number] : names_) {  // inputs that do not exist, which may lie below the output
    if (std::mismatch(real.begin(), real.end(), name.begin(), name.end()).first == real.end()) return given_[number];
  }
  return std::nullopt;
}

}  // namespace tetwarp
