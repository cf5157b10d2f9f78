// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// `tetwarp deform` on files: what comes out, and that it is the same whichever way the field goes in.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "deform/fields/formula.h"
#include "io/field_file.h"
#include "io/image_file.h"
#include "tests/support/program.h"
#include "tests/support/scratch.h"

namespace {

using namespace tetwarp;

void expect_run(const Scratch& scratch, const std::string& arguments) {
  const Outcome run = run_tetwarp(scratch.path(), arguments);
  ASSERT_EQ(run.status, 0) << arguments << "\n" << run.err;
}

void make_phantom_file(const Scratch& scratch, const std::string& name) {
  expect_run(scratch, "phantom --size 40,36,24 --spacing 3,3,4 --quiet -o " + name);
}

bool same_voxels(const std::filesystem::path& a, const std::filesystem::path& b) {
  const AnyVolume first = read_image(a), second = read_image(b);
  return first.type() == second.type() && first.size_bytes() == second.size_bytes() &&
         std::equal(first.data(), first.data() + first.size_bytes(), second.data());
}

TEST(Deform, IdentityReturnsTheSourceInEveryFormat) {
  const Scratch scratch;
  make_phantom_file(scratch, "in.mha");
  for (const std::string name : {"out.nii", "out.nii.gz", "out.nrrd", "out.mha"}) {
    expect_run(scratch, "deform in.mha -f identity -o " + name);
    EXPECT_TRUE(same_voxels(scratch / "in.mha", scratch / name)) << name;
    EXPECT_TRUE(
        same_grid(read_image_header(scratch / "in.mha").geometry, read_image_header(scratch / name).geometry, 1e-4))
        << name;
  }
}

TEST(Deform, AFormulaAndItsFileGiveTheSameVoxels) {
  const Scratch scratch;
  make_phantom_file(scratch, "in.mha");
  for (const std::string formula :
       {"wave:amplitude=9,wavelength=70", "twist:angle=40", "bubble:radius=50,strength=0.8"}) {
    for (const std::string cell : {"1", "5"}) {
      expect_run(scratch, "deform in.mha -f " + formula + " --cell-size " + cell + " -o a.mha --overwrite");
      for (const std::string file : {"field.mha", "field.nrrd", "field.nii", "field.nii.gz"}) {
        expect_run(scratch, "field " + formula + " --like in.mha --cell-size " + cell + " --overwrite -o " + file);
        expect_run(scratch, "deform in.mha -f " + file + " -o b.mha --overwrite");
        EXPECT_TRUE(same_voxels(scratch / "a.mha", scratch / "b.mha")) << formula << " cell " << cell << " " << file;
      }
    }
  }
}

TEST(Deform, TwoRunsWriteTheSameBytesForAnyNumberOfThreads) {
  const Scratch scratch;
  make_phantom_file(scratch, "in.nii.gz");
  expect_run(scratch, "deform in.nii.gz -f twist:angle=30 -o out.nii.gz --threads 1");
  const std::string volume = read_text(scratch / "out.nii.gz"), sidecar = read_text(scratch / "out.nii.gz.json");
  expect_run(scratch, "deform in.nii.gz -f twist:angle=30 -o out.nii.gz --threads 2 --overwrite");
  EXPECT_EQ(volume, read_text(scratch / "out.nii.gz"));
  EXPECT_EQ(sidecar, read_text(scratch / "out.nii.gz.json"));
  EXPECT_FALSE(volume.empty());
}

TEST(Deform, ComposedFormulasActOneAfterTheOther) {
  const Scratch scratch;
  make_phantom_file(scratch, "in.mha");
  expect_run(scratch, "deform in.mha -f translate:by=3/0/0 -f translate:by=3/-3/8 -o a.mha");
  expect_run(scratch, "deform in.mha -f translate:by=2/-1/2vox -o b.mha");
  EXPECT_TRUE(same_voxels(scratch / "a.mha", scratch / "b.mha"));
  EXPECT_FALSE(same_voxels(scratch / "a.mha", scratch / "in.mha"));
}

TEST(Deform, MapsSayWhereEachVoxelComesFromAndHowTheMapIsThere) {
  const Scratch scratch;
  make_phantom_file(scratch, "in.mha");
  // A forward shift by (6, -3, 8) mm, then one along x that folds: x + 40 sin(2 pi x / 60).
  expect_run(scratch,
             "deform in.mha -f translate:by=6/-3/8 --outside background -o shifted.mha --coverage c.nii.gz --inverse "
             "i.nii.gz --jacobian j.nrrd --folds f.mha");
  const AnyVolume coverage = read_image(scratch / "c.nii.gz"), inverse = read_image(scratch / "i.nii.gz"),
                  jacobian = read_image(scratch / "j.nrrd"), folds = read_image(scratch / "f.mha");
  EXPECT_EQ(inverse.components(), 3);
  std::size_t covered = 0;
  for (std::size_t n = 0; n < coverage.as<std::uint8_t>().size(); ++n) {
    const bool inside = coverage.as<std::uint8_t>()[n] != 0;
    const float* by = inverse.as<float>().data() + 3 * n;
    covered += inside;
    EXPECT_EQ(folds.as<std::uint16_t>()[n], inside);
    EXPECT_EQ(std::isnan(by[0]), !inside);
    EXPECT_EQ(std::isnan(jacobian.as<float>()[n]), !inside);
    if (!inside) continue;
    EXPECT_EQ(jacobian.as<float>()[n], 1.0F);
    EXPECT_EQ(glm::vec3(by[0], by[1], by[2]), glm::vec3(-6, 3, -8));
  }
  EXPECT_EQ(covered, 38U * 35U * 22U);
  EXPECT_TRUE(read_field_header(scratch / "i.nii.gz").direction == Direction::pull);

  expect_run(
      scratch,
      "deform in.mha -f wave:amplitude=40,wavelength=60,along=x --outside background -o folded.mha --folds f.mha "
      "--jacobian j.mha --overwrite");
  const nlohmann::json sidecar = nlohmann::json::parse(read_text(scratch / "folded.mha.json"));
  const AnyVolume owners = read_image(scratch / "f.mha"), determinants = read_image(scratch / "j.mha");
  std::uint64_t several = 0, negative = 0;
  for (const std::uint16_t count : owners.as<std::uint16_t>()) several += count > 1;
  for (const float determinant : determinants.as<float>()) negative += determinant < 0;
  EXPECT_GT(several, 0U);
  EXPECT_GT(negative, 0U);
  EXPECT_EQ(sidecar["report"]["multiply_owned"], several);
  EXPECT_EQ(sidecar["maps"]["folds"], "f.mha");
}

TEST(Deform, MapsOfTetrahedraAreRefusedForAPullField) {
  const Scratch scratch;
  make_phantom_file(scratch, "in.mha");
  for (const std::string map : {"--jacobian", "--folds"}) {
    const Outcome run = run_tetwarp(scratch.path(), "deform in.mha --pull-field in.mha -o out.mha " + map + " m.mha");
    EXPECT_EQ(run.status, 2);
    EXPECT_NE(run.err.find(map), std::string::npos) << run.err;
    EXPECT_FALSE(std::filesystem::exists(scratch / "m.mha"));
  }
  EXPECT_EQ(run_tetwarp(scratch.path(), "deform in.mha -f identity -o out.mha --inverse i.txt").status, 2);
}

TEST(Deform, APullFieldIsNeverTakenForAForwardOne) {
  const Scratch scratch;
  make_phantom_file(scratch, "in.mha");
  const Geometry grid = read_image_header(scratch / "in.mha").geometry;
  const VertexField shift = sample_on(grid, parse_formula("translate:by=2/0/0vox", grid));
  write_field_file(scratch / "pull.mha", PullField{shift.lattice, shift.displacement});
  write_field_file(scratch / "forward.mha", shift);
  expect_run(scratch, "deform in.mha --pull-field pull.mha -o a.mha --outside background");
  expect_run(scratch, "deform in.mha -f translate:by=-2/0/0vox -o b.mha");
  EXPECT_TRUE(same_voxels(scratch / "a.mha", scratch / "b.mha"));
  EXPECT_EQ(run_tetwarp(scratch.path(), "deform in.mha -f pull.mha -o c.mha").status, 4);
  EXPECT_EQ(run_tetwarp(scratch.path(), "deform in.mha --pull-field forward.mha -o c.mha").status, 4);
  EXPECT_FALSE(std::filesystem::exists(scratch / "c.mha"));
}

TEST(Deform, AnInverseWithGapsDeformsAsTheFieldItIsOf) {
  const Scratch scratch;
  make_phantom_file(scratch, "in.mha");
  for (const std::string name : {"inverse.mha", "inverse.nrrd", "inverse.nii.gz"}) {
    expect_run(scratch,
               "deform in.mha -f twist:angle=25 -f translate:by=7/-4/9 -o a.mha --background -1500 --coverage a_c.mha "
               "--overwrite --inverse " +
                   name);
    expect_run(scratch, "deform in.mha --pull-field " + name +
                            " -o b.mha --background -1500 --coverage b_c.mha --inverse b_i.mha --overwrite");
    EXPECT_TRUE(same_voxels(scratch / "a_c.mha", scratch / "b_c.mha")) << name;
    const AnyVolume a = read_image(scratch / "a.mha"), b = read_image(scratch / "b.mha");
    const AnyVolume covered = read_image(scratch / "a_c.mha"), again = read_image(scratch / "b_i.mha");
    std::uint64_t uncovered = 0;
    for (std::size_t n = 0; n < a.as<std::int16_t>().size(); ++n) {
      // 2^-13 voxel an axis of up to 3000 HU a voxel.
      ASSERT_NEAR(a.as<std::int16_t>()[n], b.as<std::int16_t>()[n], 2) << name << " " << n;
      ASSERT_EQ(std::isnan(again.as<float>()[3 * n]), covered.as<std::uint8_t>()[n] == 0) << name << " " << n;
      if (covered.as<std::uint8_t>()[n] != 0) continue;
      ++uncovered;
      ASSERT_EQ(b.as<std::int16_t>()[n], -1500) << name << " " << n;
    }
    EXPECT_GT(uncovered, 2000U);
    EXPECT_EQ(nlohmann::json::parse(read_text(scratch / "b.mha.json"))["report"]["uncovered"], uncovered);
  }
  expect_run(scratch, "invert twist:angle=25 --like in.mha -o whole.mha");
  expect_run(scratch, "deform in.mha --pull-field whole.mha -o c.mha");
  // A forward field has no gaps, and none may be infinite.
  const AnyVolume gaps = read_image(scratch / "inverse.mha");
  const std::vector<glm::vec3> vectors(static_cast<std::size_t>(voxel_count(gaps.geometry())), glm::vec3(NAN));
  write_field_file(scratch / "forward.mha", VertexField{gaps.geometry(), vectors});
  EXPECT_EQ(run_tetwarp(scratch.path(), "deform in.mha -f forward.mha -o d.mha").status, 4);
  const std::vector<glm::vec3> infinite(vectors.size(), glm::vec3(INFINITY, 0, 0));
  write_field_file(scratch / "infinite.mha", PullField{gaps.geometry(), infinite});
  EXPECT_EQ(run_tetwarp(scratch.path(), "deform in.mha --pull-field infinite.mha -o d.mha").status, 4);
  EXPECT_FALSE(std::filesystem::exists(scratch / "d.mha"));
}

TEST(Deform, TheReportTellsWhatHappenedAndTheSidecarHasNoClock) {
  const Scratch scratch;
  make_phantom_file(scratch, "in.mha");
  expect_run(scratch,
             "deform in.mha -f translate:by=2/0/0vox -o out.mha --coverage mask.nii.gz --report report.json --preview "
             "look.png --backend cpu");
  const auto report = nlohmann::json::parse(read_text(scratch / "report.json"));
  EXPECT_EQ(report["report"]["covered"], 38 * 36 * 24);
  EXPECT_EQ(report["report"]["uncovered"], 2 * 36 * 24);
  EXPECT_EQ(report["backend"], "cpu");
  EXPECT_EQ(report["paths"]["gathered"], 40 * 36 * 24);
  EXPECT_EQ(report["paths"]["claimed"], 0);
  for (const std::string stage : {"read", "field", "resample", "write"})
    EXPECT_GE(report["stages"][stage]["seconds"], 0.0) << stage;
  EXPECT_GT(report["memory"]["peak_bytes"], report["memory"]["source_bytes"]);
  const auto sidecar = nlohmann::json::parse(read_text(scratch / "out.mha.json"));
  EXPECT_FALSE(sidecar.contains("stages"));
  EXPECT_FALSE(sidecar.contains("paths"));
  EXPECT_EQ(sidecar["field"]["sha256"].get<std::string>().size(), 64u);
  const AnyVolume mask = read_image(scratch / "mask.nii.gz");
  EXPECT_EQ(std::count(mask.as<std::uint8_t>().begin(), mask.as<std::uint8_t>().end(), 1), 38 * 36 * 24);
  EXPECT_EQ(read_text(scratch / "look.png").substr(1, 3), "PNG");
}

/// What --report says of a field's quality. The volume has so many slices that only some of them are looked at.
nlohmann::json quality_of(const Scratch& scratch, const std::string& options) {
  expect_run(scratch, "deform in.mha -o out.mha --report report.json --overwrite " + options);
  return nlohmann::json::parse(read_text(scratch / "report.json"))["quality"];
}

TEST(Deform, TheReportTellsWhatIsLeftAfterGoingThereAndBack) {
  const Scratch scratch;
  make_phantom_file(scratch, "in.mha");
  const nlohmann::json twist = quality_of(scratch, "-f twist:angle=30 --threads 1"), trip = twist["round_trip"];
  EXPECT_EQ(trip["slices"], 16);
  EXPECT_EQ(trip["voxels"], 16 * 40 * 36);
  EXPECT_GT(trip["forward_after_inverse"]["points"], 10000);
  EXPECT_LT(trip["forward_after_inverse"]["largest_mm"], 1e-4);
  EXPECT_GT(trip["inverse_after_forward"]["points"], 5000);
  EXPECT_GT(trip["inverse_after_forward"]["largest_mm"], trip["forward_after_inverse"]["largest_mm"]);
  EXPECT_LT(trip["inverse_after_forward"]["largest_mm"], 5e-3);
  const std::string verdict = twist["verdict"];
  EXPECT_TRUE(verdict.starts_with("No tetrahedron folds; ")) << verdict;
  EXPECT_NE(verdict.find("; a vertex sent there and back by the inverse ends at most 0.00"), std::string::npos)
      << verdict;
  EXPECT_EQ(quality_of(scratch, "-f twist:angle=30 --threads 2"), twist);
  // Part of the whole inverse, which `invert` looks at.
  expect_run(scratch, "invert twist:angle=30 --like in.mha -o inverse.mha --report inverse.json");
  const auto whole = nlohmann::json::parse(read_text(scratch / "inverse.json"));
  for (const std::string way : {"forward_after_inverse", "inverse_after_forward"}) {
    EXPECT_LT(trip[way]["points"], whole[way]["points"]);
    EXPECT_LE(trip[way]["largest_mm"], whole[way]["largest_mm"]);
    EXPECT_NEAR(trip[way]["mean_mm"].get<double>() / whole[way]["mean_mm"].get<double>(), 1, 0.3) << way;
  }
  // Where it folds, what comes back is another place.
  const nlohmann::json fold = quality_of(scratch, "-f wave:amplitude=40,wavelength=60,along=x --outside background");
  EXPECT_GT(fold["round_trip"]["inverse_after_forward"]["largest_mm"], 10);
  EXPECT_TRUE(fold["verdict"].get<std::string>().starts_with("Do not trust it where it folds: "));
}

TEST(Deform, AFieldThatDoesNotCoverTheVolumeIsRefusedUnlessAskedFor) {
  const Scratch scratch;
  make_phantom_file(scratch, "in.mha");
  expect_run(scratch, "phantom --size 20,36,24 --spacing 3,3,4 --quiet -o half.mha");
  expect_run(scratch, "field identity --like half.mha -o field.mha");
  EXPECT_EQ(run_tetwarp(scratch.path(), "deform in.mha -f field.mha -o out.mha").status, 4);
  expect_run(scratch, "deform in.mha -f field.mha -o out.mha --outside rest");
  EXPECT_TRUE(same_voxels(scratch / "in.mha", scratch / "out.mha"));
  expect_run(scratch, "deform in.mha -f field.mha -o out.mha --outside background --background 7 --overwrite");
  EXPECT_EQ(read_image(scratch / "out.mha").as<std::int16_t>()[0], 7);
}

}  // namespace
