// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "deform/resampler.h"

namespace tetwarp::truth {

/// The seed of the noise of one volume of a set: a hash of the set's seed and the volume's name (FNV-1a, then
/// SplitMix64).
std::uint64_t noise_seed(std::uint64_t seed, std::string_view name);

/// Noise of the slices of a CT: nearly normal, white, then smoothed over its neighbours within a slice.
struct Noise {
  double deviation = 0;  ///< standard deviation, HU; 0: none
  int radius = 0;        ///< of the kernel, voxels
  /// Weights of the (2 radius + 1)^2 neighbours, i fastest. The sum of their squares is 1.
  std::vector<float> kernel;
};

/// Noise smoothed over three by three voxels with the weights 1, 2, 1, as a reconstruction does.
Noise smoothed_noise(double deviation);

/// The noise of a CT, as differences of neighbouring slices show it: half their autocovariance within a slice, over
/// voxels that lie, with their eight neighbours, in soft tissue in both slices (-50 to 150 HU). The kernel is the one
/// of zero phase whose power spectrum is that of the autocovariance, tapered (Bartlett) at 5 voxels; so the noise has
/// the measured power and grain. Differences of anatomy between slices count as noise, so there is rather more than
/// less. At most 32 pairs of slices, spread evenly, are looked at. The result does not depend on the number of threads.
/// @param volume   HU, one component, the whole volume
/// @param limits   number of threads
/// @param control  progress and stop
/// @throws InputError for a view that does not fit, or a volume with fewer than 1000 such voxels
Noise measure_noise(const ConstVolumeView& volume, const Limits& limits = {}, const Control& control = {});

/// Adds noise to a CT. It depends on the noise, the seed and the index of the voxel alone. Values below -1000 HU, which
/// are padding or the darkest air, stay.
/// @param volume  HU, one component, the whole volume
/// @param noise   what is added
/// @param seed    decides the random numbers
/// @param output  gets the sum, rounded and saturated where its type is an integer type; same size and type, and may be
///         the volume itself
/// @param limits  number of threads
/// @throws InputError for views that do not fit
void add_noise(const ConstVolumeView& volume, const Noise& noise, std::uint64_t seed, const VolumeView& output,
               const Limits& limits = {});

}  // namespace tetwarp::truth
