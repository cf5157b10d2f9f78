// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <vector>

#include "deform/resampler.h"

namespace tetwarp::truth {

/// What a voxel has to be to become a landmark.
struct LandmarkRules {
  std::size_t most = 1000;  ///< number of landmarks
  double apart_mm = 8;      ///< no two are nearer to each other
};

/// Voxel centres at corners of texture: places that can be told from all their neighbours, in whatever direction.
///
/// The structure tensor S sums the outer products of gradients (central differences, per mm, HU cut to -1000 to 1000)
/// over 5 x 5 x 5 voxels. A corner is a voxel with a large det S / trace adj S (Foerstner and Guelch 1987, in three
/// dimensions), which is near the smallest eigenvalue. Of each block of 4 x 4 x 4 voxels the best one is a candidate;
/// candidates are taken from the best downwards, unless one is near already. Fewer come out where there are not so
/// many.
/// @param ct       HU, one component, the whole volume
/// @param body     not 0 where a landmark may lie, i fastest; such as the voxels of the body
/// @param rules    how many there may be, and how near
/// @param limits   number of threads
/// @param control  progress and stop
/// @return LPS mm, from the best to the worst
/// @throws InputError for views that do not fit; Cancelled
std::vector<glm::dvec3> find_landmarks(const ConstVolumeView& ct, const std::vector<std::uint8_t>& body,
                                       const LandmarkRules& rules = {}, const Limits& limits = {},
                                       const Control& control = {});

}  // namespace tetwarp::truth
