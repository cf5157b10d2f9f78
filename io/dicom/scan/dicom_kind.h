// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: tells slices apart that can never be of one volume.
#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "io/dicom/scan/dicom_header.h"

namespace tetwarp {

/// Whether two slices have the same orientation, within round-off of at least four digits: 1e-4 is 0.05 mm at the far
/// end of a 500 mm slice.
bool same_orientation(const DicomFileHeader& a, const DicomFileHeader& b);

/// Whether two slices have the same pixel spacing, within 1e-5 of it: 0.005 mm over 500 mm.
bool same_pixel_spacing(const DicomFileHeader& a, const DicomFileHeader& b);

/// Direction cosines as the attribute has them: "1\0\0\0\1\0".
std::string orientation_text(const std::array<double, 6>& cosines);

/// Slices that agree in orientation, Rows and Columns, Pixel Spacing, Frame of Reference, study and, if they are
/// frames, Stack ID.
struct SliceKind {
  std::vector<std::size_t> slices;  ///< indices of the slices among the files, rising
  std::string label;  ///< in what these slices differ from other kinds, "axial, 512 x 512"; empty if there is one kind
  /// The attributes that differ: "Image Orientation (0020,0037) and Rows x Columns".
  std::string differ_by;
};

/// Sorts slices by kind. All must have position, orientation and spacing.
/// @return the kinds in an order that depends on their values, not on that of the files; nothing for more than 64
/// kinds, which are no series
std::vector<SliceKind> slice_kinds(const std::vector<DicomFileHeader>& files);

}  // namespace tetwarp
