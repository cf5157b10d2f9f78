// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <vector>

#include "deform/volume.h"

namespace tetwarp::truth {

/// The voxels of a volume by their distance from a surface along which tissue slips.
struct Bands {
  /// How far each band reaches, mm, from the nearest on. The first holds what is scored by itself.
  std::vector<double> most_mm;
  /// 1 for the first band, 2 for the next; 0: farther away than all bands. i fastest.
  Volume<std::uint8_t> voxels;
};

}  // namespace tetwarp::truth
