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

/// In the order in which they are tried: first what says outright which of several volumes it is, then how the volume
/// was made, last when. docs/reference/dicom.md has the table.
enum class Trait : std::uint8_t {
  temporal_position,
  temporal_index,
  stack,  ///< of frames
  cardiac_phase,
  respiratory_phase,
  trigger_time,
  trigger_delay,
  series_description,
  image_comments,  ///< the percentage in them alone
  kvp,
  kernel,
  thickness,
  image_type,
  dimensions,  ///< indices of frames in what is no place
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

/// "Acquisition Number (0020,0012)".
std::string name_of(Trait trait);

/// The values of all traits, each ended by a zero; numbers and times in one spelling, texts as they are, at most 256
/// bytes each.
std::string read_traits(DcmItem& data);

/// One of them; empty where the file has none.
std::string_view trait_of(const DicomFileHeader& header, Trait trait);

/// Which of them name the patient (patient_names.h): one bit each, the first trait is the lowest. Numbers, times and
/// UIDs that are such do not.
std::uint32_t traits_naming_patient(DcmItem& data, const std::string& traits);

/// Whether `a` comes before `b`: numbers by value, times by the clock, "P10" after "P9"; nothing comes first.
bool is_before(Trait trait, std::string_view a, std::string_view b);

/// What people call the volumes of these values, which are all different: "phase 50 %", "acquisition 3". Values that
/// name the patient are numbered instead of shown.
std::vector<std::string> labels_of(Trait trait, std::span<const DicomFileHeader* const> headers);

/// Series Description of the first of the files of a series in UTF-8, as messages show it; empty where that of any of
/// them names the patient.
std::string shown_description(std::span<const DicomFileHeader> files);

}  // namespace tetwarp
