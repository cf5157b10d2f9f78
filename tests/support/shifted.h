// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/support/fields.h"
#include "tests/support/reference_sample.h"
#include "tests/support/run.h"

namespace tetwarp::test {

constexpr Interpolation kInterpolations[] = {Interpolation::nearest, Interpolation::linear, Interpolation::cubic,
                                             Interpolation::vote};

/// A lattice with cells of one voxel that reaches two voxels beyond the grid on every side.
inline Geometry wide_lattice(const Geometry& grid) {
  Geometry lattice = grid;
  lattice.size += std::int64_t{4};
  lattice.origin = point_from_index(grid)(glm::dvec3(-2));
  return lattice;
}

template <class V>
Volume<V> random_values(const Geometry& grid, Random& random, double low, double high) {
  Volume<V> volume{grid, {}};
  for_each_voxel(grid, [&](const glm::i64vec3&, std::size_t) {
    const double value = random.real(low, high);
    volume.voxels.push_back(static_cast<V>(std::is_integral_v<V> ? std::nearbyint(value) : value));
  });
  return volume;
}

/// Runs a volume through a lattice that moves as a whole by a multiple of 2^-12 voxel, so that every voxel comes
/// exactly from voxel - shift.
template <class V>
Outcome<V> run_shifted(ForwardResampler& resampler, const Volume<V>& source, const glm::dvec3& shift,
                       const Options& options) {
  const VertexField field = uniform_field(wide_lattice(resampler.output()), glm::vec3(shift));
  resampler.set_field(view(field));
  return run(resampler, source, options);
}

/// Compares every voxel and every count with the formulas in double.
template <class V>
void expect_like_formula(const Outcome<V>& found, const Volume<V>& source, const glm::dvec3& shift,
                         const Options& options) {
  std::uint64_t covered = 0, padded = 0, clamped = 0;
  for_each_voxel(found.output.geometry, [&](const glm::i64vec3& voxel, std::size_t n) {
    const auto expected = reference_sample(source, glm::dvec3(voxel) - shift, options.interpolation, options.padding);
    double value = expected.inside ? expected.value : options.background;
    double tolerance = 2e-3;
    if constexpr (std::is_integral_v<V>) {
      constexpr double kLowest = std::numeric_limits<V>::lowest(), kHighest = std::numeric_limits<V>::max();
      const double rounded = std::nearbyint(value);
      clamped += rounded < kLowest || rounded > kHighest;
      value = std::clamp(value, kLowest, kHighest);
      tolerance = expected.padded || !expected.inside ? 0 : 0.5 + 1e-3;
    }
    ASSERT_NEAR(static_cast<double>(found.output.voxels[n]), value, tolerance) << "voxel " << to_string(voxel);
    ASSERT_EQ(found.coverage.voxels[n], expected.inside) << "voxel " << to_string(voxel);
    covered += expected.inside;
    padded += expected.padded;
  });
  EXPECT_EQ(found.report.covered, covered);
  EXPECT_EQ(found.report.uncovered, found.output.voxels.size() - covered);
  EXPECT_EQ(found.report.padded, padded);
  EXPECT_EQ(found.report.clamped, clamped);
}

}  // namespace tetwarp::test
