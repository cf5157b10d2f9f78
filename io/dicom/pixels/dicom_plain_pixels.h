// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: Pixel Data of objects that are read only where nothing compressed them (doses, segmentations).
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcdatset.h>

#include <cstddef>
#include <filesystem>

namespace tetwarp {

/// Pixel Data (7FE0,0010) as they lie in the file: `expected` bytes, and one more where that is odd.
/// @param kind  the kind of object, for the message: "a dose"
/// @throws InputError naming `path` where Pixel Data are compressed, missing, or of another length
DcmElement& plain_pixels(DcmDataset& data, const std::filesystem::path& path, std::size_t expected, const char* kind);

}  // namespace tetwarp
