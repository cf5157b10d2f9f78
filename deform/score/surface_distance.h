// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <map>

#include "deform/resampler.h"
#include "deform/score/registration_score.h"

namespace tetwarp::score {

/// Distances between the surfaces of each label but 0 of two label maps on one grid, mm: of each surface voxel of one
/// map the distance to the nearest surface voxel of the other, both ways together. A voxel of a label is of its surface
/// if one of its six neighbours is not; where the label goes on beyond the grid it has no surface.
/// @return by label; missing are all surface voxels where one map lacks the label; 0 points and 0 missing for a label
///         without a surface
/// @throws InputError for maps of other sizes, of values that are not whole numbers, or a grid whose axes are not
///         perpendicular
/// @throws Cancelled
std::map<std::int64_t, Errors> surface_distances(const ConstVolumeView& first, const ConstVolumeView& second,
                                                 const Limits& limits = {}, const Control& control = {});

}  // namespace tetwarp::score
