// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>

#include "deform/volume.h"
#include "io/dicom_along.h"

namespace tetwarp {

/// An RT Dose object (PS3.3 A.18): a grid of doses, one file.
struct DicomDose {
  Geometry geometry;  ///< from Image Position and Orientation (Patient), Pixel Spacing and Grid Frame Offset Vector
  std::string units;  ///< Dose Units (3004,0002): "GY" or "RELATIVE"
  std::string frame_of_reference_uid;
};

/// Whether a file is a DICOM RT Dose object; false for what cannot be read.
bool is_dicom_dose(const std::filesystem::path& path);

/// Reads all but the doses. @throws InputError for frames that are not evenly spaced, or a grid that is not one
DicomDose read_dose_header(const std::filesystem::path& path);

/// Doses as float32: stored values times Dose Grid Scaling (3004,000E).
/// @throws InputError as `read_dose_header`, and for Pixel Data that are truncated or of another size than the header
/// says
AnyVolume read_dose(const std::filesystem::path& path);

/// What was written of a dose.
struct DoseReport : AlongReport {
  double scaling = 0;  ///< Dose Grid Scaling: the quantum
  std::string units;   ///< Dose Units
};

/// Writes doses that went through a field as an RT Dose object (PS3.3 A.18; docs/reference/dicom.md says what it takes
/// over): frames of 32-bit words, the largest dose as 2^31 - 1. Negative doses become 0, unless the source's words are
/// signed.
/// @param doses  float32, in the units of the source, on a straight grid
/// @throws InputError for another patient's dose, Error when the file cannot be written
DoseReport write_derived_dose(const std::filesystem::path& path, const ConstVolumeView& doses, const DicomAlong& along,
                              const WrittenSeries& series);

}  // namespace tetwarp
