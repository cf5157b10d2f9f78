// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace tetwarp {

/// Counts distances by the upper 16 bits of their floats, which gives bins less than 1 % wide. It holds the bins from
/// the least to the largest that was used.
class DistanceHistogram {
 public:
  /// @param distance  not below 0; more than the largest float counts as that
  void add(double distance) {
    const auto number = static_cast<float>(std::min(distance, static_cast<double>(std::numeric_limits<float>::max())));
    add(std::bit_cast<std::uint32_t>(number) >> kDropped, 1);
  }
  /// Adds what another one has counted.
  void add(const DistanceHistogram& other) {
    for (std::size_t n = 0; n < other.counts_.size(); ++n)
      if (other.counts_[n] > 0) add(other.first_ + n, other.counts_[n]);
  }
  /// A distance that the part `part` of all distances does not exceed: the upper end of a bin.
  double percentile(double part, std::uint64_t all) const {
    const auto wanted = static_cast<std::uint64_t>(std::ceil(part * static_cast<double>(all)));
    std::uint64_t seen = 0;
    for (std::size_t n = 0; n < counts_.size(); ++n) {
      seen += counts_[n];
      if (seen < wanted) continue;
      const std::size_t bin = first_ + n;
      if (bin == 0) return 0;  // holds 0, and what is less than any distance
      return std::bit_cast<float>(static_cast<std::uint32_t>((bin << kDropped) | kRest));
    }
    return 0;
  }

 private:
  static constexpr int kDropped = 16;
  static constexpr std::uint32_t kRest = (1U << kDropped) - 1;

  void add(std::size_t bin, std::uint64_t count) {
    if (counts_.empty()) first_ = bin;
    if (bin < first_) {
      counts_.insert(counts_.begin(), first_ - bin, 0);
      first_ = bin;
    }
    if (bin - first_ >= counts_.size()) counts_.resize(bin - first_ + 1);
    counts_[bin - first_] += count;
  }

  std::size_t first_ = 0;
  std::vector<std::uint64_t> counts_;
};

}  // namespace tetwarp
