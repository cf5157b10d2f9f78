// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <string>

#include "deform/volume.h"

namespace tetwarp {

/// Writes a PNG for a person to judge: rows before, after, difference; columns axial, coronal, sagittal through the
/// middle, in true proportions (mm), head up and patient's right on the left; orientation letters, window and level,
/// scale bar and a legend of the difference colours.
///
/// @param before, after  volumes on the same grid, any voxel type, any direction
/// @param title          one line at the top; no patient data
/// @throws InputError for grids that differ; Error when the file cannot be written
void write_preview(const std::filesystem::path& path, const ConstVolumeView& before, const ConstVolumeView& after,
                   const std::string& title);

}  // namespace tetwarp
