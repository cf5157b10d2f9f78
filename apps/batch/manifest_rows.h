// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace tetwarp::apps {

/// Collects the errors of a manifest, so that a person sees all of them at once.
class ManifestErrors {
 public:
  explicit ManifestErrors(const std::filesystem::path& manifest) : name_(manifest.string()) {}

  void add(std::size_t line, const std::string& what);
  bool empty() const { return lines_.empty(); }
  /// @throws InputError with all errors, by line; the first hundred if there are more
  void throw_if_any() const;

 private:
  std::string name_;
  std::multimap<std::size_t, std::string> lines_;
};

/// Most letters of a name that a row gives its folder.
inline constexpr std::size_t kLongestName = 100;
/// Whether a name can be that of a folder on every system: letters, digits, '.', '_' and '-', not too many, a letter or
/// digit first.
bool is_plain_name(const std::string& name);

/// A row as it is in the manifest: the keys that are given, each with one value or the values of a list.
struct ManifestRow {
  std::size_t line = 0;
  std::map<std::string, std::vector<std::string>> values;

  bool has(const std::string& key) const { return values.contains(key); }
  /// The only value of a key; empty where the key is not given.
  std::string text(const std::string& key) const { return has(key) ? values.at(key).front() : ""; }
};

/// Reads the rows of a CSV file, or of JSON Lines, as the suffix says.
/// @param is_list  whether a key takes several values: in a cell of CSV they are separated by `;`
/// @throws InputError for a file that cannot be read, is larger than 64 MiB or has another suffix
std::vector<ManifestRow> read_rows(const std::filesystem::path& manifest, bool (*is_list)(const std::string& key),
                                   ManifestErrors& errors);

}  // namespace tetwarp::apps
