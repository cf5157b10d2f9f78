// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to the program tetwarp-read, which limits memory and time: this reader is not safe without limits.
#include <cstdint>
#include <filesystem>
#include <vector>

#include "itkbridge/isolated/read_record.h"

namespace tetwarp {

/// Reads a transform as `read_transform_hdf5` does, but in this process, which a damaged file may bring down. The
/// members of a record are those of a TransformRecord, in their order. A file has one
/// part, whatever `part` says.
std::vector<ReadRecord> read_hdf5_unconfined(const std::filesystem::path& path, std::uint64_t part);

}  // namespace tetwarp
