// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <map>

#include "deform/volume.h"

namespace tetwarp::score {

/// How far two label maps agree about one label.
struct Overlap {
  std::uint64_t first = 0,  ///< voxels of the label in the first map
      second = 0,           ///< in the second one
      both = 0;             ///< in both

  /// Dice's coefficient, 0 to 1: twice what is common over the sum of both.
  double dice() const { return 2.0 * static_cast<double>(both) / static_cast<double>(first + second); }
};

/// Compares each label but 0 of two label maps on one grid.
/// @throws InputError for maps of other sizes, or of values that are not whole numbers
std::map<std::int64_t, Overlap> compare_labels(const ConstVolumeView& first, const ConstVolumeView& second);

}  // namespace tetwarp::score
