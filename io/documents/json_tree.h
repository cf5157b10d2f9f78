// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: JSON that people write, with the line of each part.
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace tetwarp {

/// A value of a JSON document and where it stands.
struct JsonTree {
  enum class Kind { null, boolean, number, text, list, object };

  Kind kind = Kind::null;
  std::size_t line = 0;  ///< where it begins, from 1
  bool truth = false;
  double number = 0;                 ///< finite
  std::string text = {};             ///< UTF-8
  std::vector<JsonTree> items = {};  ///< of a list, or of an object as they stand there; no key twice
  std::string key = {};              ///< in an object
  std::size_t key_line = 0;
};

/// "a number", "a list" and so on.
const char* name_of(JsonTree::Kind kind);

/// What stands in quotes in messages: printable ASCII, other bytes as '?', cut short where it is long.
std::string printable(std::string_view text);

/// Parses a document.
/// @param name  of the file: messages begin with "NAME:LINE: "
/// @throws InputError for what is not JSON, a key that an object has twice, a number beyond doubles, or lists and
/// objects that lie more than 64 deep in each other
JsonTree parse_json(std::string_view bytes, const std::string& name);

/// Parses a file of at most 1 MiB.
/// @param kind  what messages call it: "a scenario"
/// @throws InputError as `parse_json`, or for a file that cannot be read
JsonTree read_json(const std::filesystem::path& path, const std::string& kind);

}  // namespace tetwarp
