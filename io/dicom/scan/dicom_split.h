// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: tells the volumes of a series apart.
#include <string>
#include <vector>

#include "io/dicom/scan/dicom_header.h"

namespace tetwarp {

/// The slices of one volume of a series.
struct SplitVolume {
  std::vector<DicomFileHeader> files;
  std::string label = {};     ///< empty where the series is one volume
  std::string split_by = {};  ///< the attribute whose value they share
  /// Where slices lie at one position and nothing tells them apart: the attributes that were tried.
  std::string tried = {};
};

/// Tells the volumes apart that share a series.
///
/// Slices of different orientation, size, pixels or frame of reference belong to different volumes, if each of these
/// has three slices. Slices of one kind are several volumes if two lie at one position, or if they lie at uneven
/// distances, and if an attribute (Trait), two attributes, the folder, or runs of Instance Number through three
/// positions or more tell them apart rightly. The first of these that gives volumes of the same positions is taken.
/// Where none does, the one that gives the fewest volumes is taken, if each volume
/// - has three slices or more, no two of them at one position;
/// - overlaps another in space, and none goes on where another ends (those would be pieces of one);
/// and if half of the volumes are regular stacks (all of them, where no two slices lie at one position). A series holds
/// at most 500 volumes.
/// @param files  with position, orientation and spacing
/// @return the volumes in their natural order; one volume of all files where nothing tells volumes apart
std::vector<SplitVolume> split_volumes(std::vector<DicomFileHeader> files);

}  // namespace tetwarp
