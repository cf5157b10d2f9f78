// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/csv_record.h"

#include <algorithm>

#include "deform/errors.h"
#include "io/points/points_document.h"

namespace tetwarp {

bool CsvRecords::next() {
  if (next_ >= text_.size()) return false;
  lines_done_ += static_cast<std::size_t>(std::count(text_.begin() + static_cast<std::ptrdiff_t>(begin),
                                                     text_.begin() + static_cast<std::ptrdiff_t>(next_), '\n'));
  line = lines_done_ + 1;
  begin = next_;
  fields.clear();
  if (comments_ && text_[begin] == '#') {
    end = std::min(text_.find('\n', begin), text_.size());
    next_ = std::min(end + 1, text_.size());
    fields.push_back({begin, end});
    return true;
  }
  do {
    take_field();
  } while (next_ < text_.size() && text_[next_++] == ',');
  end = fields.back().end;
  return true;
}

/// Takes the next field. Leaves `next_` at the comma or line feed behind it, or at the end of the text.
void CsvRecords::take_field() {
  TextSpan field{next_, 0};
  if (field.begin < text_.size() && text_[field.begin] == '"') {
    std::size_t at = field.begin + 1;
    for (; at < text_.size(); ++at) {
      if (text_[at] != '"') continue;
      if (at + 1 < text_.size() && text_[at + 1] == '"') {
        ++at;
      } else {
        break;
      }
    }
    require(at < text_.size(), "a quote that does not end, of the record" + at_line(line, name_));
    field.end = at + 1;
  } else {
    field.end = std::min(text_.find_first_of(",\n", field.begin), text_.size());
    const bool last = field.end == text_.size() || text_[field.end] == '\n';
    if (last && field.end > field.begin && text_[field.end - 1] == '\r') --field.end;
  }
  next_ = field.end;
  if (next_ < text_.size() && text_[next_] == '\r') ++next_;
  require(next_ >= text_.size() || text_[next_] == ',' || text_[next_] == '\n',
          "something behind a closing quote, of the record" + at_line(line, name_));
  fields.push_back(field);
}

std::string unquoted(std::string_view field) {
  if (!field.starts_with('"')) {
    const auto begin = field.find_first_not_of(" \t"), end = field.find_last_not_of(" \t");
    return begin == std::string_view::npos ? "" : std::string(field.substr(begin, end - begin + 1));
  }
  std::string value;
  for (std::size_t n = 1; n + 1 < field.size(); ++n) {
    value += field[n];
    if (field[n] == '"') ++n;  // a quotation mark within quotes is written twice
  }
  return value;
}

std::string quoted(const std::string& value) {
  const auto is_blank = [](char c) { return c == ' ' || c == '\t'; };
  const bool blanks = !value.empty() && (is_blank(value.front()) || is_blank(value.back()));
  if (!blanks && value.find_first_of(",\"\r\n") == std::string::npos) return value;
  std::string text = "\"";
  for (const char c : value) {
    if (c == '"') text += '"';
    text += c;
  }
  return text + '"';
}

}  // namespace tetwarp
