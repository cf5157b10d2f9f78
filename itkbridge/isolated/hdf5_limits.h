// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to itkbridge/: what reading an HDF5 file may take.
#include <cstdint>
#include <filesystem>

#include "itkbridge/isolated/isolated_read.h"

namespace tetwarp {

/// How many bytes a byte of an HDF5 file can become, at most: deflate cannot do better than 1032.
inline constexpr std::uint64_t kDeflateAtMost = 1040;

/// Limits for reading a file. A damaged one can lead HDF5 1.10.8 out of its memory, round in circles and into
/// allocations of any size. An undamaged one takes its values as double, stored as float perhaps, twice while a chunk
/// is inflated. @throws InputError where the file cannot be looked at
IsolatedLimits hdf5_limits(const std::filesystem::path& path);

}  // namespace tetwarp
