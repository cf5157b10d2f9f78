// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// `tetwarp deform --with SEG=OUT.dcm`: segmentations that go along with a derived series.
#include <algorithm>
#include <cmath>

#include "tests/apps/deform/along_case.h"
#include "tests/support/real_data.h"
#include "tests/support/says.h"

namespace {

using namespace tetwarp;

constexpr char kTwist[] = " -f twist:angle=25 --outside background ";

/// Voxel (i, j, k) of the series in a segmentation that we read.
struct ReadSeg {
  explicit ReadSeg(const std::filesystem::path& path)
      : header(read_segmentation_header(path)), volumes(read_segments(path, header)) {}

  int at(std::size_t segment, int i, int j, int k) const {
    const glm::dvec3 index =
        index_from_point(header.geometry)(point_from_index(AlongCase::grid())(glm::dvec3(i, j, k)));
    const glm::i64vec3 voxel(std::llround(index.x), std::llround(index.y), std::llround(index.z)),
        size = header.geometry.size;
    if (voxel.z < 0 || voxel.z >= size.z) return 0;
    return volumes[segment]
        .as<std::uint8_t>()[static_cast<std::size_t>(voxel.x + size.x * (voxel.y + size.y * voxel.z))];
  }

  DicomSegmentation header;
  std::vector<AnyVolume> volumes;
};

void expect_segments(const std::filesystem::path& path, const std::function<int(int, int, int, int)>& expected) {
  const ReadSeg found(path);
  ASSERT_EQ(found.volumes.size(), 2U);
  for (int n = 0; n < 2; ++n) {
    for (int k = 0; k < AlongCase::kSlices; ++k) {
      for (int j = 0; j < AlongCase::kRows; ++j) {
        for (int i = 0; i < AlongCase::kColumns; ++i)
          ASSERT_EQ(found.at(static_cast<std::size_t>(n), i, j, k), expected(n, i, j, k))
              << path << ": segment " << n << " at " << i << " " << j << " " << k;
      }
    }
  }
}

TEST(SegAlong, IdentityKeepsEveryBit) {
  const AlongCase kase;
  AlongCase::seg().write(kase.scratch / "seg.dcm");
  AlongCase::fractions().write(kase.scratch / "part.dcm");
  MadeSeg fine = AlongCase::seg();  // two slices for one of the series
  fine.slices = 11;
  fine.spacing.z = 1.25;
  fine.spacing_between = "1.25";
  fine.value = [](int n, int i, int j, int k) { return AlongCase::organs(n, i, j, k / 2); };
  fine.write(kase.scratch / "fine.dcm");
  kase.run(
      "deform ct -f identity -o out --with seg.dcm=seg_out.dcm --with part.dcm=part_out.dcm --with "
      "seg.dcm=seg_own.dcm:own --with fine.dcm=fine_own.dcm:own");
  expect_segments(kase.scratch / "seg_out.dcm", AlongCase::organs);
  expect_segments(kase.scratch / "seg_own.dcm", AlongCase::organs);
  expect_segments(kase.scratch / "part_out.dcm", AlongCase::fractions().value);
  EXPECT_EQ(read_segmentation_header(kase.scratch / "seg_out.dcm").frames.size(), 8U);  // 5 and 3 slices
  const nlohmann::json with = kase.with("out.json");
  EXPECT_EQ(with[0]["dicom"]["segments"][0], (nlohmann::json{{"number", 1}, {"frames", 5}}));
  EXPECT_EQ(with[0]["interpolation"], "vote");
  EXPECT_EQ(with[1]["interpolation"], "linear");
  TETWARP_CHECK_ALONG_WITH(kase, "seg_out.dcm", "seg.dcm", "dump");
  TETWARP_CHECK_ALONG_WITH(kase, "part_out.dcm", "part.dcm", "dump");
  TETWARP_CHECK_ALONG_WITH(kase, "seg_own.dcm", "seg.dcm", "dump");
  const ReadSeg before(kase.scratch / "fine.dcm"), after(kase.scratch / "fine_own.dcm");
  EXPECT_TRUE(same_grid(before.header.geometry, after.header.geometry, 1e-6));
  for (std::size_t n = 0; n < 2; ++n)
    EXPECT_TRUE(std::ranges::equal(before.volumes[n].as<std::uint8_t>(), after.volumes[n].as<std::uint8_t>())) << n;
  TETWARP_CHECK_ALONG_WITH(kase, "fine_own.dcm", "fine.dcm", "-");
}

TEST(SegAlong, ATranslationByWholeVoxelsMovesSegmentsExactly) {
  const AlongCase kase;
  AlongCase::seg().write(kase.scratch / "seg.dcm");
  AlongCase::fractions().write(kase.scratch / "part.dcm");
  kase.run(
      "deform ct -f translate:by=1/-2/1vox --outside background -o out --with seg.dcm=seg_out.dcm --with "
      "part.dcm=part_out.dcm");
  const auto moved = [](const MadeSeg& made) {
    return [made](int n, int i, int j, int k) {
      return i >= 1 && j + 2 < AlongCase::kRows && k >= 1 ? made.value(n, i - 1, j + 2, k - 1) : 0;
    };
  };
  expect_segments(kase.scratch / "seg_out.dcm", moved(AlongCase::seg()));
  expect_segments(kase.scratch / "part_out.dcm", moved(AlongCase::fractions()));
  TETWARP_CHECK_ALONG_WITH(kase, "seg_out.dcm", "seg.dcm", "dump");
}

/// Frames in slices 0 to 4 alone: what moves into slice 5 is not lost.
TEST(SegAlong, OnItsOwnGridItReachesAsFarAsTheSeries) {
  const AlongCase kase;
  MadeSeg made = AlongCase::seg();
  made.value = [](int n, int i, int j, int k) { return i > 3 + n && j > 4 && k < 5 ? 1 : 0; };
  made.write(kase.scratch / "seg.dcm");
  kase.run("deform ct -f translate:by=0/0/1vox --outside background -o out --with seg.dcm=own.dcm:own");
  expect_segments(kase.scratch / "own.dcm",
                  [](int n, int i, int j, int k) { return i > 3 + n && j > 4 && k > 0 ? 1 : 0; });
}

/// Frames cropped to a part of the slice: they are empty beyond it, and what moves out of it is not lost.
TEST(SegAlong, FramesThatWereCroppedGiveWhatWholeOnesGive) {
  const AlongCase kase;
  MadeSeg whole = AlongCase::seg();
  whole.value = [](int n, int i, int j, int k) { return i > 3 + n && i < 7 && j > 2 && j < 6 && k > 0 ? 1 : 0; };
  whole.write(kase.scratch / "whole.dcm");
  MadeSeg cropped = whole;
  cropped.columns = 3;
  cropped.rows = 3;
  cropped.origin += glm::dvec3(4, 3, 0) * cropped.spacing;
  cropped.value = [whole](int n, int i, int j, int k) { return whole.value(n, i + 4, j + 3, k); };
  cropped.write(kase.scratch / "cropped.dcm");
  for (const std::string own : {"", ":own"}) {
    kase.run("deform ct" + std::string(kTwist) + "-o out --overwrite --with whole.dcm=a.dcm" + own +
             " --with cropped.dcm=b.dcm" + own);
    const ReadSeg a(kase.scratch / "a.dcm");
    expect_segments(kase.scratch / "b.dcm",
                    [&](int n, int i, int j, int k) { return a.at(static_cast<std::size_t>(n), i, j, k); });
  }
}

TEST(SegAlong, EachSegmentIsWhatItsMaskBecomesVoxelByVoxelForPydicomToo) {
  const AlongCase kase;
  const MadeSeg binary = AlongCase::seg(), fractional = AlongCase::fractions();
  binary.write(kase.scratch / "binary.dcm");
  fractional.write(kase.scratch / "fractional.dcm");
  std::string with;
  for (const std::string segment : {"0", "1"}) {
    kase.write_mask(binary, std::stoi(segment), "binary" + segment + ".mha");
    kase.write_mask(fractional, std::stoi(segment), "fractional" + segment + ".mha");
    with += " --with binary" + segment + ".mha=binary" + segment + ".nii:vote:background=0 --with fractional" +
            segment + ".mha=fractional" + segment + ".nii:linear:background=0";
  }
  kase.run("deform ct" + std::string(kTwist) +
           "-o out --with binary.dcm=binary_out.dcm --with "
           "fractional.dcm=fractional_out.dcm" +
           with);
  for (const std::string kind : {"binary", "fractional"}) {
    TETWARP_CHECK_ALONG_WITH(kase, kind + "_out.dcm", kind + ".dcm", "dump");
    const std::vector<std::uint8_t> found = kase.dumped<std::uint8_t>("dump");
    ASSERT_EQ(found.size(), 2U * AlongCase::kVoxels);
    std::vector<int> overlap(AlongCase::kVoxels);
    for (std::size_t n = 0; n < 2; ++n) {
      const AnyVolume mask = kase.image(kind + std::to_string(n) + ".nii");
      int shown = 0;
      for (std::size_t at = 0; at < AlongCase::kVoxels; ++at) {
        const int expected = mask.as<std::uint8_t>()[at], here = found[n * AlongCase::kVoxels + at];
        ASSERT_EQ(here, expected) << kind << " segment " << n << " voxel " << at;
        shown += here != 0;
        overlap[at] += here != 0;
      }
      EXPECT_GT(shown, 30) << kind << n;
    }
    EXPECT_GT(std::count(overlap.begin(), overlap.end(), 2), 5) << kind;
  }
}

/// Made by pydicom from thresholds; without Spacing Between Slices.
TEST(SegAlong, OfARealSeriesThroughTheIdentityIsTheSameForPydicom) {
  TETWARP_REAL_DATA(folder, "overlap-kits-and-topogram");
  const AlongCase kase;
  const std::string series = "'" + (folder / "kits-00072").string() + "'";
  const Outcome made =
      run_program(kase.scratch.path(), TETWARP_PYTHON, "'" TETWARP_MAKE_SEG "' " + series + " seg.dcm masks -300 250");
  if (made.status == 77) GTEST_SKIP() << "no pydicom or NumPy: " << made.out;
  ASSERT_EQ(made.status, 0) << made.err;
  kase.run("deform " + series + " -f identity -o out --with seg.dcm=moved.dcm");
  TETWARP_CHECK_ALONG_WITH(kase, "moved.dcm", "seg.dcm", "dump");
  const std::string expected = read_text(kase.scratch / "masks");
  EXPECT_GT(std::count(expected.begin(), expected.end(), 1), 100000);
  EXPECT_TRUE(expected == read_text(kase.scratch / "dump"));
}

TEST(SegAlong, WhereNothingIsLeftOneEmptyFrameIsWrittenAndSaidSo) {
  const AlongCase kase;
  MadeSeg made = AlongCase::seg();
  made.value = [](int, int i, int, int k) { return i == 11 && k == 5 ? 1 : 0; };
  made.write(kase.scratch / "seg.dcm");
  const std::string said =
      kase.said("deform ct -f translate:by=3/0/0vox --outside background -o out --with seg.dcm=seg_out.dcm", 0);
  EXPECT_TRUE(says(said, {"tetwarp: note: nothing is left", "seg.dcm"}));
  expect_segments(kase.scratch / "seg_out.dcm", [](int, int, int, int) { return 0; });
  TETWARP_CHECK_ALONG_WITH(kase, "seg_out.dcm", "seg.dcm", "dump");
}

}  // namespace
