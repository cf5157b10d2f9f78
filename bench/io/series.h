// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>

#include "io/dicom_series.h"

namespace tetwarp::bench {

/// Lists the folder and reads its one series, as `tetwarp deform` does, or without hashing its files.
/// @throws InputError
DicomVolume read_series(const std::filesystem::path& folder, int threads, FileHash hash = FileHash::made);

/// What a derived series says of how it came to be.
DicomDerivation made_up_derivation();

/// Writes a derived series with full provenance. @param sampled  source slices of each slice
/// @throws Error
void write_series(const std::filesystem::path& folder, const DicomVolume& source, const ConstVolumeView& volume,
                  const std::vector<SliceRange>& sampled, int threads);

}  // namespace tetwarp::bench
