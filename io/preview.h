// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <string>

#include "deform/volume.h"

namespace tetwarp {

/// Writes a PNG by which a person can judge a deformation. Its rows are before, after and difference; its columns are
/// the axial, coronal and sagittal slice through the middle, in true proportions, with the head up and the patient's
/// right side on the left. It has letters of orientation, window and level, a scale bar and a legend of the colours of
/// the difference.
///
/// @param path    file to write
/// @param before  volume of any voxel type and direction
/// @param after   volume on the same grid
/// @param title   one line at the top, without data of the patient
/// @throws InputError for grids that differ
/// @throws Error when the file cannot be written
void write_preview(const std::filesystem::path& path, const ConstVolumeView& before, const ConstVolumeView& after,
                   const std::string& title);

}  // namespace tetwarp
