// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom/privacy/patient_names.h"

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcdeftag.h>

#include <algorithm>
#include <set>

#include "io/dicom/privacy/comparable_text.h"
#include "io/dicom/scan/dicom_charset.h"
#include "io/dicom/scan/dicom_header.h"

namespace tetwarp {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_ascii(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 0x80; });
}
bool has_digit(std::string_view text) { return std::any_of(text.begin(), text.end(), is_digit); }

std::string without_spaces(std::string text) {
  std::erase(text, ' ');
  return text;
}

std::vector<std::string> split(std::string_view text, std::string_view separators) {
  std::vector<std::string> parts;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find_first_of(separators), text.size());
    if (end > 0) parts.emplace_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return parts;
}

/// The texts that bytes may mean: in the character sets of the data set, and, where that differs, as UTF-8 or Latin-1,
/// for some headers name wrong sets, or none.
std::vector<std::string> readings_of(std::string_view bytes, const std::string& character_set) {
  std::vector<std::string> readings = {utf8_or_latin1(bytes)};
  if (const auto decoded = decoded_text(bytes, character_set); decoded && *decoded != readings.front())
    readings.push_back(*decoded);
  return readings;
}

/// Whether the text holds the word as a whole number: where the word begins or ends with a digit, no further digit
/// stands beside it there.
bool holds_number(std::string_view text, std::string_view word) {
  for (auto at = text.find(word); at != std::string_view::npos; at = text.find(word, at + 1)) {
    const std::size_t end = at + word.size();
    const bool longer_before = at > 0 && is_digit(text[at - 1]) && is_digit(word.front());
    const bool longer_behind = end < text.size() && is_digit(text[end]) && is_digit(word.back());
    if (!longer_before && !longer_behind) return true;
  }
  return false;
}

/// Whether a text holds a word of PatientNames::Secrets, by the rules of PatientNames.
/// @param words   a spelling of the text
/// @param joined  the same spelling without spaces
bool holds(std::string_view words, std::string_view joined, const std::string& secret) {
  if (!is_ascii(secret) || secret.size() > 3 || (secret.size() == 3 && !has_digit(secret)))
    return joined.find(secret) != std::string_view::npos;
  if (has_digit(secret)) return holds_number(words, secret) || holds_number(joined, secret);
  for (const std::string& word : split(words, " ")) {
    if (secret.size() == 1 ? word == secret : word.starts_with(secret) || word.ends_with(secret)) return true;
  }
  return false;
}

}  // namespace

/// Words that no text may hold: spellings, as `spellings_of` makes them, without spaces.
struct PatientNames::Secrets {
  std::string source;  ///< values of the attributes from which they were made
  std::set<std::string> words;

  void add_name(std::string_view name, const std::string& character_set) {
    for (const std::string& reading : readings_of(name, character_set)) {
      for (const std::string& component : split(reading, "^=\\")) {
        for (const std::string& spelling : spellings_of(component)) {
          add_word(without_spaces(spelling));  // also names of several words: O'Brien, de la Cruz
          for (const std::string& word : split(spelling, " ")) add_word(word);
        }
      }
    }
  }
  void add_id(std::string_view id, const std::string& character_set) {
    for (const std::string& reading : readings_of(id, character_set)) {
      for (const std::string& one : split(reading, "\\")) {
        for (const std::string& spelling : spellings_of(one)) {
          const std::string word = without_spaces(spelling);
          if (word.empty()) continue;
          words.insert(word);
          if (const auto begin = word.find_first_not_of('0'); begin != std::string::npos)
            words.insert(word.substr(begin));
        }
      }
    }
  }
  /// Adds a date: year, month and day in the orders in which people write them, with and without century and zeros, the
  /// month as a number or an English name.
  void add_date(std::string date) {
    std::erase_if(date, [](char c) { return !is_digit(c); });
    if (date.size() != 8) return;
    static constexpr const char* kMonths[] = {"january", "february", "march",     "april",   "may",      "june",
                                              "july",    "august",   "september", "october", "november", "december"};
    const auto shorter = [](const std::string& number) { return number.front() == '0' ? number.substr(1) : number; };
    const std::string month = date.substr(4, 2), day = date.substr(6);
    std::set<std::string> months = {month, shorter(month)};
    if (month >= "01" && month <= "12") {
      const std::string name = kMonths[std::stoi(month) - 1];
      months.insert({name, name.substr(0, 3)});
    }
    for (const std::string& year : {date.substr(0, 4), date.substr(2, 2)}) {
      for (const std::string& m : months) {
        for (const std::string& d : {day, shorter(day)}) {
          if (year.size() + m.size() + d.size() < 6) continue;  // "1150" may be anything
          words.insert({year + m + d, d + m + year, m + d + year});
        }
      }
    }
  }

 private:
  void add_word(const std::string& word) {
    const bool number = std::all_of(word.begin(), word.end(), is_digit);
    if (!is_ascii(word) || word.size() > (number ? 2 : 1)) words.insert(word);
  }
};

PatientNames::PatientNames(DcmItem& data) : character_set_(text_of(data, DCM_SpecificCharacterSet)) {
  const DcmTagKey names[] = {DCM_PatientName, DCM_OtherPatientNames, DCM_PatientBirthName, DCM_PatientMotherBirthName,
                             DCM_ResponsiblePerson};
  const DcmTagKey ids[] = {DCM_PatientID, DcmTagKey(0x0010, 0x1000)};
  std::string source = character_set_;
  for (const DcmTagKey& tag : names) source += '\0' + text_of(data, tag);
  for (const DcmTagKey& tag : ids) source += '\0' + text_of(data, tag);
  source += '\0' + text_of(data, DCM_PatientBirthDate);
  DcmItem* other = nullptr;
  std::vector<std::string> listed;
  for (long n = 0; data.findAndGetSequenceItem(DCM_OtherPatientIDsSequence, other, n).good() && other; ++n) {
    listed.push_back(text_of(*other, DCM_PatientID));
    source += '\0' + listed.back();
  }
  static thread_local std::shared_ptr<const Secrets> last;  // kept, since all slices of a series name the same patient
  if (!last || last->source != source) {
    const auto made = std::make_shared<Secrets>();
    made->source = std::move(source);
    for (const DcmTagKey& tag : names) made->add_name(text_of(data, tag), character_set_);
    for (const DcmTagKey& tag : ids) made->add_id(text_of(data, tag), character_set_);
    for (const std::string& id : listed) made->add_id(id, character_set_);
    made->add_date(text_of(data, DCM_PatientBirthDate));
    last = made;
  }
  secrets_ = last;
}

bool PatientNames::are_in(std::string_view text) const {
  if (text.empty() || secrets_->words.empty()) return false;
  for (const std::string& reading : readings_of(text, character_set_)) {
    for (const std::string& spelling : spellings_of(reading)) {
      const std::string joined = without_spaces(spelling);
      const auto held = [&](const std::string& secret) { return holds(spelling, joined, secret); };
      if (std::any_of(secrets_->words.begin(), secrets_->words.end(), held)) return true;
    }
  }
  return false;
}

}  // namespace tetwarp
