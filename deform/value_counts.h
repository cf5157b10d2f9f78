// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <map>

#include "deform/resampler.h"

namespace tetwarp {

/// How many voxels of a volume have each value: of a label map, how large each label is. Every voxel type holds its
/// values in a double. NaN is not counted. It is quick where neighbours along i often share a value, as labels do.
/// @param volume  a whole volume of one component in host memory
/// @param limits  number of threads
/// @throws InputError for another volume
std::map<double, std::uint64_t> count_values(const ConstVolumeView& volume, const Limits& limits = {});

}  // namespace tetwarp
