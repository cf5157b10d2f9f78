// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>
#include <vector>

#include "deform/score/registration_score.h"

namespace tetwarp::apps {

/// A PNG of the axial slice through a place: the volume in grey, errors in red where voxels count, up to 10 mm; blue
/// where the result says no place.
/// @param volume  on the grid of the truth
/// @param where   LPS mm, such as where the largest error is
std::vector<std::uint8_t> error_picture(score::Truth& truth, const PullField& result, const ConstVolumeView& volume,
                                        std::span<const score::Counts> counts, const glm::dvec3& where);

}  // namespace tetwarp::apps
