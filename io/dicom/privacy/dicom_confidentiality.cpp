// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom/privacy/dicom_confidentiality.h"

#include <algorithm>
#include <cstdio>
#include <functional>
#include <map>
#include <vector>

namespace tetwarp {

extern const char kConfidentialityTable[];  // made from dicom_confidentiality_table.cpp.in

namespace {

/// Columns of the table that belong to options of de-identification.
enum Column : std::size_t {
  kUids = 1,
  kDevice = 2,
  kInstitution = 3,
  kPatient = 4,
  kFullDates = 5,
  kModifiedDates = 6
};

std::string_view cut(std::string_view& text, char at) {
  const std::size_t end = std::min(text.find(at), text.size());
  const std::string_view part = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return part;
}

/// The table, sorted by tag. The row of a repeating group is found under the tag as the table writes it, with X for
/// digits.
class Table {
 public:
  Table() {
    for (std::string_view text = kConfidentialityTable; !text.empty();) {
      std::string_view line = cut(text, '\n');
      if (line.starts_with('#') || line.empty()) continue;
      ConfidentialityRow row{.tag = cut(line, '\t'), .name = cut(line, '\t'), .basic = cut(line, '\t'), .options = {}};
      for (std::string_view& option : row.options) option = cut(line, '\t');
      rows_.emplace(row.tag, row);
    }
  }

  const ConfidentialityRow* find(const std::string& tag) const {
    const auto row = rows_.find(tag);
    return row == rows_.end() ? nullptr : &row->second;
  }

 private:
  std::map<std::string_view, ConfidentialityRow> rows_;
};

bool has_letter(std::string_view codes, char letter) { return codes.find(letter) != std::string_view::npos; }

}  // namespace

const ConfidentialityRow* confidentiality_row(const DcmTagKey& tag) {
  static const Table table;
  const unsigned group = tag.getGroup(), element = tag.getElement();
  if (group % 2 != 0) return table.find("GGGGEEEE");
  if (group >> 8 == 0x50) return table.find("50XXXXXX");
  char text[16];
  if (group >> 8 == 0x60)
    std::snprintf(text, sizeof text, "60XX%04X", element);
  else
    std::snprintf(text, sizeof text, "%04X%04X", group, element);
  return table.find(text);
}

Confidentiality resolved(std::string_view basic, AttributeType type) {
  const bool x = has_letter(basic, 'X'), z = has_letter(basic, 'Z'), d = has_letter(basic, 'D');
  if (has_letter(basic, 'U')) return Confidentiality::replace_uid;
  switch (type) {
    case AttributeType::optional:
      return x ? Confidentiality::remove : z ? Confidentiality::empty : Confidentiality::dummy;
    case AttributeType::may_be_empty:
      return z ? Confidentiality::empty : d ? Confidentiality::dummy : Confidentiality::remove;
    case AttributeType::unknown:
      return d ? Confidentiality::dummy : z ? Confidentiality::empty : Confidentiality::remove;
  }
  return Confidentiality::remove;
}

Confidentiality action_of(const ConfidentialityRow& row, const std::set<ConfidentialityOption>& options,
                          AttributeType type) {
  using enum ConfidentialityOption;
  if (options.contains(shift_dates) && row.options[kModifiedDates] == "C") return Confidentiality::shift_date;
  constexpr std::pair<ConfidentialityOption, Column> kKept[] = {{retain_uids, kUids},
                                                                {retain_device, kDevice},
                                                                {retain_institution, kInstitution},
                                                                {retain_patient, kPatient},
                                                                {retain_dates, kFullDates}};
  for (const auto& [option, column] : kKept) {
    if (options.contains(option) && row.options[column] == "K") return Confidentiality::keep;
  }
  return resolved(row.basic, type);  // code C, "clean", counts as the basic code: no program here looks into the text
}

}  // namespace tetwarp
