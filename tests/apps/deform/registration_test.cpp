// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// `--inverse FILE.dcm` of `deform`, and `invert -o FILE.dcm`: a Deformable Spatial Registration beside a series.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "io/dicom_series.h"
#include "io/field_file.h"
#include "io/image_file.h"
#include "tests/support/program.h"
#include "tests/support/real_data.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"

namespace {

using namespace tetwarp;

void expect_run(const Scratch& scratch, const std::string& arguments) {
  const Outcome run = run_tetwarp(scratch.path(), arguments);
  ASSERT_EQ(run.status, 0) << arguments << "\n" << run.err;
}

void make_phantom(const Scratch& scratch) {
  expect_run(scratch, "phantom --size 40,36,24 --spacing 3,3,4 --quiet -o in");
}

std::vector<std::int16_t> voxels_of(const std::filesystem::path& folder) {
  return load_dicom(scan_dicom(folder).series.at(0)).volume.voxels;
}

/// Voxels that differ, and by how much at most, between what the field makes and what its object does.
struct Difference {
  std::size_t voxels = 0;
  int largest = 0;
};
Difference difference(const std::vector<std::int16_t>& a, const std::vector<std::int16_t>& b) {
  Difference found;
  EXPECT_EQ(a.size(), b.size());
  for (std::size_t n = 0; n < std::min(a.size(), b.size()); ++n) {
    const int off = std::abs(a[n] - b[n]);
    found.voxels += off > 0;
    found.largest = std::max(found.largest, off);
  }
  return found;
}

/// Expects that another program finds no fault in an object; the test is skipped where the program is missing.
void expect_check(const Scratch& scratch, const std::string& program, const std::string& arguments) {
  const Outcome run = run_program(scratch.path(), program, arguments);
  if (run.status == 77) GTEST_SKIP() << run.out;
  EXPECT_EQ(run.status, 0) << run.out << run.err;
}

constexpr const char* kTwist = "-f twist:angle=25 --cell-size 4 --outside background";

TEST(RegistrationObject, DeformsAsTheFieldThatItIsOf) {
  const Scratch scratch;
  make_phantom(scratch);
  expect_run(scratch, std::string("deform in ") + kTwist + " -o out --inverse reg.dcm");
  expect_run(scratch, "deform in --pull-field reg.dcm -o back");
  const Difference off = difference(voxels_of(scratch / "out"), voxels_of(scratch / "back"));
  EXPECT_LE(off.largest, 1);  // HU: a rounding that went the other way
  EXPECT_LT(off.voxels, 40 * 36 * 24 / 100U);
  // Voxels without a source are known to both, or some would differ by far more.
  const PullField object = read_pull_field(scratch / "reg.dcm");
  const auto empty = static_cast<std::uint64_t>(std::count_if(object.displacement.begin(), object.displacement.end(),
                                                              [](const glm::vec3& d) { return std::isnan(d.x); }));
  const auto uncovered = nlohmann::json::parse(read_text(scratch / "out.json"))["report"]["uncovered"];
  EXPECT_GT(empty, 0U);
  EXPECT_GE(uncovered, empty);  // and those whose source lies beyond INPUT
  EXPECT_EQ(nlohmann::json::parse(read_text(scratch / "back.json"))["report"]["uncovered"], uncovered);
}

TEST(RegistrationObject, IsReadByPydicomWithAllThatItNames) {
  const Scratch scratch;
  make_phantom(scratch);
  expect_run(scratch, std::string("deform in ") + kTwist + " -o out.mha --inverse inverse.mha");
  expect_run(scratch, std::string("deform in ") + kTwist + " -o out --inverse reg.dcm");
  expect_check(scratch, TETWARP_PYTHON, TETWARP_CHECK_REGISTRATION " reg.dcm in out inverse.mha");
}

TEST(RegistrationObject, HasNoErrorByDciodvfy) {
  const Scratch scratch;
  make_phantom(scratch);
  if (run_program(scratch.path(), "sh", "-c 'command -v dciodvfy'").status != 0)
    GTEST_SKIP() << "dciodvfy (dicom3tools) is not installed";
  expect_run(scratch, std::string("deform in ") + kTwist + " -o out --inverse reg.dcm");
  expect_run(scratch, "invert twist:angle=25 --like in -o inverse.dcm");
  for (const char* name : {"reg.dcm", "inverse.dcm"}) {
    const std::string said = run_program(scratch.path(), "dciodvfy", name).err;
    EXPECT_TRUE(says(said, {"DeformableSpatialRegistration"}));
    EXPECT_EQ(said.find("Error"), std::string::npos) << said;
  }
}

TEST(RegistrationObject, IsTheSameOnEveryRun) {
  const Scratch scratch;
  make_phantom(scratch);
  expect_run(scratch, std::string("deform in ") + kTwist + " -o a --inverse a.dcm --threads 1");
  expect_run(scratch, std::string("deform in ") + kTwist + " -o b --inverse b.dcm --threads 2");
  EXPECT_TRUE(read_text(scratch / "a.dcm") == read_text(scratch / "b.dcm"));
}

TEST(RegistrationObject, OfInvertIsInTheFrameThatDeformGives) {
  const Scratch scratch;
  make_phantom(scratch);
  expect_run(scratch, std::string("deform in ") + kTwist + " -o out --inverse reg.dcm");
  expect_run(scratch, "invert twist:angle=25 --cell-size 4 --like in -o alone.dcm");
  expect_run(scratch, "invert twist:angle=25 --cell-size 4 --like in -o inverse.mha");
  const PullField beside = read_pull_field(scratch / "reg.dcm"), alone = read_pull_field(scratch / "alone.dcm");
  EXPECT_EQ(beside.grid, alone.grid);
  const std::string frame = scan_dicom(scratch / "out").series.at(0).frame_of_reference_uid;
  EXPECT_NE(read_text(scratch / "alone.dcm").find(frame), std::string::npos);
  expect_check(scratch, TETWARP_PYTHON, TETWARP_CHECK_REGISTRATION " alone.dcm in - inverse.mha");
}

TEST(RegistrationObject, IsForADicomSeries) {
  const Scratch scratch;
  make_phantom(scratch);
  expect_run(scratch, "phantom --size 20,18,12 --quiet -o in.mha");
  const auto expect_refused = [&](const std::string& arguments, const std::vector<std::string>& words) {
    const Outcome run = run_tetwarp(scratch.path(), arguments);
    EXPECT_EQ(run.status, 2) << arguments;
    for (const std::string& word : words) EXPECT_NE(run.err.find(word), std::string::npos) << run.err;
  };
  expect_refused("deform in -f identity -o out.nii --inverse reg.dcm", {"reg.dcm", "name OUTPUT as a folder"});
  expect_refused("deform missing -f identity -o out.nii --inverse reg.dcm", {"reg.dcm", "name OUTPUT as a folder"});
  expect_refused("deform in -f identity -o out --jacobian j.dcm", {"--jacobian", "j.dcm"});
  expect_refused("deform in -f identity -o out --inverse out/reg.dcm", {"two outputs"});
  expect_refused("deform in -f identity -o out --inverse in/reg.dcm", {"is inside"});
  expect_refused("invert identity --like in.mha -o reg.dcm", {"in.mha", "DICOM series"});
  expect_refused("invert --pull-field in.mha --like in -o reg.dcm", {"forward field", "reg.dcm"});
  EXPECT_FALSE(std::filesystem::exists(scratch / "out"));
  EXPECT_FALSE(std::filesystem::exists(scratch / "reg.dcm"));
}

TEST(RegistrationObject, AFullDiskOrAMissingFolderLeavesNothing) {
  const Scratch scratch;
  make_phantom(scratch);
  const auto expect_failure = [&](const std::string& limit, const std::string& arguments, const std::string& word) {
    const Outcome run = run_program(scratch.path(), "sh",
                                    "-c 'trap \"\" XFSZ; " + limit + "exec \"" TETWARP_PROGRAM "\" " + arguments + "'");
    EXPECT_EQ(run.status, 1) << arguments;
    EXPECT_NE(run.err.find(word), std::string::npos) << run.err;
    EXPECT_EQ(run.err.find("partial"), std::string::npos) << run.err;
    for (const auto& entry : std::filesystem::directory_iterator(scratch.path())) {
      const std::string left = entry.path().filename().string();
      EXPECT_TRUE(left == "in" || left == ".stdout" || left == ".stderr") << left;
    }
  };
  // A limit of 20 kB a file stands in for a full disk: a slice is smaller, the vectors are not.
  const std::string full = "ulimit -f 40; ";
  expect_failure(full, std::string("deform in ") + kTwist + " -o out --inverse reg.dcm", ", reg.dcm;");
  expect_failure(full, "invert twist:angle=25 --like in -o reg.dcm", ", reg.dcm;");
  expect_failure("", std::string("deform in ") + kTwist + " -o out --inverse nowhere/reg.dcm", "nowhere");
}

TEST(RegistrationObject, OfATiltedRealSeriesIsOnTheStraightGrid) {
  TETWARP_REAL_DATA(folder, "tilt-uniform-philips");
  const Scratch scratch;
  const std::string deform = "deform '" + folder.string() + "' --quiet ";
  const std::string field = "-f wave:amplitude=6,wavelength=90 --cell-size 8 --outside background ";
  expect_run(scratch, deform + field + "-o out --inverse reg.dcm --coverage there.mha");
  const PullField object = read_pull_field(scratch / "reg.dcm");
  EXPECT_TRUE(same_grid(object.grid, read_image_header(scratch / "there.mha").geometry, 1e-4));
  expect_run(scratch, deform + "--pull-field reg.dcm -o back --coverage again.mha");
  std::vector<std::int16_t> there = voxels_of(scratch / "out"), again = voxels_of(scratch / "back");
  const AnyVolume covered_there = read_image(scratch / "there.mha"), covered_again = read_image(scratch / "again.mha");
  std::size_t at_the_border = 0;  // whether a source is half a voxel beyond the slices, or hardly less, is rounding
  for (std::size_t n = 0; n < there.size(); ++n) {
    if (covered_there.as<std::uint8_t>()[n] == covered_again.as<std::uint8_t>()[n]) continue;
    ++at_the_border;
    again[n] = there[n];
  }
  EXPECT_LE(at_the_border, 10U);
  const Difference off = difference(there, again);
  EXPECT_LE(off.largest, 1);
  EXPECT_LT(off.voxels, there.size() / 100);
}

}  // namespace
