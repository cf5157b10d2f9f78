// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <gtest/gtest.h>

#include <cstring>

#include "deform/resampler.h"

namespace tetwarp::test {

/// The outputs of one call of a resampler.
template <class V>
struct Outcome {
  Volume<V> output;
  Volume<std::uint8_t> coverage;
  Volume<glm::vec3> inverse_mm;
  Volume<float> jacobian;
  Volume<std::uint16_t> owners;
  Volume<std::uint32_t> tetrahedra;
  Report report;
};

/// A byte that fills outputs before a call, so that a voxel that was not written shows: no correct result consists of
/// it.
template <class V>
Volume<V> poisoned(const Geometry& geometry) {
  Volume<V> volume{geometry, std::vector<V>(static_cast<std::size_t>(voxel_count(geometry)))};
  std::memset(static_cast<void*>(volume.voxels.data()), 0xAB, volume.voxels.size() * sizeof(V));
  return volume;
}

template <class V>
Outcome<V> poisoned_outcome(const Geometry& geometry) {
  return {poisoned<V>(geometry),
          poisoned<std::uint8_t>(geometry),
          poisoned<glm::vec3>(geometry),
          poisoned<float>(geometry),
          poisoned<std::uint16_t>(geometry),
          poisoned<std::uint32_t>(geometry),
          {}};
}

template <class V>
Maps maps_of(Outcome<V>& outcome) {
  return {.coverage = view(outcome.coverage),
          .inverse_mm = {&outcome.inverse_mm.geometry, whole(outcome.inverse_mm.geometry), VoxelType::f32, 3,
                         std::as_writable_bytes(std::span(outcome.inverse_mm.voxels)).data()},
          .jacobian = view(outcome.jacobian),
          .owners = view(outcome.owners),
          .tetrahedra = view(outcome.tetrahedra)};
}

struct Options {
  Interpolation interpolation = Interpolation::linear;
  double background = -7;
  std::optional<PaddingRange> padding = {};
  std::optional<Region> region = {};  ///< empty: all of the output
  bool pull = false;                  ///< the field is a pull field; maps that these do not have are left out
};

/// Sends a volume through the field that the resampler was given, and fills every map.
template <class V>
Outcome<V> run(Resampler& resampler, const Volume<V>& source, const Options& options = {}) {
  Outcome<V> outcome = poisoned_outcome<V>(resampler.output());
  const Target target{.source = view(source),
                      .output = view(outcome.output),
                      .interpolation = options.interpolation,
                      .background = options.background,
                      .padding = options.padding};
  Maps maps = maps_of(outcome);
  if (options.pull) maps.jacobian = maps.owners = maps.tetrahedra = {};
  outcome.report = resampler.resample(options.region.value_or(whole(resampler.output())), {&target, 1}, maps);
  return outcome;
}

/// Whether two lists hold the same bytes, NaN and -0 included.
template <class T>
testing::AssertionResult same_bits(const std::vector<T>& expected, const std::vector<T>& actual) {
  if (expected.size() != actual.size()) {
    return testing::AssertionFailure() << "expected " << expected.size() << " voxels, found " << actual.size();
  }
  for (std::size_t n = 0; n < expected.size(); ++n) {
    if (std::memcmp(&expected[n], &actual[n], sizeof(T)) != 0) {
      auto failure = testing::AssertionFailure() << "first difference at voxel " << n << " of " << expected.size();
      if constexpr (std::is_arithmetic_v<T>) failure << ": expected " << +expected[n] << ", found " << +actual[n];
      return failure;
    }
  }
  return testing::AssertionSuccess();
}

template <class V>
void expect_same_outcome(const Outcome<V>& expected, const Outcome<V>& actual) {
  EXPECT_TRUE(same_bits(expected.output.voxels, actual.output.voxels)) << "output";
  EXPECT_TRUE(same_bits(expected.coverage.voxels, actual.coverage.voxels)) << "coverage";
  EXPECT_TRUE(same_bits(expected.inverse_mm.voxels, actual.inverse_mm.voxels)) << "inverse";
  EXPECT_TRUE(same_bits(expected.jacobian.voxels, actual.jacobian.voxels)) << "jacobian";
  EXPECT_TRUE(same_bits(expected.owners.voxels, actual.owners.voxels)) << "owners";
  EXPECT_TRUE(same_bits(expected.tetrahedra.voxels, actual.tetrahedra.voxels)) << "tetrahedra";
}

inline void expect_same_report(const Report& expected, const Report& actual) {
  EXPECT_EQ(expected.covered, actual.covered);
  EXPECT_EQ(expected.uncovered, actual.uncovered);
  EXPECT_EQ(expected.clamped, actual.clamped);
  EXPECT_EQ(expected.padded, actual.padded);
  EXPECT_EQ(expected.conflicts, actual.conflicts);
  EXPECT_EQ(expected.inverted, actual.inverted);
  EXPECT_EQ(expected.degenerate, actual.degenerate);
  EXPECT_EQ(expected.multiply_owned, actual.multiply_owned);
  EXPECT_EQ(expected.jacobian_min, actual.jacobian_min);
  EXPECT_EQ(expected.jacobian_max, actual.jacobian_max);
}

/// Calls `visit(voxel, n)` for every voxel, i fastest, n = 0, 1, ...
template <class Visit>
void for_each_voxel(const Geometry& geometry, Visit&& visit) {
  std::size_t n = 0;
  for (std::int64_t k = 0; k < geometry.size.z; ++k) {
    for (std::int64_t j = 0; j < geometry.size.y; ++j) {
      for (std::int64_t i = 0; i < geometry.size.x; ++i, ++n) visit(glm::i64vec3(i, j, k), n);
    }
  }
}

inline std::size_t offset_of(const Geometry& geometry, const glm::i64vec3& voxel) {
  return static_cast<std::size_t>(voxel.x + geometry.size.x * (voxel.y + geometry.size.y * voxel.z));
}

inline bool is_voxel(const Geometry& geometry, const glm::i64vec3& voxel) {
  return contains(whole(geometry), Region{voxel, voxel + std::int64_t{1}});
}

}  // namespace tetwarp::test
