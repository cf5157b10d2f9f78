// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Maps of `tetwarp deform` and `tetwarp invert` go to their files slab by slab: what is held does not grow with the
// slices, and the files are those of the whole maps.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "deform/fields/formula.h"
#include "deform/mass.h"
#include "io/image_file.h"
#include "tests/support/program.h"
#include "tests/support/scratch.h"

namespace {

using namespace tetwarp;

#ifdef __SANITIZE_ADDRESS__
constexpr bool kCountsMemory = false;
#else
constexpr bool kCountsMemory = true;
#endif

Outcome expect_run(const Scratch& scratch, const std::string& arguments) {
  Outcome run = run_tetwarp(scratch.path(), arguments);
  EXPECT_EQ(run.status, 0) << arguments << "\n" << run.err;
  return run;
}

nlohmann::json read_json(const std::filesystem::path& path) { return nlohmann::json::parse(read_text(path)); }

bool same_voxels(const std::filesystem::path& path, const std::byte* expected, std::size_t bytes) {
  const AnyVolume found = read_image(path);
  return found.size_bytes() == bytes && std::equal(expected, expected + bytes, found.data());
}

bool same_voxels(const std::filesystem::path& path, const AnyVolume& expected) {
  return same_voxels(path, expected.data(), expected.size_bytes());
}

/// 2048 slices of 128 x 128 zeros: four slabs. Made here and freed, for a small process.
constexpr std::uint64_t kSlice = 128 * 128, kSlices = 2048, kTwoSlabs = 2 * 512;
void make_long_volume(const Scratch& scratch) {
  const Geometry grid{.size = {128, 128, kSlices}};
  const Volume<std::uint8_t> volume{grid, std::vector<std::uint8_t>(kSlice * kSlices)};
  write_image(scratch / "in.nii.gz", view(volume));
}

TEST(MapStream, DeformHoldsTwoSlabsOfItsMapsAndPlansThem) {
  if (!kCountsMemory) GTEST_SKIP() << "a sanitizer takes memory of its own";
  const Scratch scratch;
  make_long_volume(scratch);
  const std::string deform =
      "deform in.nii.gz -f translate:by=1/0/0 --outside background --cell-size 64 --overwrite --backend cpu ";
  expect_run(scratch, deform + "-o plain.nii.gz --report plain.json");
  expect_run(scratch, deform + "-o out.nii.gz --inverse i.nii.gz --coverage c.nii.gz --report maps.json");
  const nlohmann::json plain = read_json(scratch / "plain.json")["memory"],
                       maps = read_json(scratch / "maps.json")["memory"];
  constexpr std::uint64_t kHeld = kTwoSlabs * kSlice * (12 + 1), kWhole = kSlices * kSlice * (12 + 1);
  EXPECT_EQ(maps["planned_bytes"].get<std::uint64_t>(), plain["planned_bytes"].get<std::uint64_t>() + kHeld);
  EXPECT_LT(maps["peak_bytes"], maps["planned_bytes"]);
  EXPECT_LT(maps["peak_bytes"].get<std::uint64_t>(), plain["peak_bytes"].get<std::uint64_t>() + (kHeld + kWhole) / 2);
}

TEST(MapStream, InvertHoldsTwoSlabsOfTheInverse) {
  if (!kCountsMemory) GTEST_SKIP() << "a sanitizer takes memory of its own";
  const Scratch scratch;
  make_long_volume(scratch);
  expect_run(scratch,
             "invert translate:by=0/0/0.25 --cell-size 64 --like in.nii.gz -o i.nii.gz --report report.json --backend "
             "cpu --threads 2");
  const nlohmann::json report = read_json(scratch / "report.json");
  constexpr std::uint64_t kHeld = kTwoSlabs * kSlice * 12, kWhole = kSlices * kSlice * 12;
  EXPECT_LT(report["memory"]["peak_bytes"], (kHeld + kWhole) / 2);
  // All of it is checked, across the ends of slabs too: the last slice of samples leads out of the lattice, or has
  // none.
  EXPECT_GE(report["forward_after_inverse"]["points"], kSlice * (kSlices - 2));
  EXPECT_EQ(report["inverse_after_forward"]["largest_mm"], 0);
}

TEST(MapStream, MapsInSlabsAreThoseOfOneCall) {
  const Scratch scratch;
  expect_run(scratch, "phantom --size 512,512,40 --spacing 0.8,0.8,3 --quiet -o in.nrrd");  // two slabs
  const AnyVolume source = read_image(scratch / "in.nrrd");
  const Geometry& grid = source.geometry();
  const std::string formula = "wave:amplitude=9,wavelength=70,axis=z,along=x";
  const VertexField field = sample_on(lattice_over(grid, 8), parse_formula(formula, grid));
  AnyVolume hu(grid, VoxelType::f32), output(grid, VoxelType::i16), coverage(grid, VoxelType::u8),
      jacobian(grid, VoxelType::f32), owners(grid, VoxelType::u16), inverse(grid, VoxelType::f32, 3),
      values(grid, VoxelType::f32);
  std::copy_n(source.as<std::int16_t>().data(), voxel_count(grid), values.as<float>().data());
  const auto resampler = make_cpu_resampler(grid);
  resampler->set_field(view(field, Outside::background));
  const Target target{.source = std::as_const(values).view(), .output = hu.view(), .background = 250};
  const Maps maps{
      .coverage = coverage.view(), .inverse_mm = inverse.view(), .jacobian = jacobian.view(), .owners = owners.view()};
  const Report report = resampler->resample(whole(grid), {&target, 1}, maps);
  ASSERT_GT(report.uncovered, 1000U);
  preserve_mass(std::as_const(hu).view(), maps, {}, output.view(), whole(grid));
  for (std::size_t n = 0; n < coverage.as<std::uint8_t>().size(); ++n) {
    if (coverage.as<std::uint8_t>()[n] != 0) continue;
    ASSERT_EQ(output.as<std::int16_t>()[n], 250) << n;
  }
  const std::string deform =
      "deform in.nrrd -f " + formula + " --cell-size 8 --outside background --background 250 --overwrite";
  expect_run(scratch, deform + " --preserve mass -o mass.nrrd");
  EXPECT_TRUE(same_voxels(scratch / "mass.nrrd", output));
  expect_run(scratch, deform +
                          " --preserve mass -o mass.nrrd --coverage c.nii --inverse i.nii.gz --jacobian j.mha "
                          "--folds f.nrrd");
  EXPECT_TRUE(same_voxels(scratch / "mass.nrrd", output));
  EXPECT_TRUE(same_voxels(scratch / "c.nii", coverage));
  EXPECT_TRUE(same_voxels(scratch / "i.nii.gz", inverse));
  EXPECT_TRUE(same_voxels(scratch / "j.mha", jacobian));
  EXPECT_TRUE(same_voxels(scratch / "f.nrrd", owners));
  expect_run(scratch, "invert " + formula + " --cell-size 8 --like in.nrrd -o inverse.nii.gz");
  EXPECT_TRUE(same_voxels(scratch / "inverse.nii.gz", inverse));
  // The cut sources and the sums of the report, through a pull field and its own maps.
  expect_run(scratch, "deform in.nrrd --pull-field i.nii.gz -o a.mha");
  expect_run(scratch, "deform in.nrrd --pull-field i.nii.gz -o b.mha --coverage c.nii --overwrite");
  EXPECT_TRUE(same_voxels(scratch / "b.mha", read_image(scratch / "a.mha")));
  EXPECT_EQ(read_json(scratch / "a.mha.json")["report"], read_json(scratch / "b.mha.json")["report"]);
}

TEST(MapStream, AFullDiskNamesTheMapAndLeavesNothing) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full on this machine";
  const Scratch scratch;
  expect_run(scratch, "phantom --size 40,36,24 --spacing 3,3,4 --quiet -o in.mha");
  const auto expect_full = [&](const std::string& arguments, const std::string& name) {
    // A file size limit stands in for a full disk: 10 kB.
    const std::string limited = "sh -c 'trap \"\" XFSZ; ulimit -f 20; exec \"" TETWARP_PROGRAM "\" " + arguments + "'";
    const int status =
        std::system(("cd '" + scratch.path().string() + "' && " + limited + " > .stdout 2> .stderr").c_str());
    EXPECT_EQ(WEXITSTATUS(status), 1) << arguments;
    const std::string said = read_text(scratch / ".stderr");
    EXPECT_NE(said.find(", " + name + ";"), std::string::npos) << said;
    EXPECT_NE(said.find("nothing was written"), std::string::npos) << said;
    EXPECT_EQ(said.find("partial"), std::string::npos) << said;
    for (const auto& entry : std::filesystem::directory_iterator(scratch.path())) {
      const std::string left = entry.path().filename().string();
      EXPECT_TRUE(left == "in.mha" || left == ".stdout" || left == ".stderr") << left;
    }
  };
  for (const std::string name : {"i.mha", "i.nrrd", "i.nii", "i.nii.gz"}) {
    expect_full("deform in.mha -f twist:angle=30 -o out.mha --inverse " + name, name);
    expect_full("invert twist:angle=30 --like in.mha -o " + name, name);
  }
  expect_full("deform in.mha -f twist:angle=30 -o out.mha --jacobian j.nii.gz", "j.nii.gz");
}

}  // namespace
