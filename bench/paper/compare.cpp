// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/paper/compare.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cstdlib>

namespace tetwarp::bench {

namespace {

/// In integers, so that the sum does not depend on the order.
struct Sums {
  Tally tally;
  std::int64_t largest = 0, sum = 0, compared = 0;

  void add(const Exact& exact, std::size_t n, std::int16_t output, std::uint32_t writes) {
    const bool covered = exact.coverage[n] != 0;
    tally.writes += writes;
    tally.covered += covered;
    tally.lost += covered && writes == 0;
    tally.multiple += writes > 1;
    tally.spilled += !covered && writes > 0;
    if (!covered || writes == 0) return;
    const std::int64_t difference = std::abs(exact.output[n] - output);
    largest = std::max(largest, difference);
    sum += difference;
    ++compared;
  }
  Sums join(const Sums& other) const {
    Sums both = *this;
    both.tally.writes += other.tally.writes;
    both.tally.covered += other.tally.covered;
    both.tally.lost += other.tally.lost;
    both.tally.multiple += other.tally.multiple;
    both.tally.spilled += other.tally.spilled;
    both.largest = std::max(largest, other.largest);
    both.sum += other.sum;
    both.compared += other.compared;
    return both;
  }
};

}  // namespace

Tally compare(const Exact& exact, const std::vector<std::int16_t>& output, const std::vector<std::uint32_t>& writes) {
  const std::size_t voxels = exact.output.size();
  require(exact.coverage.size() == voxels && output.size() == voxels && writes.size() == voxels,
          "results of different sizes cannot be compared");
  Sums sums = tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, voxels, std::size_t{1} << 16), Sums{},
      [&](const tbb::blocked_range<std::size_t>& range, Sums part) {
        for (std::size_t n = range.begin(); n != range.end(); ++n) part.add(exact, n, output[n], writes[n]);
        return part;
      },
      [](const Sums& a, const Sums& b) { return a.join(b); });
  sums.tally.largest_difference = static_cast<double>(sums.largest);
  sums.tally.mean_difference = sums.compared ? static_cast<double>(sums.sum) / static_cast<double>(sums.compared) : 0;
  return sums.tally;
}

double differing_fraction(const Exact& exact, std::span<const std::int16_t> output) {
  const std::size_t voxels = exact.output.size();
  require(exact.coverage.size() == voxels && output.size() == voxels, "results of different sizes cannot be compared");
  std::size_t covered = 0, differing = 0;
  for (std::size_t n = 0; n < voxels; ++n) {
    if (exact.coverage[n] == 0) continue;
    ++covered;
    differing += std::abs(exact.output[n] - output[n]) > 1;
  }
  require(covered > 0, "no voxel is covered, so there is nothing to compare");
  return static_cast<double>(differing) / static_cast<double>(covered);
}

}  // namespace tetwarp::bench
