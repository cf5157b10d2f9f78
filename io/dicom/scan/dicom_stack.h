// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <optional>
#include <string>
#include <vector>

#include "io/dicom/scan/dicom_header.h"
#include "io/dicom_series.h"

namespace tetwarp {

/// A rotation from the six cosines of Image Orientation: its columns are the row direction as it is, the column
/// direction made perpendicular to it, and the normal, row x column.
glm::dmat3 rotation_of(const std::array<double, 6>& orientation);

/// Slices whose distance along the normal is at most this, in mm, lie at one position.
constexpr double kSamePosition = 1e-3;

/// The upper median of the gaps between neighbours. @param positions  rising, two or more
double median_gap(const std::vector<double>& positions);

/// Sorts slices of one orientation, size and spacing by position along the normal and sets the geometry of the series.
///
/// A stack is straight and even when (mm; s: slice distance, q: last digit written of Image Position, at most 0.01)
/// - no slice lies off the line through the first one, along the normal, by more than 0.01 + 1e-4 of its distance
///   (what round-off of position and orientation makes; a tilt of 0.1 degrees over 20 mm is beyond it);
/// - no gap differs from the median gap by more than 1e-3 s + q;
/// - no slice is off its place in the even stack by more than 1e-2 s + q (gaps that drift).
/// Where the first does not hold, the slices must lie on the line from the first to the last one, which is the third
/// axis then; where the others do not, `geometry.slices` has the place of each.
///
/// @return why the stack is no volume; none if it is
std::optional<std::string> stack_slices(std::vector<DicomFileHeader>& files, DicomSeries& series);

}  // namespace tetwarp
