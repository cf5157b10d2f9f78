// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace tetwarp {

/// Options of the Basic Application Level Confidentiality Profile (PS3.15 E.3) that a program can carry out without
/// looking at pictures and understanding texts.
enum class ConfidentialityOption : std::uint8_t {
  retain_dates,        ///< Retain Longitudinal Temporal Information With Full Dates (E.3.6)
  shift_dates,         ///< the same With Modified Dates: all of a patient's go back by the same number of days
  retain_device,       ///< Retain Device Identity (E.3.8)
  retain_institution,  ///< Retain Institution Identity (E.3.11)
  retain_patient,      ///< Retain Patient Characteristics (E.3.7)
  retain_uids,         ///< Retain UIDs (E.3.9)
};

constexpr ConfidentialityOption kConfidentialityOptions[] = {
    ConfidentialityOption::retain_dates,   ConfidentialityOption::shift_dates,
    ConfidentialityOption::retain_device,  ConfidentialityOption::retain_institution,
    ConfidentialityOption::retain_patient, ConfidentialityOption::retain_uids};

/// The word of the command line: retain-dates, shift-dates, retain-device, retain-institution, retain-patient,
/// retain-uids.
const char* name_of(ConfidentialityOption option);

/// The edition of PS3.15 whose table E.1-1 says what happens to an attribute: "PS3.15 2026d".
extern const char kConfidentialityEdition[];

/// De-identification by the Basic Profile. UIDs, Patient ID and the days that dates are shifted by are functions of the
/// key and of what they replace (HMAC-SHA-256, FIPS 198-1): with one key, series of one patient stay together and
/// references stay true; who has no key cannot tell which patient a file is of by trying the names of all.
struct Deidentification {
  std::vector<std::byte> key;
  std::set<ConfidentialityOption> options = {};

  bool has(ConfidentialityOption option) const { return options.contains(option); }
  friend bool operator==(const Deidentification&, const Deidentification&) = default;
};

/// "basic", or options separated by commas. @throws InputError for another word, or both kinds of dates
std::set<ConfidentialityOption> confidentiality_options(std::string_view text);

/// The bytes of a file without white space at its end. @throws InputError for less than 16 bytes or more than 4096
std::vector<std::byte> read_deidentification_key(const std::filesystem::path& path);

}  // namespace tetwarp
