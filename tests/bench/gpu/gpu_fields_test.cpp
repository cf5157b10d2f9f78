// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// The fields of `gpu` and its backward warp, which a device and the CPU compute by the same functions.
#include "bench/gpu/gpu_fields.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "bench/gpu/gpu_backward.h"
#include "deform/phantom.h"
#include "deform/resampler.h"

namespace tetwarp::bench {
namespace {

constexpr std::int16_t kBackground = -2000;  // no value of the phantom

VertexField sampled(const TestField& field, const Geometry& volume, std::int64_t cell_size = 1) {
  VertexField vertices{lattice_over(volume, cell_size), {}};
  const glm::i64vec3 size = vertices.lattice.size;
  for (std::int64_t k = 0; k < size.z; ++k) {
    for (std::int64_t j = 0; j < size.y; ++j) {
      for (std::int64_t i = 0; i < size.x; ++i) {
        vertices.displacement.push_back(displacement_at(field, glm::vec3(glm::i64vec3(i, j, k) * cell_size)));
      }
    }
  }
  return vertices;
}

VertexField sampled(const std::string& name, const glm::i64vec3& size, std::int64_t cell_size = 1) {
  return sampled(make_test_field(name, size), {.size = size}, cell_size);
}

/// Largest displacement of each component, without its sign.
glm::vec3 largest_of(const VertexField& field) {
  glm::vec3 largest(0);
  for (const glm::vec3& by : field.displacement) {
    for (int axis = 0; axis < 3; ++axis) largest[axis] = std::max(largest[axis], std::abs(by[axis]));
  }
  return largest;
}

double fraction_at_rest(const VertexField& field) {
  const auto still = std::count(field.displacement.begin(), field.displacement.end(), glm::vec3(0));
  return static_cast<double>(still) / static_cast<double>(field.displacement.size());
}

Volume<std::int16_t> phantom(const glm::i64vec3& size) {
  Volume<std::int16_t> volume = make_phantom(size, {1, 1, 1}, 1);
  volume.geometry = {.size = size};
  return volume;
}

std::uint64_t inverted(const std::string& name, const glm::i64vec3& size, std::int64_t cell_size = 1) {
  Report report;
  const std::unique_ptr<ForwardResampler> resampler = make_cpu_resampler({.size = size});
  resample(*resampler, phantom(size), sampled(name, size, cell_size), &report);
  return report.inverted;
}

TEST(GpuFields, ThePapersFormulasAreAmongThem) {
  for (const std::string name : {"identity", "wave", "twist", "bubble"}) {
    const TestField field = make_test_field(name, {64, 64, 40});
    const glm::vec3 rest(20, 30, 12);
    EXPECT_EQ(displacement_at(field, rest), displacement_at(make_formula(name, {64, 64, 40}), rest)) << name;
  }
  EXPECT_THROW(make_test_field("swirl", {8, 8, 8}), InputError);
}

TEST(GpuFields, ElasticMovesEveryComponentByUpToSixVoxels) {
  const glm::vec3 largest = largest_of(sampled("elastic", {128, 128, 80}, 2));
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_LE(largest[axis], 6.0f);
    EXPECT_GT(largest[axis], 4.5f);
  }
  EXPECT_LE(largest_of(sampled(make_elastic(3), {.size = {128, 128, 80}}, 2)).x, 3.0f);
}

TEST(GpuFields, NoiseIsWhiteAndWithinAFifthOfAVoxel) {
  const VertexField noise = sampled("noise", {32, 32, 32});
  const glm::vec3 largest = largest_of(noise);
  glm::dvec3 mean(0), square(0), with_next(0);
  for (std::size_t n = 0; n + 1 < noise.displacement.size(); ++n) {
    const glm::dvec3 by(noise.displacement[n]), next(noise.displacement[n + 1]);
    mean += by;
    square += by * by;
    with_next += by * next;
  }
  const auto count = static_cast<double>(noise.displacement.size() - 1);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_LE(largest[axis], 0.2f);
    EXPECT_GT(largest[axis], 0.1999f);
    EXPECT_NEAR(mean[axis] / count, 0, 0.003);
    EXPECT_NEAR(square[axis] / count, 0.04 / 3, 0.0003);
    EXPECT_NEAR(with_next[axis] / square[axis], 0, 0.03);
  }
}

TEST(GpuFields, NoiseIsTheSameEverywhere) {
  const TestField noise = make_test_field("noise", {512, 512, 300});
  EXPECT_EQ(detail::mixed(0), 0xE220A8397B1DCDAFu);  // the first number of SplitMix64 from seed 0
  EXPECT_EQ(displacement_at(noise, {0, 0, 0}).x, 0.2f * (static_cast<float>(0xE220A8 - 0x800000) / 0x800000));
  EXPECT_EQ(sampled(noise, {.size = {9, 9, 9}}).displacement[8 * 81 + 4 * 9 + 4],
            sampled(noise, {.size = {9, 9, 9}}, 4).displacement[2 * 9 + 1 * 3 + 1]);
}

TEST(GpuFields, RotationTurnsVoxelsOntoVoxels) {
  const TestField rotation = make_test_field("rotation", {6, 6, 4});
  const glm::vec3 corner = displacement_at(rotation, {0, 0, 3});
  EXPECT_EQ(corner, glm::vec3(5, 0, 0));
  EXPECT_EQ(displacement_at(rotation, {5, 0, 0}), glm::vec3(0, 5, 0));
}

TEST(GpuFields, LocalLeavesNineTenthsAtRest) {
  for (const glm::i64vec3 size : {glm::i64vec3(64, 64, 38), glm::i64vec3(40, 40, 60), glm::i64vec3(24, 24, 12)}) {
    const double at_rest = fraction_at_rest(sampled("local", size));
    EXPECT_GE(at_rest, 0.9) << to_string(size);
    EXPECT_LT(at_rest, 0.96) << to_string(size);
  }
}

TEST(GpuFields, OnlyFoldsTurnsTetrahedraInsideOut) {
  const glm::i64vec3 size(128, 128, 24);
  for (const std::string name : {"identity", "wave", "twist", "bubble", "elastic", "rotation", "local"}) {
    EXPECT_EQ(inverted(name, size), 0u) << name;
  }
  // cos < -1 / (2 pi 16 / 64) holds over 28 % of a wavelength
  EXPECT_GT(inverted("folds", size), static_cast<std::uint64_t>(128 * 128 * 24 * 5 / 5));
  for (const std::int64_t cell_size : {4, 8, 16}) EXPECT_EQ(inverted("elastic", size, cell_size), 0u) << cell_size;
}

TEST(GpuFields, InversesLeadBack) {
  const glm::i64vec3 size(64, 64, 40);
  for (const std::string name : {"identity", "wave", "twist", "rotation"}) {
    const TestField field = make_test_field(name, size);
    const std::optional<TestField> inverse = inverse_of(field);
    ASSERT_TRUE(inverse) << name;
    for (const glm::vec3 rest : {glm::vec3(3, 60, 7), glm::vec3(31, 20, 39), glm::vec3(50, 50, 0)}) {
      const glm::vec3 place = rest + displacement_at(field, rest);
      const glm::vec3 back = place + displacement_at(*inverse, place);
      for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(back[axis], rest[axis], 1e-4) << name;
    }
  }
  for (const std::string name : {"bubble", "elastic", "noise", "folds", "local"}) {
    EXPECT_FALSE(inverse_of(make_test_field(name, size))) << name;
  }
}

TEST(GpuBackward, ClampsHalfAVoxelAndGivesTheBackgroundBeyond) {
  const std::int16_t voxels[] = {0, 100, 200, 300, 1000, 1100, 1200, 1300};
  const PlainVolume volume{voxels, 2, 2, 2};
  EXPECT_EQ(sample_backward(volume, {0, 0, 0}, -5), 0);
  EXPECT_EQ(sample_backward(volume, {1, 1, 1}, -5), 1300);
  EXPECT_EQ(sample_backward(volume, {0.5f, 0.25f, 0.75f}, -5), 850);
  EXPECT_EQ(sample_backward(volume, {-0.5f, 1.5f, 0}, -5), 200);
  EXPECT_EQ(sample_backward(volume, {-0.6f, 0, 0}, -5), -5);
  EXPECT_EQ(sample_backward(volume, {0, 0, 1.6f}, -5), -5);
}

// Fields whose inverse has a closed form are affine within a slice, so the exact inverse and Tetwarp's are the same
// map.
TEST(GpuBackward, GivenTheInverseItIsTetwarpsResult) {
  const glm::i64vec3 size(48, 48, 30);
  const Volume<std::int16_t> volume = phantom(size);
  const PlainVolume plain{volume.voxels.data(), 48, 48, 30};
  for (const std::string name : {"identity", "wave", "twist", "rotation"}) {
    const std::unique_ptr<ForwardResampler> resampler = make_cpu_resampler(volume.geometry);
    Volume<std::int16_t> exact{volume.geometry, std::vector<std::int16_t>(volume.voxels.size())};
    const Target target{.source = view(volume), .output = view(exact), .background = kBackground};
    const VertexField field = sampled(name, size);
    resampler->set_field(view(field));
    resampler->resample(whole(volume.geometry), {&target, 1});
    const TestField inverse = *inverse_of(make_test_field(name, size));
    std::size_t compared = 0;
    for (std::size_t n = 0; n < exact.voxels.size(); ++n) {
      if (exact.voxels[n] == kBackground) continue;
      const glm::vec3 voxel(n % 48, n / 48 % 48, n / (48 * 48));
      const std::int16_t backward =
          sample_backward(plain, deformed_place(voxel, displacement_at(inverse, voxel)), kBackground);
      ASSERT_NEAR(backward, exact.voxels[n], 2) << name << ", voxel " << n;
      ++compared;
    }
    EXPECT_GT(compared, exact.voxels.size() * 3 / 4) << name;
  }
}

}  // namespace
}  // namespace tetwarp::bench
