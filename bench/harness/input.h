// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>

#include "bench/harness/options.h"
#include "deform/volume.h"

namespace tetwarp::bench {

/// "phantom", "dicom", "image" or "raw".
std::string input_kind(const InputOptions& options);

/// The volume that is deformed, on a grid of spacing 1 at origin 0: voxels are mm.
///
/// @param slices  of the phantom; other inputs have their own
/// @throws InputError for a volume that is not int16, or holds one value only: nothing could go wrong with it
Volume<std::int16_t> read_input(const InputOptions& options, std::int64_t slices);

/// @throws InputError for a volume of one value
void require_contrast(const Volume<std::int16_t>& volume);

}  // namespace tetwarp::bench
