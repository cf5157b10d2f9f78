// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: what the header of an NRRD file (https://teem.sourceforge.net/nrrd/format.html) says of the volume.
#include <map>
#include <string>

#include "io/images/text_header.h"
#include "io/images/value_reader.h"

namespace tetwarp {

struct NrrdHeader {
  ImageHeader image;
  Encoding encoding = Encoding::raw;
  bool big_endian = false;
  /// Voxels of which the first component comes before the second of any: the product of the axes before that of the
  /// components.
  std::uint64_t plane_count = 1;
};

/// Axes of one of the kinds domain, space and time, or of none, are the grid's; one of another kind has the components.
/// Where the header does not place an axis, its spacing is 1, and it lies along the patient's axis of its number. A
/// file that names none of a patient's spaces is taken as LPS, with a note.
/// @throws InputError naming the file, for what is not a 3-D grid of numbers or vectors of a VoxelType, and for fields
///         that are malformed or contradict each other
NrrdHeader parse_nrrd_header(const TextHeader& text, const std::string& file);

/// The lines before the voxels of a file that is written, the empty one included, as teem writes them.
/// @param gzip  how the voxels follow; raw otherwise
std::string nrrd_header(const Geometry& grid, VoxelType type, int components,
                        const std::map<std::string, std::string>& metadata, bool gzip);

}  // namespace tetwarp
