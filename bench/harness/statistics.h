// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <vector>

namespace tetwarp::bench {

struct Summary {
  double median = 0, q1 = 0, q3 = 0, min = 0, max = 0;
  std::int64_t frames = 0;
};

/// Value below which a fraction of `sorted` lies, linear between neighbours: fraction * (n - 1) counts from the first.
/// @param sorted  rising, not empty
double quantile(const std::vector<double>& sorted, double fraction);

/// @throws InputError for no values
Summary summarize(std::vector<double> values);

}  // namespace tetwarp::bench
