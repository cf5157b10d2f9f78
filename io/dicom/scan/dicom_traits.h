// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: the attributes that may tell several volumes of one series apart.
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "io/dicom/scan/dicom_header.h"

namespace tetwarp {

/// Attributes, in the order in which they are tried: first those that say outright which of several volumes a slice
/// belongs to, then how the volume was made, last when. docs/reference/dicom.md has the table.
enum class Trait : std::uint8_t {
  temporal_position,
  temporal_index,
  stack,  ///< Stack ID of frames
  cardiac_phase,
  respiratory_phase,
  trigger_time,
  trigger_delay,
  series_description,
  image_comments,  ///< only the percentage in the text
  kvp,
  kernel,
  thickness,
  image_type,
  dimensions,  ///< indices of frames along dimensions that are no position
  contrast,
  scan_options,
  filter,
  protocol,
  acquisition_number,
  series_number,
  irradiation_event,
  acquisition_time,  ///< date and time
  content_time,
  series_time,
};
constexpr std::size_t kTraits = 24;

/// Name and tag of a trait, "Acquisition Number (0020,0012)".
std::string name_of(Trait trait);

/// The values of all traits, each followed by a zero byte. Numbers and times are spelt in one way, other texts as they
/// are, at most 256 bytes each.
std::string read_traits(DcmItem& data);

/// The value of one trait; empty where the file has none.
std::string_view trait_of(const DicomFileHeader& header, Trait trait);

/// Which traits hold words that name the patient (patient_names.h): one bit each, the lowest for the first trait. A
/// value that is a number, a time or a UID, as its trait should be, does not count.
std::uint32_t traits_naming_patient(DcmItem& data, const std::string& traits);

/// Whether value `a` of a trait comes before `b`: numbers by value, times by the clock, "P10" after "P9"; an empty
/// value comes first.
bool is_before(Trait trait, std::string_view a, std::string_view b);

/// Labels of volumes with these values of a trait, which are all different, in words that people use: "phase 50 %",
/// "acquisition 3". Values that name the patient are not shown but numbered.
std::vector<std::string> labels_of(Trait trait, std::span<const DicomFileHeader* const> headers);

/// Series Description of the first of a series' files in UTF-8, for messages; empty if that of any of them names the
/// patient.
std::string shown_description(std::span<const DicomFileHeader> files);

}  // namespace tetwarp
