// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>

#include "tests/support/oracle.h"
#include "tests/support/reference_sample.h"
#include "tests/support/run.h"

namespace tetwarp::test {

/// A source whose linear interpolation is smooth: rounding of coordinates shows as a small error.
inline Volume<float> smooth_source(const Geometry& geometry) {
  Volume<float> source{geometry, {}};
  for_each_voxel(geometry, [&](const glm::i64vec3& voxel, std::size_t) {
    const glm::dvec3 x(voxel);
    source.voxels.push_back(static_cast<float>(100 * std::sin(x.x) + 30 * x.y - 20 * x.z));
  });
  return source;
}

/// How far u, in voxels, may be from the exact one: float arithmetic with the owner's edges; or, in a coarse field,
/// what fixed point promises, and the rounding of the map from which u is read, to float.
inline double u_tolerance(const Undeformed& exact) {
  if (!exact.coarse) return 1e-7 * (exact.reach * exact.condition + 16);
  const glm::dvec3 u = glm::abs(exact.u);
  return 0x1p-24 * (1 + exact.from_middle) + 0x1p-30 + 0x1p-20 * (u.x + u.y + u.z);
}

inline double distance(const glm::dvec3& u, const glm::dvec3& v) {
  const glm::dvec3 d = glm::abs(u - v);
  return std::max({d.x, d.y, d.z});
}

/// Compares owners, inverse, Jacobian, coverage and value of every voxel with the oracle.
inline void expect_like_oracle(const Outcome<float>& found, const Volume<float>& source, const Oracle& oracle) {
  const Geometry& grid = found.output.geometry;
  const glm::dmat3 index_from_mm = index_from_point(grid).linear;
  std::uint64_t covered = 0;
  int failures = 0;
  for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
    if (failures > 3) return;
    SCOPED_TRACE("voxel " + to_string(voxel));
    const Owners& owners = oracle.owners(voxel);
    EXPECT_EQ(found.owners.voxels[n], owners.count);
    EXPECT_EQ(found.tetrahedra.voxels[n], owners.count == 0 ? kNoTetrahedron : owners.lowest);
    covered += found.coverage.voxels[n];
    if (owners.count == 0) {
      EXPECT_TRUE(std::isnan(found.inverse_mm.voxels[n].x) && std::isnan(found.jacobian.voxels[n]));
      EXPECT_EQ(found.coverage.voxels[n], 0);
      EXPECT_EQ(found.output.voxels[n], -7);
    } else if (found.owners.voxels[n] > 0) {
      const Undeformed exact = oracle.undeformed(voxel);
      const glm::dvec3 u = index_from_mm * glm::dvec3(found.inverse_mm.voxels[n]);
      const double tolerance = u_tolerance(exact);
      EXPECT_LE(std::min(distance(u, exact.u), distance(u, exact.alternative)), tolerance)
          << "u " << u.x << " " << u.y << " " << u.z << ", exact " << exact.u.x << " " << exact.u.y << " " << exact.u.z
          << ", condition " << exact.condition;
      if (std::isfinite(exact.jacobian)) {
        EXPECT_NEAR(found.jacobian.voxels[n], exact.jacobian,
                    jacobian_tolerance(exact.jacobian, exact.condition, exact.rest_condition));
      } else {
        EXPECT_EQ(found.jacobian.voxels[n], exact.jacobian);
      }
      const ReferenceSample sample = reference_sample(source, glm::dvec3(voxel) + u, Interpolation::linear);
      if (sample.jump > 1e-3) {
        EXPECT_EQ(found.coverage.voxels[n], sample.inside);
        EXPECT_NEAR(found.output.voxels[n], sample.inside ? sample.value : -7, 1e-2);
      }
    }
    failures += testing::Test::HasFailure();
  });
  EXPECT_EQ(found.report.covered, covered);
  EXPECT_EQ(found.report.covered + found.report.uncovered, found.output.voxels.size());
  EXPECT_EQ(found.report.inverted, oracle.inverted);
  EXPECT_EQ(found.report.degenerate, oracle.degenerate);
  EXPECT_EQ(found.report.multiply_owned, oracle.multiply_owned);
  EXPECT_GE(found.report.jacobian_min, oracle.jacobian_min.low);
  EXPECT_LE(found.report.jacobian_min, oracle.jacobian_min.high);
  EXPECT_GE(found.report.jacobian_max, oracle.jacobian_max.low);
  EXPECT_LE(found.report.jacobian_max, oracle.jacobian_max.high);
}

/// Sends a smooth source through a field and compares every voxel with the oracle. @return the oracle
inline Oracle expect_oracles_result(ForwardResampler& resampler, const VertexField& field,
                                    Outside outside = Outside::refuse) {
  const Volume<float> source = smooth_source(resampler.output());
  resampler.set_field(view(field, outside));
  Oracle oracle(resampler.output(), field);
  expect_like_oracle(run(resampler, source), source, oracle);
  return oracle;
}

}  // namespace tetwarp::test
