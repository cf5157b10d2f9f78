// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: how the voxels of an NRRD file lie in it.
#include <cstdint>
#include <filesystem>

#include "io/images/nrrd_header.h"

namespace tetwarp {

/// The layout of the data of an NRRD, which follow its header.
/// @param offset  receives where the data begin, with "line skip" and "byte skip" counted
/// @throws InputError for fields that contradict each other or the file
ValueLayout nrrd_layout(const std::filesystem::path& path, const TextHeader& text, const NrrdHeader& header,
                        std::uint64_t& offset);

}  // namespace tetwarp
