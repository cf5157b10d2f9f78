// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/harness/input.h"

#include <gtest/gtest.h>

#include <fstream>

#include "io/image_file.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"

namespace tetwarp::bench {
namespace {

InputOptions raw_input(const std::filesystem::path& path, const std::vector<std::int16_t>& voxels,
                       const std::vector<std::int64_t>& size) {
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(voxels.data()), static_cast<std::streamsize>(2 * voxels.size()));
  InputOptions options;
  options.raw = path;
  options.size = size;
  return options;
}

std::string refusal(const InputOptions& options) {
  try {
    read_input(options, 0);
  } catch (const InputError& error) {
    return error.what();
  }
  return "not refused";
}

TEST(BenchInput, AVolumeOfZerosIsRefused) {
  const Scratch scratch;
  EXPECT_TRUE(says(refusal(raw_input(scratch / "zeros.raw", std::vector<std::int16_t>(24), {4, 3, 2})), {"zeros"}));
}

TEST(BenchInput, AConstantVolumeIsRefused) {
  const Scratch scratch;
  const InputOptions options = raw_input(scratch / "air.raw", std::vector<std::int16_t>(24, -1024), {4, 3, 2});
  EXPECT_TRUE(says(refusal(options), {"-1024", "constant"}));
}

TEST(BenchInput, RawVoxelsAreReadAsTheyLie) {
  const Scratch scratch;
  std::vector<std::int16_t> voxels;
  for (int n = 0; n < 24; ++n) voxels.push_back(static_cast<std::int16_t>(n * 1000 - 12000));
  const Volume<std::int16_t> volume = read_input(raw_input(scratch / "some.raw", voxels, {4, 3, 2}), 0);
  EXPECT_EQ(volume.geometry, (Geometry{.size = {4, 3, 2}}));
  EXPECT_EQ(volume.voxels, voxels);
}

TEST(BenchInput, ARawFileOfAnotherSizeIsRefusedWithBothSizes) {
  const Scratch scratch;
  const InputOptions options = raw_input(scratch / "short.raw", std::vector<std::int16_t>(23, 1), {4, 3, 2});
  EXPECT_TRUE(says(refusal(options), {"short.raw", "48", "46", "--size"}));
}

TEST(BenchInput, OnlyInt16IsTaken) {
  const Scratch scratch;
  const Geometry grid{.size = {4, 3, 2}};
  Volume<float> volume{grid, std::vector<float>(24)};
  volume.voxels[5] = 7;
  write_image(scratch / "float.mha", view(volume));
  InputOptions options;
  options.path = scratch / "float.mha";
  EXPECT_TRUE(says(refusal(options), {"int16", "float32", "float.mha"}));
}

TEST(BenchInput, AnImagesOwnSpacingIsTakenAsOne) {
  const Scratch scratch;
  const Geometry grid{.size = {4, 3, 2}, .spacing = {0.5, 0.7, 3}, .origin = {1, 2, 3}};
  Volume<std::int16_t> volume{grid, std::vector<std::int16_t>(24, -5)};
  volume.voxels[7] = 9;
  write_image(scratch / "image.mha", view(volume));
  InputOptions options;
  options.path = scratch / "image.mha";
  const Volume<std::int16_t> found = read_input(options, 0);
  EXPECT_EQ(found.geometry, (Geometry{.size = {4, 3, 2}}));
  EXPECT_EQ(found.voxels, volume.voxels);
  EXPECT_EQ(input_kind(options), "image");
}

TEST(BenchInput, ThePhantomHasTheSizeAskedFor) {
  InputOptions options;
  options.width = 20;
  EXPECT_EQ(read_input(options, 7).geometry, (Geometry{.size = {20, 20, 7}}));
  EXPECT_EQ(input_kind(options), "phantom");
}

TEST(BenchInput, AFolderWithoutDicomIsRefused) {
  const Scratch scratch;
  InputOptions options;
  options.path = scratch.path();
  EXPECT_THROW(read_input(options, 0), Error);  // NotCompiled in a build without DCMTK
}

}  // namespace
}  // namespace tetwarp::bench
