// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to the program tetwarp-read, which limits memory and time: this reader is not safe without limits.
#include <cstdint>
#include <filesystem>
#include <vector>

#include "itkbridge/transforms/transform_record.h"

namespace tetwarp {

/// How many bytes a byte of an HDF5 file can become, at most: deflate cannot do better than 1032.
inline constexpr std::uint64_t kDeflateAtMost = 1040;

/// Reads a transform as `read_transform_hdf5` does, but in this process, which a damaged file may bring down.
std::vector<TransformRecord> read_hdf5_unconfined(const std::filesystem::path& path);

}  // namespace tetwarp
