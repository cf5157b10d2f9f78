#pragma once

#include <filesystem>

#include "deform/volume.h"

namespace tetwarp {

/// An RT Dose object (PS3.3 A.18): a grid of doses, one file.
struct DicomDose {
  Geometry geometry;  ///< from Image Position and Orientation (Patient), Pixel Spacing and Grid Frame Offset Vector
  std::string units;  ///< Dose Units (3004,0002): "GY" or "RELATIVE"
};

/// Whether a file is a DICOM RT Dose object; false for what cannot be read.
bool is_dicom_dose(const std::filesystem::path& path);

/// Reads all but the doses. @throws InputError for frames that are not evenly spaced, or a grid that is not one
DicomDose read_dose_header(const std::filesystem::path& path);

/// Doses as float32: stored values times Dose Grid Scaling (3004,000E).
/// @throws InputError as `read_dose_header`, and for Pixel Data that are truncated or of another size than the header
/// says
AnyVolume read_dose(const std::filesystem::path& path);

}  // namespace tetwarp
