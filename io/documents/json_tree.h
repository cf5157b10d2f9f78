// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: JSON documents that people write, with the line of each value.
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
  std::size_t line = 0;  ///< the line in which the value begins, from 1
  bool truth = false;
  double number = 0;      ///< the value of a number; finite
  std::string text = {};  ///< the value of a text, in UTF-8
  /// The values of a list or an object, in the order of the document; an object has no key twice.
  std::vector<JsonTree> items = {};
  std::string key = {};  ///< the key under which an object has this value
  std::size_t key_line = 0;
};

/// What messages call a kind: "a number", "a list" and so on.
const char* name_of(JsonTree::Kind kind);

/// A text as messages have it between quotation marks: printable ASCII, other bytes as '?', cut short where it is long.
std::string printable(std::string_view text);

/// Parses a document.
/// @param name  of the file: messages begin with "NAME:LINE: "
/// @throws InputError for what is not JSON, a key that an object has twice, a number beyond doubles, or lists and
/// objects nested more than 64 deep
JsonTree parse_json(std::string_view bytes, const std::string& name);

/// Parses a file.
/// @param kind        what messages call it: "a scenario"
/// @param most_bytes  that it may have
/// @throws InputError for a file that cannot be read, and for what `parse_json` refuses
JsonTree read_json(const std::filesystem::path& path, const std::string& kind,
                   std::size_t most_bytes = std::size_t{1} << 20);

}  // namespace tetwarp
