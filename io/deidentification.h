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

/// Options (DICOM PS3.15 E.3) of the Basic Application Level Confidentiality Profile that a program can apply without
/// looking at pictures or understanding texts.
enum class ConfidentialityOption : std::uint8_t {
  retain_dates,   ///< Retain Longitudinal Temporal Information With Full Dates (E.3.6)
  shift_dates,    ///< Retain Longitudinal Temporal Information With Modified Dates (E.3.6): all go back by equally many
                  ///< days
  retain_device,  ///< Retain Device Identity (E.3.8)
  retain_institution,  ///< Retain Institution Identity (E.3.11)
  retain_patient,      ///< Retain Patient Characteristics (E.3.7)
  retain_uids,         ///< Retain UIDs (E.3.9)
};

/// All options.
constexpr ConfidentialityOption kConfidentialityOptions[] = {
    ConfidentialityOption::retain_dates,   ConfidentialityOption::shift_dates,
    ConfidentialityOption::retain_device,  ConfidentialityOption::retain_institution,
    ConfidentialityOption::retain_patient, ConfidentialityOption::retain_uids};

/// The word of the command line: retain-dates, shift-dates, retain-device, retain-institution, retain-patient or
/// retain-uids.
const char* name_of(ConfidentialityOption option);

/// Edition of DICOM PS3.15 whose table E.1-1 decides what happens to an attribute: "PS3.15 2026d".
extern const char kConfidentialityEdition[];

/// How files are de-identified by the Basic Profile.
///
/// New UIDs, the new Patient ID and the number of days by which dates move depend on the key and on what they replace
/// alone (HMAC-SHA-256, FIPS 198-1). With one key, series of one patient stay together and references stay true.
/// Without the key nobody can find the patient of a file by trying the names of all patients.
struct Deidentification {
  std::vector<std::byte> key;                    ///< secret key, 16 to 4096 bytes
  std::set<ConfidentialityOption> options = {};  ///< what is retained

  /// Whether an option is set.
  bool has(ConfidentialityOption option) const { return options.contains(option); }
  /// Whether key and options are equal.
  friend bool operator==(const Deidentification&, const Deidentification&) = default;
};

/// Parses options: "basic" for none, or names separated by commas.
/// @throws InputError for another word, or for both retain-dates and shift-dates
std::set<ConfidentialityOption> confidentiality_options(std::string_view text);

/// Reads a key from a file: its bytes without white space at the end.
/// @throws InputError for less than 16 or more than 4096 bytes
std::vector<std::byte> read_deidentification_key(const std::filesystem::path& path);

}  // namespace tetwarp
