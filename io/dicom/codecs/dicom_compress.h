// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: what a transfer syntax makes of the pixels of a slice, and of a data set.
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "io/dicom_series.h"

namespace tetwarp {

/// UID of PS3.6 annex A.
const char* uid_of(DicomEncoding encoding);

/// Whether Pixel Data are fragments (PS3.5 A.4).
bool is_encapsulated(DicomEncoding encoding);

/// Compresses the words of a slice without loss, as one frame: RLE (PS3.5 Annex G), a run ends with its row; or JPEG-LS
/// (ITU-T T.87). An even number of bytes, a function of the words alone.
/// @param encoding  an encapsulated one
/// @throws Error when the coder fails
std::vector<std::byte> compressed_frame(std::span<const std::int16_t> voxels, std::size_t rows, std::size_t columns,
                                        DicomEncoding encoding);

/// Deflates a data set (PS3.5 A.5: no header of zlib) to an even number of bytes. @throws Error without memory
std::vector<std::byte> deflated(std::span<const std::byte> dataset);

}  // namespace tetwarp
