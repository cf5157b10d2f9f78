// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to the program tetwarp-read, whose limits this needs.
#include <cstdint>
#include <filesystem>
#include <vector>

#include "itkbridge/transforms/transform_record.h"

namespace tetwarp {

/// Deflate cannot do better than 1032 to 1: what a byte of an HDF5 file can become.
inline constexpr std::uint64_t kDeflateAtMost = 1040;

/// `read_transform_hdf5` in this process, which a damaged file may bring down.
std::vector<TransformRecord> read_hdf5_unconfined(const std::filesystem::path& path);

}  // namespace tetwarp
