// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// `tetwarp deform --with STRUCTURES.dcm=OUT.dcm`: what was drawn on a series goes with it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>
#include <numbers>

#include "io/dicom_structures.h"
#include "io/image_file.h"
#include "tests/support/dicom/dicom_maker.h"
#include "tests/support/dicom/structure_maker.h"
#include "tests/support/program.h"
#include "tests/support/real_data.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"

namespace tetwarp::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

const glm::dvec3 kMiddle(0.4, -0.7, 1.2);
constexpr double kRadius = 40, kInner = 18, kEdge = 100;

MadeContour circle_at(const glm::dvec3& middle, double z, double radius) {
  MadeContour contour;
  const double height = z - middle.z, r = std::sqrt(radius * radius - height * height);
  for (int n = 0; n < 120; ++n) {
    const double angle = 2 * std::numbers::pi * n / 120;
    contour.points.push_back({middle.x + r * std::cos(angle), middle.y + r * std::sin(angle), z});
  }
  return contour;
}

/// A CT series, a structure set on it (a ball, a ball with a hole, marks, nothing), and masks of the balls: kEdge on
/// their surfaces, more inside, so that they can be interpolated.
class Structures : public testing::Test {
 protected:
  Structures() {
    run("phantom --size 96,96,44 --spacing 2,2,3 --quiet -o ct");
    const DicomSeries series = scan_dicom(scratch / "ct").series.front();
    grid = series.geometry;
    MadeStructures made;
    made.frame = series.frame_of_reference_uid;
    made.study = series.study_uid;
    made.rois.resize(4);
    for (std::int64_t k = 0; k < grid.size.z; ++k) {
      const double z = grid.origin.z + grid.spacing.z * static_cast<double>(k);
      if (std::abs(z - kMiddle.z) < kRadius) {
        made.rois[0].push_back(circle_at(kMiddle, z, kRadius));
        made.rois[1].push_back(circle_at(kMiddle, z, kRadius));
      }
      if (std::abs(z - kMiddle.z) < kInner) made.rois[1].push_back(circle_at(kMiddle, z, kInner));
    }
    made.rois[2] = {{"POINT", {{3, 4, 5}}}, {"OPEN_NONPLANAR", {{0, 0, 0}, {8, 6, 7}}}};
    write_structures(scratch / "rs.dcm", made);
    write_mask("ball.nii", 0);
    write_mask("shell.nii", kInner);
  }

  void write_mask(const std::string& name, double inner) const {
    AnyVolume mask(grid, VoxelType::u8);
    const AffineMap point = point_from_index(grid);
    for (std::int64_t n = 0; n < voxel_count(grid); ++n) {
      const glm::dvec3 at =
          point(glm::dvec3(n % grid.size.x, n / grid.size.x % grid.size.y, n / (grid.size.x * grid.size.y)));
      const double r = glm::distance(at, kMiddle);
      const double depth = inner == 0 ? kRadius - r : std::min(kRadius - r, r - inner);
      mask.as<std::uint8_t>()[static_cast<std::size_t>(n)] =
          static_cast<std::uint8_t>(std::clamp(std::round(kEdge + 20 * depth), 0.0, 255.0));
    }
    write_image(scratch / name, mask.view());
  }

  Outcome run(const std::string& arguments) const {
    const Outcome outcome = run_tetwarp(scratch.path(), arguments);
    EXPECT_EQ(outcome.status, 0) << arguments << "\n" << outcome.err;
    return outcome;
  }
  Outcome deform(const std::string& field, const std::string& more = "") const {
    return run("deform ct " + field + " --outside background -o out --with rs.dcm=out.dcm --overwrite " + more);
  }
  json rois() const { return json::parse(read_text(scratch / "out.json"))["structures"][0]["rois"]; }

  /// Runs check_structures.py. @return whether its program is there
  bool check(const std::string& arguments) const {
    const std::string command =
        std::string(TETWARP_PYTHON) + " " + TETWARP_CHECK_STRUCTURES + " " + arguments + " > check.txt 2>&1";
    const int status = std::system(("cd '" + scratch.path().string() + "' && " + command).c_str());
    const int code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    said = read_text(scratch / "check.txt");
    EXPECT_TRUE(code == 0 || code == 77) << arguments << ": " << said;
    return code != 77;
  }

  const Scratch scratch;
  Geometry grid;
  mutable std::string said;
};

double voxels_of(const fs::path& path) {
  const AnyVolume mask = read_image(path);
  return static_cast<double>(std::count_if(mask.as<std::uint8_t>().begin(), mask.as<std::uint8_t>().end(),
                                           [](std::uint8_t value) { return value > kEdge; }));
}

/// The largest distance of the points of two structure sets, once the first has been moved.
double largest_difference(const StructureSet& before, const StructureSet& after, const glm::dvec3& by) {
  double largest = 0;
  EXPECT_EQ(before.structures.size(), after.structures.size());
  for (std::size_t n = 0; n < before.structures.size(); ++n) {
    const auto &old = before.structures[n].contours, &now = after.structures[n].contours;
    EXPECT_EQ(old.size(), now.size());
    for (std::size_t c = 0; c < old.size() && c < now.size(); ++c) {
      EXPECT_EQ(old[c].kind, now[c].kind);
      if (old[c].points.size() != now[c].points.size()) return INFINITY;
      for (std::size_t p = 0; p < old[c].points.size(); ++p)
        largest = std::max(largest, glm::distance(old[c].points[p] + by, now[c].points[p]));
    }
  }
  return largest;
}

TEST_F(Structures, IdentityKeepsEveryContour) {
  deform("-f identity");
  const StructureSet before = read_structure_set(scratch / "rs.dcm"), after = read_structure_set(scratch / "out.dcm");
  EXPECT_LT(largest_difference(before, after, {0, 0, 0}), 1e-3);
  if (!check("references out out.dcm rs.dcm")) GTEST_SKIP() << said;
}

TEST_F(Structures, TranslationsByWholeSlicesMoveThePointsExactly) {
  deform("-f translate:by=5/-7/6");
  const StructureSet before = read_structure_set(scratch / "rs.dcm"), after = read_structure_set(scratch / "out.dcm");
  EXPECT_LT(largest_difference(before, after, {5, -7, 6}), 1e-3);
  for (const int roi : {0, 1}) EXPECT_EQ(rois()[roi]["moved"], "points");
  if (!check("references out out.dcm rs.dcm")) GTEST_SKIP() << said;
}

TEST_F(Structures, DrawnAnewTheyShowWhatAMaskShows) {
  for (const std::string field : {"wave:amplitude=9,wavelength=160,axis=z,along=x", "bubble:radius=80,strength=0.5",
                                  "twist:angle=30,axis=x", "translate:by=1/0.5/1.5"}) {
    SCOPED_TRACE(field);
    deform("-f " + field, "--with ball.nii=b.nii:linear:background=0 --with shell.nii=s.nii:linear:background=0");
    const double voxel_ml = grid.spacing.x * grid.spacing.y * grid.spacing.z / 1000;
    const json found = rois();
    for (const auto& [roi, mask] : {std::pair(0, "b.nii"), {1, "s.nii"}}) {
      EXPECT_EQ(found[roi]["moved"], "resliced");
      EXPECT_EQ(found[roi]["between_contours"], "interpolated");
      const double expected = voxels_of(scratch / mask) * voxel_ml, volume = found[roi]["volume_ml"][1];
      EXPECT_NEAR(volume, expected, 0.01 * expected) << roi;
    }
    if (!check("references out out.dcm rs.dcm") || !check("masks out out.dcm b.nii 1 s.nii 2")) GTEST_SKIP() << said;
  }
}

TEST_F(Structures, PlastimatchFillsThemAsTheMask) {
  deform("-f bubble:radius=80,strength=0.5",
         "--with ball.nii=b.nii:linear:background=0 --with shell.nii=s.nii:linear:background=0");
  if (!check("plastimatch out out.dcm b.nii organ_1 s.nii organ_2")) GTEST_SKIP() << said;
}

TEST_F(Structures, DciodvfyFindsNoErrorBeyondTheSources) {
  deform("-f bubble:radius=80,strength=0.5");
  if (!check("dciodvfy out.dcm rs.dcm")) GTEST_SKIP() << said;
}

TEST_F(Structures, AnyNumberOfThreadsWritesTheSameBytesAndOtherFieldsOtherUids) {
  deform("-f bubble:radius=80,strength=0.5", "--threads 1");
  const std::string one = read_text(scratch / "out.dcm"), sidecar = read_text(scratch / "out.json");
  deform("-f bubble:radius=80,strength=0.5", "--threads 2");
  EXPECT_EQ(read_text(scratch / "out.dcm"), one);
  EXPECT_EQ(read_text(scratch / "out.json"), sidecar);
  const auto uid = [&] {
    return json::parse(read_text(scratch / "out.json"))["structures"][0]["sop_instance_uid"].get<std::string>();
  };
  const std::string before = uid();
  deform("-f bubble:radius=80,strength=0.4");
  EXPECT_NE(uid(), before);
  EXPECT_EQ(sidecar.find("organ"), std::string::npos);
  EXPECT_EQ(sidecar.find("SECRET"), std::string::npos);
}

TEST_F(Structures, PullFieldsDrawAnewAndLeaveOutWhatNeedsAForwardMap) {
  run("invert bubble:radius=80,strength=0.5 --like ct -o pull.mha");
  const Outcome outcome = deform("--pull-field pull.mha", "--with shell.nii=s.nii:linear:background=0");
  EXPECT_TRUE(says(outcome.err, {"2 of 2 contours of ROI 3", "left out"}));
  EXPECT_EQ(rois()[2]["contours_left_out"], 2);
  EXPECT_EQ(rois()[2]["contours"], (json{2, 0}));
  EXPECT_FALSE(rois()[1].contains("at_end"));
  if (!check("references out out.dcm rs.dcm") || !check("masks out out.dcm s.nii 2")) GTEST_SKIP() << said;
}

TEST_F(Structures, WhatLeavesTheOutputIsSaid) {
  const Outcome whole = deform("-f bubble:radius=80,strength=0.5");
  EXPECT_EQ(whole.err.find("ROI"), std::string::npos) << whole.err;
  for (const std::string by : {"80/0/0.7", "80/0/0", "0/0/40", "0/0/-42"}) {
    const Outcome outcome = deform("-f translate:by=" + by);
    EXPECT_TRUE(says(outcome.err, {"contours of ROI 1 of rs.dcm come to lie beyond the output"})) << by;
    EXPECT_GE(rois()[0]["contours_beyond_output"], 5) << by;
  }
  deform("-f translate:by=80/0/0.7");
  EXPECT_EQ(rois()[0]["cut"], true);
}

TEST_F(Structures, WhatCannotBeDoneIsRefusedAndNothingIsWritten) {
  MadeStructures other;
  other.frame = "1.2.3.4.5";
  other.rois.resize(1);
  write_structures(scratch / "other.dcm", other);
  other.rois = {{{"CLOSED_PLANAR", {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}}}}};
  other.edit = [](DcmDataset& data) {
    DcmItem *roi = nullptr, *contour = nullptr;
    data.findAndGetSequenceItem(DCM_ROIContourSequence, roi);
    roi->findAndGetSequenceItem(DCM_ContourSequence, contour);
    contour->putAndInsertString(DCM_ContourData, "0\\0\\0\\1");
  };
  write_structures(scratch / "broken.dcm", other);
  run("phantom --size 20,20,20 --quiet -o in.mha");
  const struct {
    const char* arguments;
    int status;
    std::vector<std::string> words;
  } kCases[] = {
      {"ct -o x --with other.dcm=x.dcm", 4, {"1.2.3.4.5", "2.25.", "ROI 1", "other.dcm"}},
      {"ct -o x --dry-run --with other.dcm=x.dcm", 4, {"1.2.3.4.5"}},
      {"ct -o x --with broken.dcm=x.dcm", 4, {"4 numbers", "broken.dcm"}},
      {"ct -o x --with rs.dcm=x.nii", 2, {"OUT.dcm"}},
      {"ct -o x --with rs.dcm=x.dcm:nearest", 2, {"OUT.dcm"}},
      {"ct -o x.mha --with rs.dcm=x.dcm", 2, {"series"}},
      {"in.mha -o x --with rs.dcm=x.dcm", 2, {"series"}},
      {"ct -o x --with rs.dcm=rs.dcm", 2, {"rs.dcm"}},
  };
  for (const auto& [arguments, status, words] : kCases) {
    const Outcome outcome = run_tetwarp(scratch.path(), std::string("deform -f identity ") + arguments);
    EXPECT_EQ(outcome.status, status) << arguments << "\n" << outcome.err;
    EXPECT_TRUE(says(outcome.err, words)) << arguments;
    for (const char* name : {"x", "x.dcm", "x.json", "x.mha"}) EXPECT_FALSE(fs::exists(scratch / name)) << arguments;
  }
}

/// The structures of a patient, on slices that are made where they lie.
TEST(RealStructures, OfAPatientGoThroughAField) {
  TETWARP_REAL_DATA(folder, "rt-breast");
  const Scratch scratch;
  const StructureSet before = read_structure_set(folder / "rtss.dcm");
  write_stack(scratch / "ct", 104, [&](int k, MadeSlice& slice) {
    slice.rows = slice.columns = 160;
    slice.spacing = "3.2\\3.2";
    slice.position = position_text(-255, -520, 168.5593 + 3 * (k - 99));
    slice.frame = before.structures[0].frame_of_reference_uid;
  });
  const std::string command =
      "deform ct -o out --overwrite --outside background --with '" + (folder / "rtss.dcm").string() + "=out.dcm' -f ";
  Outcome outcome = run_tetwarp(scratch.path(), command + "identity");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_LT(largest_difference(before, read_structure_set(scratch / "out.dcm"), {0, 0, 0}), 1e-3);
  // Volumes stay as they are.
  outcome = run_tetwarp(scratch.path(), command + "wave:amplitude=12,wavelength=300,axis=z,along=x --cell-size 2");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  int drawn = 0;
  const json document = json::parse(read_text(scratch / "out.json"));
  for (const json& roi : document["structures"][0]["rois"]) {
    const double volume = roi["volume_ml"][0], now = roi["volume_ml"][1];
    if (volume == 0) continue;
    ++drawn;
    EXPECT_EQ(roi["moved"], "resliced");
    EXPECT_NEAR(now, volume, (volume > 10 ? 0.02 : 0.1) * volume) << roi;
  }
  EXPECT_EQ(drawn, 9);
}

}  // namespace
}  // namespace tetwarp::test
