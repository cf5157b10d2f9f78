// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace tetwarp {

/// Whether a file has parameters as elastix writes them: `(Key value ...)`, or TOML by its suffix.
bool is_elastix_file(const std::filesystem::path& path);

/// The keys and values of a parameter file of elastix, in either of its two forms.
class ParameterFile {
 public:
  /// @throws InputError naming file and line, for what is neither form, or has a key twice
  explicit ParameterFile(const std::filesystem::path& path);

  const std::string& file() const { return file_; }
  bool has(const std::string& key) const { return values_.contains(key); }
  /// The only word of a key, without quotes; `missing` if there is no such key.
  std::string word(const std::string& key, const std::string& missing) const;
  /// @throws InputError unless the key is there, with numbers alone
  std::vector<double> numbers(const std::string& key) const;
  /// @throws InputError also for another count than expected
  std::vector<double> numbers(const std::string& key, std::size_t count) const;
  /// @throws InputError where the key is there, with another word
  void require_word(const std::string& key, const std::string& expected) const;

 private:
  struct Value {
    std::string text;  ///< as it stands in the file, strings with quotes; of TOML that no reader takes its kind
    /// Those of TOML; of an array there is no text then.
    std::optional<std::vector<double>> numbers = {};
  };

  void read_text(const std::filesystem::path& path);
  void read_toml(const std::filesystem::path& path);

  std::string file_;
  std::map<std::string, Value> values_;
};

}  // namespace tetwarp
