// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom/privacy/dicom_deidentify.h"

#include <dcmtk/dcmdata/dcdeftag.h>
#include <dcmtk/dcmdata/dcelem.h>
#include <dcmtk/dcmdata/dcsequen.h>

#include <array>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <optional>

#include "deform/version.h"
#include "io/dicom/derive/dicom_put.h"
#include "io/dicom/scan/dicom_header.h"
#include "io/hash.h"

namespace tetwarp {

namespace {

using enum ConfidentialityOption;

constexpr int kMostDaysBack = 3650;

/// Attributes for which the table has several codes, and that a CT image (PS3.3 A.3) must have but may have empty.
const std::set<DcmTagKey>& type_2_of_ct_image() {
  static const std::set<DcmTagKey> tags = {DCM_ContentDate, DCM_ContentTime, DCM_PatientID, DCM_PatientSexNeutered,
                                           DCM_ContrastBolusAgent};
  return tags;
}

AttributeType type_in(bool is_ct_image, const DcmTagKey& tag) {
  if (!is_ct_image) return AttributeType::unknown;
  return type_2_of_ct_image().contains(tag) ? AttributeType::may_be_empty : AttributeType::optional;
}

/// Whether an attribute is of a group in which people write what they like: patient, trial, order, visit, procedure,
/// presentation.
bool may_be_told_in_text(const DcmTagKey& tag) {
  switch (tag.getGroup()) {
    case 0x0010:
    case 0x0012:
    case 0x0032:
    case 0x0038:
    case 0x0040:
    case 0x0070: return true;
    default: return false;
  }
}

/// Whether an element identifies a device and the table does not list it.
bool names_device(const DcmElement& element) {
  static const std::set<DcmTagKey> tags = {DCM_DeviceID, DCM_GridID, DCM_NTPSourceAddress};
  return element.ident() == EVR_AE || tags.contains(element.getTag().getXTag());
}

/// Whether an attribute of VR UC or UR is a code, or tells where a code comes from (PS3.3 8.8, 8.9).
bool is_code(const DcmTagKey& tag) {
  static const std::set<DcmTagKey> tags = {DCM_LongCodeValue, DCM_URNCodeValue, DCM_CodingSchemeURL};
  return tags.contains(tag);
}

/// Whether the VR is that of an element that nobody can look into, or of a tag that the dictionary does not know.
bool is_unknown_vr(DcmEVR vr) { return vr == EVR_UN || vr == EVR_UNKNOWN || vr == EVR_UNKNOWN2B; }

bool is_registered(const std::string& uid) { return uid.starts_with("1.2.840.10008."); }

/// A valid value of a VR that tells nothing.
std::string dummy_of(DcmEVR vr) {
  switch (vr) {
    case EVR_AS: return "000Y";
    case EVR_DA: return "19000101";
    case EVR_DT: return "19000101000000";
    case EVR_TM: return "000000";
    case EVR_DS:
    case EVR_IS: return "0";
    case EVR_UR: return "about:blank";
    default: return "REMOVED";
  }
}

/// The date with which a value of VR DA or DT begins (PS3.5 6.2); none if it is no date of the calendar.
std::optional<std::chrono::sys_days> date_at_start(const std::string& text) {
  const auto digits = [&](std::size_t from, std::size_t count) -> std::optional<int> {
    int value = 0;
    const char* const begin = text.data() + from;
    const auto [end, error] = std::from_chars(begin, begin + count, value);
    if (*begin == '-' || error != std::errc() || end != begin + count) return {};
    return value;
  };
  if (text.size() < 8) return {};
  const auto year = digits(0, 4), month = digits(4, 2), day = digits(6, 2);
  if (!year || !month || !day) return {};
  const std::chrono::year_month_day date{std::chrono::year(*year), std::chrono::month(static_cast<unsigned>(*month)),
                                         std::chrono::day(static_cast<unsigned>(*day))};
  if (!date.ok()) return {};
  return date;
}

std::string text_of_date(std::chrono::sys_days days) {
  const std::chrono::year_month_day date(days);
  char text[32];
  std::snprintf(text, sizeof text, "%04d%02u%02u", static_cast<int>(date.year()), static_cast<unsigned>(date.month()),
                static_cast<unsigned>(date.day()));
  return text;
}

std::vector<std::string> values_of(DcmElement& element) {
  std::vector<std::string> values;
  OFString value;
  for (unsigned long n = 0; n < element.getVM() && element.getOFString(value, n).good(); ++n)
    values.emplace_back(value.c_str());
  return values;
}

std::string joined(const std::vector<std::string>& values) {
  std::string text;
  for (std::size_t n = 0; n < values.size(); ++n) text.append(n == 0 ? "" : "\\").append(values[n]);
  return text;
}

/// A number from 0 to `count` - 1 that is chosen by a digest.
int number_below(int count, const Sha256::Digest& digest) {
  std::uint64_t number = 0;
  for (std::size_t n = 0; n < 8; ++n) number = number << 8 | std::to_integer<std::uint64_t>(digest[n]);
  return static_cast<int>(number % static_cast<std::uint64_t>(count));
}

/// Code value and code meaning of an option (PS3.16 CID 7050).
std::pair<const char*, const char*> code_of(ConfidentialityOption option) {
  constexpr std::pair<const char*, const char*> kCodes[] = {
      {"113106", "Retain Longitudinal Temporal Information Full Dates Option"},
      {"113107", "Retain Longitudinal Temporal Information Modified Dates Option"},
      {"113109", "Retain Device Identity Option"},
      {"113112", "Retain Institution Identity Option"},
      {"113108", "Retain Patient Characteristics Option"},
      {"113110", "Retain UIDs Option"}};
  return kCodes[static_cast<int>(option)];
}

/// Removes "retained" options of an earlier de-identification from its methods, which stay named otherwise: what was
/// retained then need not be there any more.
void drop_retained(DcmItem& dataset) {
  DcmSequenceOfItems* codes = nullptr;
  dataset.findAndGetSequence(DCM_DeidentificationMethodCodeSequence, codes);
  for (unsigned long n = codes ? codes->card() : 0; n-- > 0;) {
    const std::string value = text_of(*codes->getItem(n), DCM_CodeValue);
    if (value >= "113106" && value <= "113112") delete codes->remove(n);
  }
}

void append_method(DcmItem& dataset, const std::pair<const char*, const char*>& code) {
  DcmSequenceOfItems* codes = nullptr;
  dataset.findAndGetSequence(DCM_DeidentificationMethodCodeSequence, codes);
  for (unsigned long n = 0; codes && n < codes->card(); ++n) {
    if (text_of(*codes->getItem(n), DCM_CodeValue) == code.first) return;
  }
  append_code(dataset, DCM_DeidentificationMethodCodeSequence, code.first, code.second);
}

/// Puts Patient Identity Removed and its method (PS3.3 C.7.1.1), and what became of dates (C.12.1).
void put_marks(DcmItem& dataset, const Deidentification& how) {
  put(dataset, DCM_PatientIdentityRemoved, "YES");
  drop_retained(dataset);
  std::string method = std::string("Tetwarp ") + version() + "\\" + kConfidentialityEdition + " Basic Profile";
  append_method(dataset, {"113100", "Basic Application Confidentiality Profile"});
  for (const ConfidentialityOption option : how.options) {
    method.append("\\").append(name_of(option));
    append_method(dataset, code_of(option));
  }
  put(dataset, DCM_DeidentificationMethod, method);
  const std::string before = text_of(dataset, DCM_LongitudinalTemporalInformationModified);
  const bool keeps = how.has(retain_dates), shifts = how.has(shift_dates);
  if (before == "REMOVED" || (keeps && before == "MODIFIED")) return;
  put(dataset, DCM_LongitudinalTemporalInformationModified, keeps ? "UNMODIFIED" : shifts ? "MODIFIED" : "REMOVED");
}

}  // namespace

Deidentifier::Deidentifier(Deidentification how, const std::string& patient_id, const std::string& study_uid)
    : how_(std::move(how)) {
  const std::string whose = patient_id.empty() ? "study " + study_uid : "patient " + patient_id;
  days_back_ = 1 + number_below(kMostDaysBack, keyed_digest(how_.key, "dates of " + whose));
}

void deidentify(DcmItem& dataset, const std::optional<Deidentification>& how, bool is_ct_image) {
  if (!how) return;
  const Deidentifier deidentifier(*how, text_of(dataset, DCM_PatientID), text_of(dataset, DCM_StudyInstanceUID));
  deidentifier.apply(dataset, is_ct_image);
}

std::string Deidentifier::uid(const std::string& uid) const { return how_.has(retain_uids) ? uid : replacement(uid); }

std::string Deidentifier::replacement(const std::string& uid) const {
  if (uid.empty() || is_registered(uid)) return uid;
  return uid_from_digest(keyed_digest(how_.key, "uid " + uid));
}

std::string Deidentifier::patient(const std::string& id) const {
  if (id.empty()) return id;
  const Sha256::Digest digest = keyed_digest(how_.key, "patient " + id);
  std::string text = "TW";
  for (std::size_t n = 0; n < 8; ++n) {
    char byte[4];
    std::snprintf(byte, sizeof byte, "%02X", std::to_integer<unsigned>(digest[n]));
    text += byte;
  }
  return text;
}

void Deidentifier::apply(DcmItem& dataset, bool is_ct_image) const {
  const std::string pseudonym = patient(text_of(dataset, DCM_PatientID));
  const bool has_patient = dataset.tagExists(DCM_PatientID) || dataset.tagExists(DCM_PatientName);
  apply_to(dataset, is_ct_image);
  if (has_patient) {
    put(dataset, DCM_PatientID, pseudonym);
    put(dataset, DCM_PatientName, pseudonym);
  }
  put_marks(dataset, how_);
}

void Deidentifier::apply_to(DcmItem& item, bool is_ct_image) const {
  for (unsigned long n = item.card(); n-- > 0;) {
    DcmElement& element = *item.getElement(n);
    const AttributeType type = type_in(is_ct_image, element.getTag().getXTag());
    carry_out(action_on(element, type), item, n, type);
  }
}

Confidentiality Deidentifier::action_on(DcmElement& element, AttributeType type) const {
  using enum Confidentiality;
  const DcmTagKey tag = element.getTag().getXTag();
  const DcmEVR vr = element.ident();
  const bool is_unknown = is_unknown_vr(vr);
  if (tag.getElement() == 0) return remove;  // a group length
  if (const ConfidentialityRow* row = confidentiality_row(tag)) {
    const Confidentiality action = action_of(*row, how_.options, type);
    return action == keep && is_unknown ? remove : action;
  }
  const Confidentiality taken = resolved("X/Z/D", type);
  if (is_unknown || is_unknown_vr(DcmTag(tag).getEVR())) return remove;
  if (names_device(element)) return how_.has(retain_device) ? keep : taken;
  switch (vr) {
    case EVR_UI: return how_.has(retain_uids) ? keep : replace_uid;
    case EVR_DA:
    case EVR_DT:
    case EVR_TM: return how_.has(shift_dates) ? shift_date : how_.has(retain_dates) ? keep : taken;
    case EVR_UC:
    case EVR_UR: return is_code(tag) ? keep : taken;
    case EVR_LO:
    case EVR_SH: return may_be_told_in_text(tag) ? taken : keep;
    case EVR_AS:
    case EVR_AT:
    case EVR_CS:
    case EVR_DS:
    case EVR_FD:
    case EVR_FL:
    case EVR_IS:
    case EVR_SL:
    case EVR_SQ:
    case EVR_SS:
    case EVR_SV:
    case EVR_UL:
    case EVR_US:
    case EVR_UV: return keep;
    default: return taken;  // free text, names of persons, bytes
  }
}

void Deidentifier::carry_out(Confidentiality action, DcmItem& item, unsigned long n, AttributeType type) const {
  using enum Confidentiality;
  DcmElement& element = *item.getElement(n);
  auto* sequence = dynamic_cast<DcmSequenceOfItems*>(&element);
  switch (action) {
    case remove: delete item.remove(n); return;
    case empty: element.clear(); return;
    case dummy: put_dummies(item, n); return;
    case keep:
    case replace_uid:
    case shift_date: break;
  }
  if (sequence) {
    for (unsigned long i = 0; i < sequence->card(); ++i) apply_to(*sequence->getItem(i), false);
  } else if (action == replace_uid) {
    replace_uids(element);
  } else if (action == shift_date && !shift(element)) {
    const ConfidentialityRow* row = confidentiality_row(element.getTag().getXTag());
    carry_out(resolved(row ? row->basic : "X/Z/D", type), item, n, type);
  }
}

void Deidentifier::put_dummies(DcmItem& item, unsigned long n) const {
  DcmElement& element = *item.getElement(n);
  if (auto* sequence = dynamic_cast<DcmSequenceOfItems*>(&element)) {
    for (unsigned long i = 0; i < sequence->card(); ++i) {
      DcmItem& within = *sequence->getItem(i);
      for (unsigned long j = within.card(); j-- > 0;) put_dummies(within, j);
    }
  } else if (element.ident() == EVR_UI) {
    replace_uids(element);
  } else if (element.isaString()) {
    element.putString(dummy_of(element.ident()).c_str());
  } else {
    constexpr std::array<Uint8, 2> kZeros{};
    if (element.putUint8Array(kZeros.data(), kZeros.size()).bad()) delete item.remove(n);
  }
}

void Deidentifier::replace_uids(DcmElement& element) const {
  std::vector<std::string> uids = values_of(element);
  for (std::string& value : uids) value = replacement(value);
  element.putString(joined(uids).c_str());
}

/// Shifts dates by whole days. @return whether all values were dates or times that could be shifted
bool Deidentifier::shift(DcmElement& element) const {
  if (element.ident() == EVR_TM) return true;  // times of day stay, for dates are shifted by whole days
  if (element.ident() != EVR_DA && element.ident() != EVR_DT) return false;
  std::vector<std::string> values = values_of(element);
  for (std::string& value : values) {
    if (value.empty()) continue;
    const auto date = date_at_start(value);
    if (!date || (element.ident() == EVR_DA && value.size() != 8)) return false;
    value.replace(0, 8, text_of_date(*date - std::chrono::days(days_back_)));
  }
  return element.putString(joined(values).c_str()).good();
}

}  // namespace tetwarp
