// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Records of comma-separated values (RFC 4180), with their bytes as they are.
#include <string>
#include <string_view>
#include <vector>

#include "io/text_span.h"

namespace tetwarp {

/// Records of a text, one after the other. A quoted field may hold commas, line ends and doubled quotes.
class CsvRecords {
 public:
  /// @param comments  a line that begins with # is a record of one field, whatever commas and quotes it has
  CsvRecords(std::string_view text, std::size_t from, const std::string& name, bool comments = false)
      : text_(text), name_(name), next_(from), comments_(comments) {}

  /// @return false at the end of the text
  /// @throws InputError for a quote that does not end, or with something else behind it
  bool next();

  std::vector<TextSpan> fields;    ///< with their quotes
  std::size_t begin = 0, end = 0;  ///< of the record, its line end excluded
  std::size_t line = 0;            ///< the record begins in, from 1

  bool is_blank() const { return fields.size() == 1 && fields[0].begin == fields[0].end; }
  std::string_view raw(std::size_t field) const {
    return text_.substr(fields[field].begin, fields[field].end - fields[field].begin);
  }

 private:
  void take_field();

  std::string_view text_;
  const std::string& name_;
  std::size_t next_;
  bool comments_;
  std::size_t lines_done_ = 0;
};

/// What a field means: without quotes, or without the blanks around it.
std::string unquoted(std::string_view field);
/// The text of a field, in quotes where it needs them.
std::string quoted(const std::string& value);

}  // namespace tetwarp
