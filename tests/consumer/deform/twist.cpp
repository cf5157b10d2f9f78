// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Twists a ramp by a quarter turn and compares the slice that turned most with the ramp turned by hand.
#include <cstdio>
#include <cstdlib>
#include <numbers>

#include "deform/fields/formula.h"
#include "deform/resampler.h"

int main() {
  using namespace tetwarp;
  constexpr int kSize = 33;
  Volume<std::int16_t> ramp{{.size = {kSize, kSize, kSize}}, {}};
  for (int k = 0; k < kSize; ++k) {
    for (int j = 0; j < kSize; ++j) {
      for (int i = 0; i < kSize; ++i) ramp.voxels.push_back(static_cast<std::int16_t>(100 * i));
    }
  }
  // The last slice turns from L towards P: what comes to lie at (i, j) was at (j, N - 1 - i).
  const auto resampler = make_cpu_resampler(ramp.geometry);
  Report report;
  const Volume<std::int16_t> twisted =
      resample(*resampler, ramp, twist(ramp.geometry, std::numbers::pi / 2, /*cell_size=*/1), &report);

  int wrong = 0;
  for (int j = 1; j < kSize - 1; ++j) {
    for (int i = 1; i < kSize - 1; ++i) {
      const int found = twisted.voxels[static_cast<std::size_t>(((kSize - 1) * kSize + j) * kSize + i)];
      if (std::abs(found - 100 * j) <= 1) continue;
      if (wrong++ == 0) std::printf("at (%d, %d): expected %d, found %d\n", i, j, 100 * j, found);
    }
  }
  std::printf("%d of %d voxels wrong, %llu covered\n", wrong, (kSize - 2) * (kSize - 2),
              static_cast<unsigned long long>(report.covered));
  return wrong == 0 ? 0 : 1;
}
