// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace tetwarp::apps {

/// What a run writes of itself: sidecars, reports, lines of a batch. The one way from JSON into a file, so that who
/// writes has to say whether it may name what was read.
///
/// Of a de-identified run a text passes only if it stands at a place of the list in record.cpp and is what that place
/// allows: a word of the program, a digest of what was made, a new UID, a formula. Paths, names and messages stand at
/// no place of it, and what somebody adds later does not either: as a member it is dropped, in a list it becomes "left
/// out".
class Record {
 public:
  Record() : document_(nlohmann::json::object()) {}
  static Record open(nlohmann::json document) { return Record(std::move(document)); }
  static Record closed(const nlohmann::json& document);
  static Record of(bool deidentified, nlohmann::json document) {
    return deidentified ? closed(document) : open(std::move(document));
  }

  const nlohmann::json& document() const { return document_; }

 private:
  explicit Record(nlohmann::json document) : document_(std::move(document)) {}

  nlohmann::json document_;
};

/// Why a case came to nothing, in the words that its record may have if it is de-identified. The message itself, which
/// may name paths and quote files, goes to standard error alone.
enum class FixedReason { input, options, memory, device, other };
std::string fixed_text(FixedReason reason);

/// Writes a file for people, such as a table or a page, in place of what is there.
/// @throws Error when it cannot be written whole
void write_text(const std::filesystem::path& path, std::string_view text);

/// @throws Error when it cannot be written whole
void write_json(const std::filesystem::path& path, const Record& record);

}  // namespace tetwarp::apps
