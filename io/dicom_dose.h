// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>

#include "deform/volume.h"
#include "io/dicom_along.h"

namespace tetwarp {

/// Header of an RT Dose object (DICOM PS3.3 A.18): a grid of doses in one file.
struct DicomDose {
  Geometry geometry;  ///< from Image Position and Orientation (Patient), Pixel Spacing and Grid Frame Offset Vector
  std::string units;  ///< Dose Units (3004,0002): "GY" or "RELATIVE"
  std::string frame_of_reference_uid;  ///< Frame of Reference UID (0020,0052)
};

/// Whether a file is a DICOM RT Dose object; false for a file that cannot be read.
bool is_dicom_dose(const std::filesystem::path& path);

/// Reads all but the doses.
/// @throws InputError for a file that is no RT Dose object, whose frames are not evenly spaced, or whose numbers
///         describe no grid
DicomDose read_dose_header(const std::filesystem::path& path);

/// Reads the doses as float32: stored values times Dose Grid Scaling (3004,000E).
/// @throws InputError as `read_dose_header`, and for Pixel Data of another size than the header states
AnyVolume read_dose(const std::filesystem::path& path);

/// What was written of a dose.
struct DoseReport : AlongReport {
  double scaling = 0;  ///< Dose Grid Scaling (3004,000E), the dose of one stored unit
  std::string units;   ///< Dose Units (3004,0002)
};

/// Writes doses that went through a field as an RT Dose object (PS3.3 A.18). docs/reference/dicom.md lists what it
/// takes over from the source. Frames have 32-bit words, the largest dose is 2^31 - 1. Negative doses become 0, unless
/// the words of the source are signed.
/// @param path    file to write
/// @param doses   float32, in the units of the source, on a straight and even grid
/// @param along   the source of the doses, and what was done
/// @param series  the derived series to which the object refers
/// @throws InputError for the dose of another patient
/// @throws Error when the file cannot be written
DoseReport write_derived_dose(const std::filesystem::path& path, const ConstVolumeView& doses, const DicomAlong& along,
                              const WrittenSeries& series);

}  // namespace tetwarp
