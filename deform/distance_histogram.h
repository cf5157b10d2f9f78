// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

namespace tetwarp {

/// Counts distances by the upper 16 bits of their floats, which gives bins less than 1 % wide.
class DistanceHistogram {
 public:
  void add(double distance) {
    const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(distance));
    ++counts_[bits >> kDropped];
  }
  void add(const DistanceHistogram& other) {
    for (std::size_t n = 0; n < counts_.size(); ++n) counts_[n] += other.counts_[n];
  }
  /// A distance that the part `part` of all distances does not exceed: the upper end of a bin.
  double percentile(double part, std::uint64_t all) const {
    const auto wanted = static_cast<std::uint64_t>(std::ceil(part * static_cast<double>(all)));
    std::uint64_t seen = 0;
    for (std::size_t n = 0; n < counts_.size(); ++n) {
      seen += counts_[n];
      if (seen >= wanted) return std::bit_cast<float>(static_cast<std::uint32_t>((n << kDropped) | kRest));
    }
    return 0;
  }

 private:
  static constexpr int kDropped = 16;
  static constexpr std::uint32_t kRest = (1U << kDropped) - 1;
  std::vector<std::uint64_t> counts_ = std::vector<std::uint64_t>(std::size_t{1} << (31 - kDropped));
};

}  // namespace tetwarp
