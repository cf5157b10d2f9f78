// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "deform/contours/contour.h"
#include "io/dicom_series.h"

namespace tetwarp {

/// One region of interest (ROI) of a structure set.
struct Structure {
  int number = 0;  ///< ROI Number (3006,0022)
  std::string frame_of_reference_uid;
  std::vector<Contour> contours;  ///< in the order of the file, none on a slice
};

/// What a file holds beside contours. Hides DCMTK.
struct StructureSetHeader;

/// An RT Structure Set (PS3.3 A.19).
struct StructureSet {
  std::vector<Structure> structures;  ///< in the order of Structure Set ROI Sequence (3006,0020)
  std::shared_ptr<const StructureSetHeader> header;
};

/// Whether a file says that it is an RT Structure Set; false also where it is none at all.
bool is_dicom_structure_set(const std::filesystem::path& path);

/// @throws InputError for another kind of file, one that is damaged, and contours that contradict themselves: naming
/// the file, the ROI and the contour
StructureSet read_structure_set(const std::filesystem::path& path);

/// What was written.
struct StructureWriteReport {
  std::string series_uid, sop_instance_uid;
};

/// Writes a structure set that was moved with a derived series (docs/reference/dicom.md has the table of attributes).
/// Reads no clock: the same input gives the same bytes and the same UIDs.
/// @param moved   contours of each structure of `source`, on slices of the derived series
/// @param series  what they refer to, wholly written
/// @throws Error when the file cannot be written
StructureWriteReport write_structure_set(const std::filesystem::path& path, const StructureSet& source,
                                         const std::vector<std::vector<Contour>>& moved, const DicomWriteReport& series,
                                         const DicomDerivation& derivation);

}  // namespace tetwarp
