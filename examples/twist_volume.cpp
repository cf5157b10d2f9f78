// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// The library in one page: a volume, a field, a resampler. It needs neither ITK nor DCMTK.
#include <cstdio>

#include "deform/fields/formula.h"
#include "deform/phantom.h"
#include "deform/resampler.h"

int main() {
  using namespace tetwarp;
  const Volume<std::int16_t> ct = make_phantom({128, 128, 96}, {3, 3, 3}, /*seed=*/1);
  const VertexField field = twist(ct.geometry, /*angle=*/0.5, /*cell_size=*/4);

  Report report;
  const auto resampler = make_cpu_resampler(ct.geometry);
  const Volume<std::int16_t> twisted = resample(*resampler, ct, field, &report);

  std::printf("%zu voxels, %llu covered, %llu not; Jacobian %.3f to %.3f\n", twisted.voxels.size(),
              static_cast<unsigned long long>(report.covered), static_cast<unsigned long long>(report.uncovered),
              report.jacobian_min, report.jacobian_max);
  return 0;
}
