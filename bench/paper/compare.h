// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "bench/paper/backend.h"

namespace tetwarp::bench {

/// A method's result against Tetwarp's.
struct Tally {
  std::uint64_t writes = 0;       ///< of any voxel, several of one counted each
  std::uint64_t lost = 0;         ///< covered, and never written
  std::uint64_t multiple = 0;     ///< written more than once
  std::uint64_t spilled = 0;      ///< written, and not covered
  std::uint64_t covered = 0;      ///< by Tetwarp
  double largest_difference = 0;  ///< absolute, stored units, over voxels both covered and written
  double mean_difference = 0;

  friend bool operator==(const Tally&, const Tally&) = default;
};

/// @param output, writes  of the method; all of one size. @throws InputError where they are not
Tally compare(const Exact& exact, const std::vector<std::int16_t>& output, const std::vector<std::uint32_t>& writes);

/// Of the voxels that Tetwarp covers, the fraction whose value in `output` differs by more than 1, stored units: more
/// than truncating instead of rounding explains. @throws InputError for another size, or where nothing is covered
double differing_fraction(const Exact& exact, std::span<const std::int16_t> output);

}  // namespace tetwarp::bench
