// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Series whose slices lean or lie at uneven distances, through the whole program, against pydicom and NumPy.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "io/dicom_series.h"
#include "tests/support/dicom/dicom_maker.h"
#include "tests/support/program.h"
#include "tests/support/real_data.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace tetwarp::test {
namespace {

namespace fs = std::filesystem;

/// Whether the output shows the series where its slices lie, moved by a shift. Skips without Python's modules.
void check_stack(const Scratch& scratch, const fs::path& series, const std::string& output, const std::string& shift,
                 int background) {
  const std::string command = std::string(TETWARP_PYTHON) + " " + TETWARP_CHECK_STACK + " '" + series.string() + "' '" +
                              (scratch / output).string() + "' " + shift + " " + std::to_string(background) + " > '" +
                              (scratch / "check.txt").string() + "' 2>&1";
  const int status = std::system(command.c_str());
  const int code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  if (code == 77) GTEST_SKIP() << "no pydicom, nibabel or NumPy: " << read_text(scratch / "check.txt");
  EXPECT_EQ(code, 0) << output << ": " << read_text(scratch / "check.txt");
}

/// Rows, columns and values of noise; places of slices in mm.
void write_noise(const fs::path& folder, const std::string& orientation, const std::vector<double>& places) {
  fs::create_directories(folder);
  write_stack(folder, static_cast<int>(places.size()), [&](int k, MadeSlice& slice) {
    slice.orientation = orientation;
    slice.position = position_text(-10, -20, places[static_cast<std::size_t>(k)]);
    slice.rows = 40;
    slice.columns = 36;
    slice.words.resize(40 * 36);
    for (std::size_t n = 0; n < slice.words.size(); ++n)
      slice.words[n] = static_cast<std::uint16_t>((n * 7919 + static_cast<std::size_t>(k) * 104729) % 2000);
  });
}

constexpr const char* kTilted = "1\\0\\0\\0\\0.9483237\\-0.3173047";
constexpr const char* kStraight = "1\\0\\0\\0\\1\\0";

TEST(StackProgram, SlicesThatLeanOrAreUnevenAreSampledWhereTheyLie) {
  const Scratch scratch;
  write_noise(scratch / "tilted", kTilted, {0, 2.5, 5, 7.5, 10, 12.5});
  write_noise(scratch / "uneven", kStraight, {0, 2.5, 5, 6.25, 9, 12.5});
  write_noise(scratch / "both", kTilted, {0, 2.5, 5, 6.25, 9, 12.5});
  for (const std::string name : {"tilted", "uneven", "both"}) {
    const Outcome run = run_tetwarp(scratch.path(), "deform " + name + " --uneven exact -f identity -o " + name +
                                                        ".nii --background -1500 --report " + name + ".json");
    ASSERT_EQ(run.status, 0) << run.err;
    EXPECT_TRUE(says(run.err, {"straight, even grid", "the identity resamples too"}));
    check_stack(scratch, scratch / name, name + ".nii", "0 0 0", -1500);
    const auto report = nlohmann::json::parse(read_text(scratch / (name + ".json")));
    EXPECT_TRUE(says(report.dump(), {"the identity resamples too"}));
  }
}

TEST(StackProgram, AStackThatLeansIsTheGridOfEveryCommandThatTakesOne) {
  const Scratch scratch;
  write_noise(scratch / "tilted", kTilted, {0, 2.5, 5, 7.5, 10, 12.5});
  const auto run = [&](const std::string& arguments) {
    const Outcome outcome = run_tetwarp(scratch.path(), arguments);
    EXPECT_EQ(outcome.status, 0) << arguments << ": " << outcome.err;
  };
  run("invert bubble:radius=20,strength=0.2 --like tilted -o pull.mha");
  run("invert --pull-field pull.mha --like tilted -o forward.mha");
  run("invert --pull-field pull.mha --like tilted -o forward.nii.gz --report r.json");
  // A transform has no grid of its own: its inverse has that of --like, straightened.
  write_file(scratch / "t.tfm",
             "#Insight Transform File V1.0\n#Transform 0\nTransform: TranslationTransform_double_3_3\n"
             "Parameters: 1 0 0\nFixedParameters:\n");
  run("invert --pull-field t.tfm --like tilted -o shift.mha");
  run("deform tilted --pull-field pull.mha -o a.mha --background -1500");
  run("deform tilted -f forward.mha -o b.mha --background -1500 --outside background");
  const auto report = nlohmann::json::parse(read_text(scratch / "r.json"));
  EXPECT_LT(report["forward_after_inverse"]["largest_mm"], 0.01);
  EXPECT_EQ(report["uncovered"], 0);
}

TEST(StackProgram, UnevenSlicesAreRefusedUnlessTheyAreAskedFor) {
  const Scratch scratch;
  write_noise(scratch / "uneven", kStraight, {0, 2.5, 5, 6.25, 9, 12.5});
  const Outcome refused = run_tetwarp(scratch.path(), "deform uneven -f identity -o out.nii");
  EXPECT_EQ(refused.status, 4);
  EXPECT_TRUE(says(refused.err, {"slice gap", "--uneven exact"}));
  EXPECT_FALSE(fs::exists(scratch / "out.nii"));
  // What speaks of the main volume alone is not named where another one is to blame.
  write_noise(scratch / "even", kStraight, {0, 2.5, 5, 7.5});
  const Outcome other = run_tetwarp(scratch.path(), "deform even -f identity -o out.nii --with uneven=other.nii");
  EXPECT_EQ(other.status, 4);
  EXPECT_TRUE(says(other.err, {"slice gap", "add what is missing"}));
  EXPECT_EQ(other.err.find("--uneven"), std::string::npos) << other.err;
  // Nor where what a command reads is listed before it is read.
  const Outcome labels = run_tetwarp(
      scratch.path(), "deform even --scenario '" TETWARP_SCENARIOS "/incision.json' --labels uneven -o out.nii");
  EXPECT_EQ(labels.status, 4);
  EXPECT_TRUE(says(labels.err, {"slice gap", "add what is missing"}));
  EXPECT_EQ(labels.err.find("--uneven"), std::string::npos) << labels.err;
  EXPECT_EQ(run_tetwarp(scratch.path(), "deform uneven --uneven maybe -f identity -o out.nii").status, 2);
  const Outcome cubic =
      run_tetwarp(scratch.path(), "deform uneven --uneven exact --interpolation cubic -f identity -o out.nii");
  EXPECT_EQ(cubic.status, 4);
  EXPECT_TRUE(says(cubic.err, {"cubic", "even slices"}));
  const Outcome info = run_tetwarp(scratch.path(), "info uneven");
  EXPECT_TRUE(says(info.out, {"slice gap", "--uneven exact"}));
}

TEST(StackProgram, ADerivedSeriesOfALeaningOneIsStraightAndHoldsAllOfIt) {
  const Scratch scratch;
  write_noise(scratch / "both", kTilted, {0, 2.5, 5, 6.25, 9, 12.5});
  const Outcome run = run_tetwarp(scratch.path(), "deform both --uneven exact -f identity -o derived");
  ASSERT_EQ(run.status, 0) << run.err;
  const DicomScan source = scan_dicom(scratch / "both"), derived = scan_dicom(scratch / "derived");
  ASSERT_EQ(derived.series.size(), 1u);
  const DicomSeries& series = derived.series[0];
  EXPECT_EQ(series.refusal, std::nullopt);
  EXPECT_EQ(series.uneven, std::nullopt);
  EXPECT_TRUE(same_grid(series.geometry, straightened(source.series[0].geometry), 1e-3));
  EXPECT_GT(series.geometry.size.z, source.series[0].geometry.size.z);
}

TEST(StackProgram, RealTiltedSeriesAreSampledWhereTheirSlicesLie) {
  TETWARP_REAL_DATA(philips, "tilt-uniform-philips");
  TETWARP_REAL_DATA(ge, "tilt-variable-spacing-ge");
  TETWARP_REAL_DATA(errors, "slice-errors");
  const Scratch scratch;
  for (const auto& [name, folder] :
       {std::pair{"philips", philips}, std::pair{"ge", ge}, std::pair{"gap", errors / "gap"}}) {
    for (const auto& [field, shift] :
         {std::pair{"identity", "0 0 0"}, std::pair{"translate:by=3.25/-2/4.5", "3.25 -2 4.5"}}) {
      const std::string output = std::string(name) + (shift[0] == '0' ? "" : "-moved") + ".nii";
      const Outcome run = run_tetwarp(scratch.path(), "deform '" + folder.string() + "' --uneven exact -f " + field +
                                                          " -o " + output + " --background -1500");
      ASSERT_EQ(run.status, 0) << run.err;
      check_stack(scratch, folder, output, shift, -1500);
    }
  }
}

}  // namespace
}  // namespace tetwarp::test
