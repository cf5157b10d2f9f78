// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <string_view>

#include "deform/resampler.h"

namespace tetwarp::truth {

/// The seed of the noise of one volume of a set: a hash of the set's seed and the volume's name (FNV-1a, then
/// SplitMix64).
std::uint64_t noise_seed(std::uint64_t seed, std::string_view name);

/// Adds noise to a CT: nearly normal, white, then smoothed over three by three voxels of a slice with the weights
/// 1, 2, 1, as a reconstruction does. It depends on the seed and the index of the voxel alone. Values below -1000 HU,
/// which are padding or the darkest air, stay.
/// @param volume     HU, one component, the whole volume
/// @param deviation  standard deviation, HU
/// @param seed       decides the noise
/// @param output     gets the sum, rounded and saturated where its type is an integer type; same size and type, and may
/// be the volume itself
/// @throws InputError for views that do not fit
void add_noise(const ConstVolumeView& volume, double deviation, std::uint64_t seed, const VolumeView& output,
               const Limits& limits = {});

}  // namespace tetwarp::truth
