// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: values of a JSON document, checked while they are read.
#include <initializer_list>
#include <span>
#include <string>
#include <vector>

#include "deform/core/host_device.h"
#include "io/documents/json_tree.h"

namespace tetwarp {

/// Numbers that are accepted: from `low` to `high`, without `low` itself if `above` is set.
struct NumberRange {
  double low, high;
  bool above = false;

  bool contains(double value) const { return value <= high && (above ? value > low : value >= low); }
  /// The range for messages: "from 0 to 1", "above 0, to 1e+06".
  std::string text() const;
};

/// A value of a JSON document, what it is called ("move[1].handle.radius_mm") and where it stands. It refers to the
/// tree and the file name, which must outlive it.
///
/// Every function throws InputError, "FILE:LINE: NAME is FOUND; EXPECTED is expected", for a value that is not of its
/// kind.
class JsonEntry {
 public:
  /// @param whole  what the document is called: "the scenario"
  JsonEntry(const JsonTree& tree, std::string path, const std::string& file, const char* whole)
      : tree_(&tree), file_(&file), path_(std::move(path)), whole_(whole) {}

  /// Throws InputError, "FILE:LINE: NAME WHAT".
  [[noreturn]] void refuse(const std::string& what) const;
  const std::string& path() const { return path_; }
  std::size_t line() const { return tree_->line; }
  bool is(JsonTree::Kind kind) const { return tree_->kind == kind; }

  double number(const NumberRange& range) const;
  std::int64_t whole_number(std::int64_t low, std::int64_t high) const;
  bool truth() const;
  /// The value as a text, which is not empty and has at most 200 characters.
  const std::string& text() const;
  /// The value as a text of any length.
  const std::string& any_text() const;
  /// The value as three numbers in a range.
  glm::dvec3 vector(const NumberRange& range) const;
  /// The value as three numbers that are not all 0.
  /// @return the direction, scaled so that its largest component is 1 in size
  glm::dvec3 direction() const;
  std::vector<JsonEntry> items(std::size_t fewest, std::size_t most) const;

  /// Refuses keys of an object that are not in the list.
  void only(std::span<const char* const> known) const;
  bool has(const char* key) const;
  JsonEntry at(const char* key) const;
  /// The only key of a list that an object has; none or two are refused.
  /// @return its number in the list
  std::size_t one_of(std::span<const char* const> keys) const;

 private:
  void expect(JsonTree::Kind kind, const std::string& expected) const;

  const JsonTree* tree_;
  const std::string* file_;
  std::string path_;
  const char* whole_;
};

}  // namespace tetwarp
