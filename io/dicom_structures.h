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

/// A region of interest (ROI) of a structure set.
struct Structure {
  int number = 0;                      ///< ROI Number (3006,0022)
  std::string frame_of_reference_uid;  ///< Referenced Frame of Reference UID (3006,0024)
  std::vector<Contour> contours;       ///< in the order of the file; `Contour::slice` is not set
  std::size_t repeated = 0;            ///< closed contours that the file has twice and that are taken once
};

/// What a structure set contains beside contours. The type hides DCMTK.
struct StructureSetHeader;

/// An RT Structure Set (DICOM PS3.3 A.19).
struct StructureSet {
  std::vector<Structure> structures;                 ///< in the order of Structure Set ROI Sequence (3006,0020)
  std::shared_ptr<const StructureSetHeader> header;  ///< everything else
};

/// Whether a file states that it is an RT Structure Set; false for a file that cannot be read.
bool is_dicom_structure_set(const std::filesystem::path& path);

/// Reads a structure set.
/// @throws InputError, which names file, ROI and contour: for another kind of file, one that is damaged, or contours
///         that contradict themselves
StructureSet read_structure_set(const std::filesystem::path& path);

/// What was written of a structure set.
struct StructureWriteReport {
  std::string series_uid,  ///< new Series Instance UID
      sop_instance_uid;    ///< new SOP Instance UID
};

/// Writes a structure set that was moved with a derived series. docs/reference/dicom.md has the table of attributes. It
/// reads no clock: equal input gives equal bytes and UIDs.
/// @param path        file to write
/// @param source      the structure set before it was moved
/// @param moved       contours of each structure of `source`, on slices of the derived series
/// @param series      the derived series to which they refer, completely written
/// @param derivation  what was done
/// @throws Error when the file cannot be written
StructureWriteReport write_structure_set(const std::filesystem::path& path, const StructureSet& source,
                                         const std::vector<std::vector<Contour>>& moved, const DicomWriteReport& series,
                                         const DicomDerivation& derivation);

}  // namespace tetwarp
