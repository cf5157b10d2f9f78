// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Real CT through Wave, Twist and Bubble, against sampling the source at the true inverse position.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <string_view>

#include "deform/fields/formula.h"
#include "io/dicom_series.h"
#include "tests/support/real_data.h"

namespace {

using namespace tetwarp;

constexpr std::int16_t kBackground = -2048;
/// Voxels: vertices snapped to 2^-12, weights in float. What Wave and Twist may be off by, for each slice is affine.
constexpr double kRounding = 5e-4;

struct RealCt {
  const char *set, *folder;
};

void PrintTo(const RealCt& series, std::ostream* out) { *out << series.set; }

using Inverse = std::function<glm::dvec3(const glm::dvec3& point)>;

/// The point that a bubble moves to `point`: its radial profile r' = r (1 + a (1 - r/R)^2) by bisection.
glm::dvec3 undo_bubble(const Bubble& bubble, const glm::dvec3& point) {
  const glm::dvec3 d = point - bubble.centre;
  const double target = glm::length(d);
  if (target == 0 || target >= bubble.radius) return point;
  double low = 0, high = bubble.radius;
  for (int step = 0; step < 60; ++step) {
    const double r = 0.5 * (low + high), rest = 1 - r / bubble.radius;
    (r * (1 + bubble.strength * rest * rest) < target ? low : high) = r;
  }
  return bubble.centre + d * (0.5 * (low + high) / target);
}

/// Smallest and largest voxel within two of a place, and the linear sample there in double.
struct Reference {
  double value, low, high;
};

Reference sample_in_double(const Volume<std::int16_t>& ct, const glm::dvec3& index) {
  const glm::i64vec3 size = ct.geometry.size;
  const glm::dvec3 base = glm::floor(index), t = index - base;
  Reference result{0, INFINITY, -INFINITY};
  for (int z = -1; z <= 2; ++z) {
    for (int y = -1; y <= 2; ++y) {
      for (int x = -1; x <= 2; ++x) {
        const glm::i64vec3 at =
            glm::clamp(glm::i64vec3(base) + glm::i64vec3(x, y, z), glm::i64vec3(0), size - std::int64_t{1});
        const double voxel = ct.voxels[static_cast<std::size_t>((at.z * size.y + at.y) * size.x + at.x)];
        result.low = std::min(result.low, voxel);
        result.high = std::max(result.high, voxel);
        const auto weight = [](int tap, double fraction) {
          return tap == 0 ? 1 - fraction : (tap == 1 ? fraction : 0);
        };
        result.value += weight(x, t.x) * weight(y, t.y) * weight(z, t.z) * voxel;
      }
    }
  }
  return result;
}

class RealDeformation : public testing::TestWithParam<RealCt> {
 protected:
  /// Every seventh voxel of a middle part (with TETWARP_CI_FULL=1 each): covered where its source is inside, by the
  /// value there to rounding and `error` voxels.
  static void expect_inverse(const Volume<std::int16_t>& ct, const PointMap& forward, const Inverse& inverse,
                             double error) {
    const Geometry& grid = ct.geometry;
    const VertexField field = sample_on(lattice_over(grid, 1), forward);
    const auto resampler = make_cpu_resampler(grid);
    resampler->set_field(view(field));
    const Region region{{grid.size.x * 3 / 8, grid.size.y / 4, 0}, {grid.size.x * 5 / 8, grid.size.y / 2, grid.size.z}};
    const glm::i64vec3 size = region.end - region.begin;
    std::vector<std::int16_t> output(static_cast<std::size_t>(voxel_count(region)), 12345);
    std::vector<std::uint8_t> coverage(output.size(), 77);
    const Target target{.source = view(ct),
                        .output = {&grid, region, VoxelType::i16, 1, reinterpret_cast<std::byte*>(output.data())},
                        .background = kBackground};
    std::vector<glm::vec3> offset_mm(output.size());
    const Maps maps{.coverage = {&grid, region, VoxelType::u8, 1, reinterpret_cast<std::byte*>(coverage.data())},
                    .inverse_mm = {&grid, region, VoxelType::f32, 3, reinterpret_cast<std::byte*>(offset_mm.data())}};
    const Report report = resampler->resample(region, {&target, 1}, maps);
    EXPECT_EQ(report.inverted + report.degenerate, 0u);

    const AffineMap point = point_from_index(grid), index = index_from_point(grid);
    const char* const full = std::getenv("TETWARP_CI_FULL");
    const std::size_t stride = full != nullptr && full == std::string_view("1") ? 1 : 7;
    std::uint64_t looked_at = 0, inside = 0, holes = 0, outliers = 0;
    double largest = 0;
    for (std::size_t n = 0; n < output.size(); n += stride, ++looked_at) {
      const auto i = static_cast<std::int64_t>(n);
      const glm::i64vec3 voxel = region.begin + glm::i64vec3(i % size.x, i / size.x % size.y, i / (size.x * size.y));
      const glm::dvec3 here = point(glm::dvec3(voxel)), there = inverse(here), source = index(there);
      const glm::dvec3 room = glm::min(source, glm::dvec3(grid.size - std::int64_t{1}) - source);
      if (std::min({room.x, room.y, room.z}) < error) continue;
      ++inside;
      holes += coverage[n] != 1;
      largest = std::max(largest, glm::length(index(here + glm::dvec3(offset_mm[n])) - source));
      const Reference expected = sample_in_double(ct, source);
      const double bound = 0.5 + 1e-3 + 3 * error * (expected.high - expected.low);
      outliers += std::abs(output[n] - expected.value) > bound;
    }
    EXPECT_GT(inside, looked_at / 2);
    EXPECT_LE(largest, error);
    RecordProperty("largest_error_voxels", std::to_string(largest));
    EXPECT_EQ(holes, 0u);
    EXPECT_EQ(outliers, 0u);
  }
};

TEST_P(RealDeformation, WaveTwistAndBubbleAgreeWithTheTrueInverse) {
  TETWARP_REAL_DATA(root, GetParam().set);
  const DicomScan scan = scan_dicom(root / GetParam().folder);
  const Volume<std::int16_t> ct = load_dicom(scan.series.at(0)).volume;
  const glm::dvec3 middle = centre(ct.geometry);

  const Wave wave{.amplitude = 8, .wavelength = 64, .centre = middle};
  const Wave unwave{.amplitude = -8, .wavelength = 64, .centre = middle};
  expect_inverse(
      ct, wave, [&](const glm::dvec3& p) { return p + unwave(p); }, kRounding);

  const double half = half_length(ct.geometry, 2);
  const Twist twist{.angle = 0.5, .half_length = half, .centre = middle};
  const Twist untwist{.angle = -0.5, .half_length = half, .centre = middle};
  expect_inverse(
      ct, twist, [&](const glm::dvec3& p) { return p + untwist(p); }, kRounding);

  // Second order in the cell: h^2 / 8 times the curvature of the map, at most 6 a / R for this profile.
  const Bubble bubble{.radius = std::min(60.0, 0.9 * half), .strength = 0.3, .centre = middle};
  const double cell = std::max({ct.geometry.spacing.x, ct.geometry.spacing.y, ct.geometry.spacing.z});
  const double smallest = std::min({ct.geometry.spacing.x, ct.geometry.spacing.y, ct.geometry.spacing.z});
  const double curvature = cell * cell / 8 * 6 * bubble.strength / bubble.radius;
  expect_inverse(
      ct, bubble, [&](const glm::dvec3& p) { return undo_bubble(bubble, p); }, kRounding + curvature / smallest);
}

INSTANTIATE_TEST_SUITE_P(Series, RealDeformation,
                         testing::Values(RealCt{"overlap-kits-and-topogram", "kits-00072"},
                                         RealCt{"chest-cmb-crc", "dicom"}, RealCt{"abdomen-acrin-flt", "dicom"},
                                         RealCt{"head-phantom-multiseries", "S21570/S2020"}),
                         [](const auto& tested) { return "Set" + std::to_string(tested.index); });

}  // namespace
