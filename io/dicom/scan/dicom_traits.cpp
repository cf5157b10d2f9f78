// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom/scan/dicom_traits.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <optional>
#include <set>

#include "io/dicom/privacy/patient_names.h"
#include "io/dicom/scan/dicom_charset.h"
#include "io/dicom_text.h"

namespace tetwarp {
namespace {

enum class TraitKind : std::uint8_t { number, text, time, percentage };

struct TraitTable {
  const char* name;
  TraitKind kind;
  DcmTagKey tag, time;         ///< for a TraitKind::time, tags of the date and of the time of day
  const char *before, *after;  ///< what a label has before and after the value
};

const TraitTable& table_of(Trait trait) {
  const DcmTagKey none;
  static const std::array<TraitTable, kTraits> table = {{
      {"Temporal Position Identifier", TraitKind::number, DCM_TemporalPositionIdentifier, none, "time point ", ""},
      {"Temporal Position Index", TraitKind::number, DCM_TemporalPositionIndex, none, "time point ", ""},
      {"Stack ID", TraitKind::text, DCM_StackID, none, "stack ", ""},
      {"Nominal Percentage of Cardiac Phase", TraitKind::number, DCM_NominalPercentageOfCardiacPhase, none,
       "heart phase ", " %"},
      {"Nominal Percentage of Respiratory Phase", TraitKind::number, DCM_NominalPercentageOfRespiratoryPhase, none,
       "breathing phase ", " %"},
      {"Trigger Time", TraitKind::number, DCM_TriggerTime, none, "trigger time ", " ms"},
      {"Nominal Cardiac Trigger Delay Time", TraitKind::number, DCM_NominalCardiacTriggerDelayTime, none,
       "trigger delay ", " ms"},
      {"Series Description", TraitKind::text, DCM_SeriesDescription, none, "\"", "\""},
      {"Image Comments", TraitKind::percentage, DCM_ImageComments, none, "phase ", " %"},
      {"KVP", TraitKind::number, DCM_KVP, none, "", " kV"},
      {"Convolution Kernel", TraitKind::text, DCM_ConvolutionKernel, none, "kernel ", ""},
      {"Slice Thickness", TraitKind::number, DCM_SliceThickness, none, "slices ", " mm thick"},
      {"Image Type", TraitKind::text, DCM_ImageType, none, "image type ", ""},
      {"Dimension Index Values", TraitKind::text, DCM_DimensionIndexValues, none, "dimension index ", ""},
      {"Contrast/Bolus Agent", TraitKind::text, DCM_ContrastBolusAgent, none, "contrast agent ", ""},
      {"Scan Options", TraitKind::text, DCM_ScanOptions, none, "scan options ", ""},
      {"Filter Type", TraitKind::text, DCM_FilterType, none, "filter ", ""},
      {"Protocol Name", TraitKind::text, DCM_ProtocolName, none, "protocol ", ""},
      {"Acquisition Number", TraitKind::number, DCM_AcquisitionNumber, none, "acquisition ", ""},
      {"Series Number", TraitKind::number, DCM_SeriesNumber, none, "series number ", ""},
      {"Irradiation Event UID", TraitKind::text, DCM_IrradiationEventUID, none, "irradiation event ", ""},
      {"Acquisition Date and Time", TraitKind::time, DCM_AcquisitionDate, DCM_AcquisitionTime, "acquired ", ""},
      {"Content Date and Time", TraitKind::time, DCM_ContentDate, DCM_ContentTime, "made ", ""},
      {"Series Date and Time", TraitKind::time, DCM_SeriesDate, DCM_SeriesTime, "series begun ", ""},
  }};
  return table[static_cast<std::size_t>(trait)];
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }

std::string shortest(double value) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, value == 0 ? 0.0 : value).ptr};
}

/// The one percentage in a text, "50" of "Gated, 50.0%"; none where there is none, or more than one.
std::optional<double> percentage_in(std::string_view text) {
  std::optional<double> found;
  for (auto sign = text.find('%'); sign != std::string_view::npos; sign = text.find('%', sign + 1)) {
    std::size_t end = sign;
    while (end > 0 && text[end - 1] == ' ') --end;
    std::size_t begin = end;
    while (begin > 0 && (is_digit(text[begin - 1]) || text[begin - 1] == '.')) --begin;
    const auto value = decimal(text.substr(begin, end - begin));
    if (!value) continue;
    if (found) return std::nullopt;
    found = value;
  }
  return found;
}

/// The digits of a date or a time of day (PS3.5 6.2; ACR-NEMA wrote "1997.11.25" and "10:34:01"), without zeros at the
/// end of the fraction of a second.
std::string digits_of(std::string text, char separator) {
  std::erase(text, separator);
  if (text.find('.') != std::string::npos) {
    text.erase(text.find_last_not_of('0') + 1);
    if (text.ends_with('.')) text.pop_back();
  }
  return text;
}

constexpr std::size_t kLongest = 256;

/// Date and time in one text, "20180328 120703.5"; empty where neither is there.
std::string clock_value(DcmItem& data, const TraitTable& trait) {
  std::string date = text_of(data, trait.tag), time = text_of(data, trait.time);
  if (date.empty() && time.empty() && trait.tag == DCM_AcquisitionDate) {
    date = text_of(data, DCM_AcquisitionDateTime);
    time = date.substr(std::min<std::size_t>(8, date.size()));
    date.resize(date.size() - time.size());
  }
  if (date.empty() && time.empty()) return {};
  return (digits_of(date, '.') + " " + digits_of(time, ':')).substr(0, kLongest);
}

std::string value_of(DcmItem& data, const TraitTable& trait) {
  std::string text = text_of(data, trait.tag).substr(0, kLongest);
  text.erase(0, std::min(text.find_first_not_of(' '), text.size()));
  std::optional<double> number;
  switch (trait.kind) {
    case TraitKind::text: return text;
    case TraitKind::time: return clock_value(data, trait);
    case TraitKind::percentage:
      number = percentage_in(shown_text(text, text_of(data, DCM_SpecificCharacterSet)));
      break;
    case TraitKind::number:
      number = decimal(text);
      if (!number) return text;
  }
  return number ? shortest(*number) : std::string();
}

/// Date and time for a label, "2018-03-28 12:07:03.5" of "20180328 120703.5"; a text of another form stays.
std::string clock_text(std::string_view value) {
  std::string text(value);
  const auto space = text.find(' ');
  if (text.size() >= space + 7) text.insert(space + 5, ":").insert(space + 3, ":");
  if (space == 8) text.insert(6, "-").insert(4, "-");
  return space == 0 ? text.substr(1) : text;
}

/// Whether `a` comes before `b` by the numbers in them, and where these are equal, letter by letter.
bool is_before_naturally(std::string_view a, std::string_view b) {
  while (!a.empty() && !b.empty()) {
    const auto leading_digits = [](std::string_view text) {
      return static_cast<std::size_t>(std::find_if_not(text.begin(), text.end(), is_digit) - text.begin());
    };
    const std::size_t of_a = leading_digits(a), of_b = leading_digits(b);
    if (of_a > 0 && of_b > 0) {
      const auto value = [](std::string_view digits) {
        digits.remove_prefix(std::min(digits.find_first_not_of('0'), digits.size()));
        return digits;
      };
      const std::string_view left = value(a.substr(0, of_a)), right = value(b.substr(0, of_b));
      if (left.size() != right.size()) return left.size() < right.size();
      if (left != right) return left < right;
      a.remove_prefix(of_a);
      b.remove_prefix(of_b);
    } else {
      if (a.front() != b.front()) return a.front() < b.front();
      a.remove_prefix(1);
      b.remove_prefix(1);
    }
  }
  return a.size() < b.size();
}

std::string label_of(Trait trait, const DicomFileHeader& header) {
  const TraitTable& table = table_of(trait);
  const std::string_view value = trait_of(header, trait);
  std::string text;
  switch (table.kind) {
    case TraitKind::text: text = shown_text(value, header.character_set); break;
    case TraitKind::time: text = shown_text(clock_text(value), {}); break;
    default: text = shown_text(value, {});
  }
  return value.empty() ? std::string("no ") + table.name : table.before + text + table.after;
}

bool is_secret(const DicomFileHeader& header, Trait trait) {
  return (header.secret_traits >> static_cast<unsigned>(trait) & 1) != 0;
}

/// Whether a value is a number, a time, a UID, or several of these.
bool is_numeric(std::string_view value) {
  return value.find_first_not_of("0123456789.+- \\") == std::string_view::npos;
}

}  // namespace

std::string name_of(Trait trait) {
  const TraitTable& table = table_of(trait);
  const auto number = [](const DcmTagKey& tag) {
    char text[16];
    std::snprintf(text, sizeof text, " (%04X,%04X)", tag.getGroup(), tag.getElement());
    return std::string(text);
  };
  return table.name + number(table.tag) + (table.kind == TraitKind::time ? number(table.time) : std::string());
}

std::string read_traits(DcmItem& data) {
  std::string traits;
  for (std::size_t n = 0; n < kTraits; ++n) {
    traits += value_of(data, table_of(static_cast<Trait>(n)));
    traits += '\0';
  }
  traits.shrink_to_fit();
  return traits;
}

std::string_view trait_of(const DicomFileHeader& header, Trait trait) {
  std::string_view rest = header.traits;
  for (std::size_t n = 0; n < static_cast<std::size_t>(trait); ++n)
    rest.remove_prefix(std::min(rest.find('\0') + 1, rest.size()));
  return rest.substr(0, rest.find('\0'));
}

bool is_before(Trait trait, std::string_view a, std::string_view b) {
  if (a.empty() || b.empty()) return a.empty() && !b.empty();
  const TraitKind kind = table_of(trait).kind;
  if (kind == TraitKind::number || kind == TraitKind::percentage) {
    const auto left = decimal(a), right = decimal(b);
    if (left && right) return *left < *right;
    if (left || right) return left.has_value();
  }
  return kind == TraitKind::time ? a < b : is_before_naturally(a, b);
}

std::vector<std::string> labels_of(Trait trait, std::span<const DicomFileHeader* const> headers) {
  std::vector<std::string> labels;
  const TraitTable& table = table_of(trait);
  const bool secret =
      std::any_of(headers.begin(), headers.end(), [&](const auto* one) { return is_secret(*one, trait); });
  const auto phase = [&](const DicomFileHeader& header) {
    return percentage_in(shown_text(trait_of(header, trait), header.character_set));
  };
  std::set<double> phases;
  for (const DicomFileHeader* header : headers) {
    if (trait == Trait::series_description && phase(*header)) phases.insert(*phase(*header));
  }
  for (const DicomFileHeader* header : headers) {
    if (phases.size() == headers.size())
      labels.push_back("phase " + shortest(*phase(*header)) + " %");
    else if (secret)
      labels.push_back(std::string(table.name) + " no. " + std::to_string(labels.size() + 1));
    else
      labels.push_back(label_of(trait, *header));
  }
  return labels;
}

std::uint32_t traits_naming_patient(DcmItem& data, const std::string& traits) {
  const PatientNames patient(data);
  std::uint32_t found = 0;
  std::size_t begin = 0;
  for (std::size_t n = 0; n < kTraits; ++n) {
    const std::size_t end = traits.find('\0', begin);
    const std::string_view value = std::string_view(traits).substr(begin, end - begin);
    begin = end + 1;
    const auto trait = static_cast<Trait>(n);
    const TraitKind kind = table_of(trait).kind;
    if (value.empty() || kind == TraitKind::percentage) continue;
    const bool may_be_text = kind == TraitKind::text && trait != Trait::irradiation_event && trait != Trait::dimensions;
    if (!may_be_text && is_numeric(value)) continue;
    if (patient.are_in(value)) found |= 1u << n;
  }
  return found;
}

std::string shown_description(std::span<const DicomFileHeader> files) {
  const auto names_patient = [](const DicomFileHeader& one) { return is_secret(one, Trait::series_description); };
  if (std::any_of(files.begin(), files.end(), names_patient)) return {};
  const DicomFileHeader& header = files.front();
  return shown_text(trait_of(header, Trait::series_description), header.character_set);
}

}  // namespace tetwarp
