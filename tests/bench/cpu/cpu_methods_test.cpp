// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// What `cpu` measures beside Tetwarp does the same work: only then are times to be compared.
#include "bench/cpu/cpu.h"

#include <gtest/gtest.h>

#include "bench/peers/peers.h"
#include "deform/phantom.h"

namespace tetwarp::bench {
namespace {

constexpr Beside kEverything{
    .bytes = true, .paper = true, .itk_warp = true, .itk_invert_and_warp = true, .vtk_probe = true};

Volume<std::int16_t> make_volume() {
  Volume<std::int16_t> volume = make_phantom({48, 40, 24}, {1, 1, 1}, 1);
  volume.geometry = {.size = volume.geometry.size};
  return volume;
}

Json measure(const std::string& field, const Beside& beside, std::int64_t cell_size = 1) {
  return measure_run(make_volume(), {field, cell_size}, beside, 2, 2);
}

TEST(CpuMethods, OnIdentityEverybodyReturnsTheSource) {
  const Json run = measure("identity", kEverything);
  EXPECT_EQ(run["at_rest"], 1);
  EXPECT_EQ(run["covered"], 48u * 40 * 24);
  EXPECT_EQ(run["paper"]["differing"], 0);
  for (const char* peer : {"itk_warp", "itk_invert_and_warp", "vtk_probe"}) {
    if (!run[peer].is_null()) {
      EXPECT_EQ(run[peer]["differing"], 0) << peer;
    }
  }
}

TEST(CpuMethods, ThePapersMethodAgreesOnEveryFieldAndLattice) {
  for (const std::string field : {"wave", "twist", "bubble", "elastic", "local"}) {
    EXPECT_LT(measure(field, {.paper = true})["paper"]["differing"], 2e-4) << field;
  }
  EXPECT_LT(measure("elastic", {.paper = true}, 4)["paper"]["differing"], 2e-4);
}

TEST(CpuMethods, ItksWarpAgreesWhereItIsGivenOurInverse) {
  if (!itk_version()) GTEST_SKIP() << "ITK is not in this build";
  for (const std::string field : {"wave", "twist", "bubble", "elastic"}) {
    const Json run = measure(field, {.itk_warp = true});
    EXPECT_LT(run["itk_warp"]["differing"], 1e-4) << field;
  }
}

TEST(CpuMethods, ItksInverterAgreesAwayFromTheBorder) {
  if (!itk_version()) GTEST_SKIP() << "ITK is not in this build";
  EXPECT_LT(measure("bubble", {.itk_invert_and_warp = true})["itk_invert_and_warp"]["differing"], 0.05);
  EXPECT_GT(measure("elastic", {.itk_invert_and_warp = true})["itk_invert_and_warp"]["differing"], 0)
      << "it holds the border, which this field moves";
}

TEST(CpuMethods, VtksProbeOfTheDeformedGridAgrees) {
  if (!vtk_version()) GTEST_SKIP() << "VTK is not in this build";
  EXPECT_LT(measure("wave", {.vtk_probe = true})["vtk_probe"]["differing"], 1e-3);
}

TEST(CpuMethods, SlowPeersRunOnceAndTheOthersAsOftenAsAsked) {
  const Json run = measure("wave", kEverything);
  EXPECT_EQ(run["new_field_ms"]["frames"], 2);
  EXPECT_EQ(run["paper"]["ms"]["frames"], 2);
  EXPECT_EQ(run["bytes_ms"]["frames"], 2);
  if (!run["itk_warp"].is_null()) {
    EXPECT_EQ(run["itk_warp"]["ms"]["frames"], 2);
  }
  for (const char* slow : {"itk_invert_and_warp", "vtk_probe"}) {
    if (!run[slow].is_null()) {
      EXPECT_EQ(run[slow]["ms"]["frames"], 1) << slow;
    }
  }
}

TEST(CpuMethods, WhatIsNotAskedForIsNotRun) {
  const Json run = measure("wave", {});
  for (const char* name : {"bytes_ms", "paper", "itk_warp", "itk_invert_and_warp", "vtk_probe"})
    EXPECT_TRUE(run[name].is_null()) << name;
}

TEST(CpuMethods, ALocalFieldRestsNearlyEverywhere) {
  const Json run = measure("local", {});
  EXPECT_GT(run["at_rest"], 0.9);
  EXPECT_LT(run["at_rest"], 1);
}

TEST(CpuMethods, TheFieldOfALongerVolumeIsLaidOnTheMiddle) {
  const auto covered = [](const std::string& field, std::int64_t slices) {
    return measure_run(make_volume(), {.name = field, .like = glm::i64vec3(48, 40, slices)}, {}, 2, 1)["covered"];
  };
  EXPECT_EQ(covered("twist", 24), measure("twist", {})["covered"]);
  EXPECT_EQ(covered("bubble", 240), measure("bubble", {})["covered"]) << "its shape does not depend on the slices";
  EXPECT_GT(covered("twist", 240), covered("twist", 24)) << "a tenth of the angle turns less out of the volume";
}

TEST(CpuMethods, MovingBytesWritesEveryVoxelAndReadsEveryVertex) {
  Volume<std::int16_t> volume = make_phantom({37, 31, 29}, {1, 1, 1}, 1);
  VertexField field{lattice_over(volume.geometry, 1), {}};
  field.displacement.resize(volume.voxels.size());
  std::vector<std::int16_t> output(volume.voxels.size());
  EXPECT_EQ(move_bytes(volume, field, output), 0u);
  EXPECT_EQ(output, volume.voxels);
  for (std::size_t n = 0; n < field.displacement.size(); n += 1009) {
    field.displacement[n].z = 1;
    EXPECT_NE(move_bytes(volume, field, output), 0u) << n;
    field.displacement[n].z = 0;
  }
  field.displacement.back().z = 1;
  EXPECT_NE(move_bytes(volume, field, output), 0u);
  output.pop_back();
  EXPECT_THROW(move_bytes(volume, field, output), InputError);
}

TEST(CpuMethods, ScalingIsOfOneThreadAndAll) {
  const Json scaling = measure_scaling(make_volume(), "wave", 2, 2);
  EXPECT_EQ(scaling["threads"], 2);
  const double one = *number(scaling, "/one/new_field_ms"), all = *number(scaling, "/all/new_field_ms");
  EXPECT_GT(one, 0);
  EXPECT_NEAR(*number(scaling, "/efficiency"), one / (2 * all), 1e-12);
}

}  // namespace
}  // namespace tetwarp::bench
