// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: series that hold several volumes.
#include <string>
#include <vector>

#include "io/dicom/scan/dicom_header.h"

namespace tetwarp {

/// Slices of one volume of a series.
struct SplitVolume {
  std::vector<DicomFileHeader> files;
  std::string label = {};     ///< empty where the series is one volume
  std::string split_by = {};  ///< the attribute whose value they share
  std::string tried = {};     ///< of slices at one position that nothing tells apart: what was tried
};

/// Tells the volumes apart that share a series.
///
/// Slices of different orientation, size, pixels or frame of reference are different volumes, if of each there are
/// three. Slices of one kind are several volumes if two lie at one position, or if they lie at uneven distances, and if
/// an attribute (Trait), two of them, the folder, or runs of Instance Number through three positions or more tell
/// them apart rightly. The first that
/// gives volumes of the same positions is taken. Where none does, that which gives the fewest volumes, if each
/// - has three slices or more, no two of them at one position;
/// - overlaps another in space, and none goes on where another ends (those would be pieces of one);
/// and if half of them are regular stacks (all, where no two slices lie at one position). A series holds 500 volumes at
/// most.
/// @param files  with position, orientation and spacing
/// @return in their natural order; one volume of all files where nothing tells volumes apart
std::vector<SplitVolume> split_volumes(std::vector<DicomFileHeader> files);

}  // namespace tetwarp
