// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: compression of a slice's pixels, and of a whole data set, for each transfer syntax that is written.
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "io/dicom_series.h"

namespace tetwarp {

/// Transfer Syntax UID of an encoding (PS3.6 annex A).
const char* uid_of(DicomEncoding encoding);

/// Whether an encoding keeps Pixel Data as fragments (PS3.5 A.4).
bool is_encapsulated(DicomEncoding encoding);

/// Compresses the words of a slice without loss, as one frame of RLE (PS3.5 Annex G), where each run ends with its row,
/// or of JPEG-LS (ITU-T T.87).
/// @param encoding  one for which is_encapsulated holds
/// @return an even number of bytes that depends on the words alone
/// @throws Error when the coder fails
std::vector<std::byte> compressed_frame(std::span<const std::int16_t> voxels, std::size_t rows, std::size_t columns,
                                        DicomEncoding encoding);

/// Deflates a data set to an even number of bytes. The stream has no header of zlib (PS3.5 A.5).
/// @throws Error without memory
std::vector<std::byte> deflated(std::span<const std::byte> dataset);

}  // namespace tetwarp
