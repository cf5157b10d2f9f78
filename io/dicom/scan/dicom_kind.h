// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: slices that could never be of one volume.
#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "io/dicom/scan/dicom_header.h"

namespace tetwarp {

/// Within round-off of at least four digits: 1e-4 is 0.05 mm at the far end of a 500 mm slice.
bool same_orientation(const DicomFileHeader& a, const DicomFileHeader& b);

/// Within 1e-5, relative: 0.005 mm over 500 mm.
bool same_pixel_spacing(const DicomFileHeader& a, const DicomFileHeader& b);

/// "1\0\0\0\1\0".
std::string orientation_text(const std::array<double, 6>& cosines);

/// Slices that agree in orientation, Rows and Columns, Pixel Spacing, Frame of Reference, study and, of frames, Stack
/// ID.
struct SliceKind {
  std::vector<std::size_t> slices;  ///< indices, rising
  std::string label;                ///< in what they differ from the other kinds: "axial, 512 x 512"; of one kind empty
  std::string differ_by;            ///< the attributes: "Image Orientation (0020,0037) and Rows x Columns"
};

/// All slices must have position, orientation and spacing. @return by their values, whatever the order of the files;
/// nothing for more than 64 kinds, which are no series
std::vector<SliceKind> slice_kinds(const std::vector<DicomFileHeader>& files);

}  // namespace tetwarp
