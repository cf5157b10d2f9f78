// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// `tetwarp deform --with DOSE=OUT.dcm`: doses that go along with a derived series.
#include "tests/apps/deform/along_case.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "tests/support/real_data.h"

namespace {

using namespace tetwarp;

constexpr char kTwist[] = " -f twist:angle=25 --outside background ";

double largest_difference(std::span<const float> a, std::span<const float> b) {
  double largest = a.size() == b.size() ? 0 : INFINITY;
  for (std::size_t n = 0; n < a.size() && n < b.size(); ++n) largest = std::max(largest, std::abs(double{a[n]} - b[n]));
  return largest;
}

double quantum(const AlongCase& kase, std::size_t n = 0) {
  return kase.with("out.json")[n]["dicom"]["dose_grid_scaling"].get<double>();
}

TEST(DoseAlong, IdentityKeepsDosesWithinHalfAQuantum) {
  const AlongCase kase;
  AlongCase::dose().write(kase.scratch / "dose.dcm");
  MadeDose small{.offsets = "0\\-3\\-6", .position = "-9\\-19.5\\41", .spacing = "1\\1"};  // frames downwards
  small.write(kase.scratch / "small.dcm");
  kase.run("deform ct -f identity -o out --with dose.dcm=moved.dcm --with small.dcm=own.dcm:own");
  for (const auto& [before, after, n] :
       {std::tuple("dose.dcm", "moved.dcm", std::size_t{0}), std::tuple("small.dcm", "own.dcm", std::size_t{1})}) {
    const AnyVolume source = read_dose(kase.scratch / before), found = read_dose(kase.scratch / after);
    EXPECT_TRUE(same_grid(found.geometry(), source.geometry(), 1e-6)) << after;
    const auto doses = source.as<float>();
    const float largest = *std::max_element(doses.begin(), doses.end());
    EXPECT_NEAR(quantum(kase, n), largest / 2147483647.0, 1e-9 * quantum(kase, n));
    // Half a quantum, and what float32 makes of it.
    EXPECT_LE(largest_difference(doses, found.as<float>()), quantum(kase, n) / 2 + 1e-7 * largest) << after;
  }
  EXPECT_EQ(kase.with("out.json")[0]["dicom"]["units"], "GY");
  TETWARP_CHECK_ALONG_WITH(kase, "moved.dcm", "dose.dcm", "dump");
  TETWARP_CHECK_ALONG_WITH(kase, "own.dcm", "small.dcm", "-");
}

TEST(DoseAlong, ATranslationByWholeVoxelsMovesDosesExactlyAndLeavesNothingOutside) {
  const AlongCase kase;
  MadeDose made = AlongCase::dose();
  made.stored = [](unsigned n) { return n * 7919 % 40009 + 10; };  // nowhere 0
  made.write(kase.scratch / "dose.dcm");
  kase.run("deform ct -f translate:by=1/2/1vox --outside background -o out --with dose.dcm=moved.dcm");
  const AnyVolume source = read_dose(kase.scratch / "dose.dcm"), found = read_dose(kase.scratch / "moved.dcm");
  const auto before = source.as<float>(), after = found.as<float>();
  ASSERT_EQ(after.size(), before.size());
  for (int k = 0; k < AlongCase::kSlices; ++k) {
    for (int j = 0; j < AlongCase::kRows; ++j) {
      for (int i = 0; i < AlongCase::kColumns; ++i) {
        const auto at = [](int x, int y, int z) {
          return static_cast<std::size_t>((z * AlongCase::kRows + y) * AlongCase::kColumns + x);
        };
        const float expected = i >= 1 && j >= 2 && k >= 1 ? before[at(i - 1, j - 2, k - 1)] : 0;
        ASSERT_NEAR(after[at(i, j, k)], expected, quantum(kase) / 2 + 1e-6) << i << " " << j << " " << k;
      }
    }
  }
  TETWARP_CHECK_ALONG_WITH(kase, "moved.dcm", "dose.dcm", "dump");
}

TEST(DoseAlong, IsWhatAnImageOfItBecomesAndPydicomReadsTheSame) {
  const AlongCase kase;
  AlongCase::dose().write(kase.scratch / "dose.dcm");
  kase.run("deform ct" + std::string(kTwist) +
           "-o out --with dose.dcm=moved.dcm --with dose.dcm=moved.nii --with dose.dcm=cubic.dcm:cubic:background=0.5");
  const AnyVolume image = kase.image("moved.nii"), dose = read_dose(kase.scratch / "moved.dcm");
  EXPECT_LE(largest_difference(image.as<float>(), dose.as<float>()), quantum(kase) + 2e-6);
  const auto cubic = read_dose(kase.scratch / "cubic.dcm");
  const auto doses = cubic.as<float>();
  EXPECT_GE(*std::min_element(doses.begin(), doses.end()), 0);  // cubic overshoots
  EXPECT_GT(std::count_if(doses.begin(), doses.end(), [](float value) { return std::abs(value - 0.5F) < 1e-6F; }), 10);
  TETWARP_CHECK_ALONG_WITH(kase, "moved.dcm", "dose.dcm", "dump");
  const std::vector<double> read = kase.dumped<double>("dump");
  ASSERT_EQ(read.size(), image.as<float>().size());
  for (std::size_t n = 0; n < read.size(); ++n) ASSERT_NEAR(read[n], image.as<float>()[n], quantum(kase) + 2e-6) << n;
}

/// Dose Type ERROR has words with a sign (PS3.3 C.8.8.3.4.6).
TEST(DoseAlong, OfErrorsKeepsTheirSign) {
  const AlongCase kase;
  MadeDose made = AlongCase::dose();
  made.stored = [](unsigned n) { return n * 7919 % 40009 - 20000; };
  made.edit = [](DcmDataset& data) {
    data.putAndInsertString(DCM_DoseType, "ERROR");
    data.putAndInsertUint16(DCM_PixelRepresentation, 1);
  };
  made.write(kase.scratch / "errors.dcm");
  kase.run("deform ct -f identity -o out --with errors.dcm=moved.dcm");
  const AnyVolume source = read_dose(kase.scratch / "errors.dcm"), found = read_dose(kase.scratch / "moved.dcm");
  EXPECT_LT(*std::ranges::min_element(found.as<float>()), -9);
  EXPECT_LE(largest_difference(source.as<float>(), found.as<float>()), quantum(kase) / 2 + 1e-6);
}

/// The real plan has one CT slice, which is no volume, so a made-up volume stands around the dose.
TEST(DoseAlong, OfARealPlanIsReadByPlastimatchAndPydicomAsTheImageOfIt) {
  TETWARP_REAL_DATA(folder, "rt-breast");
  const AlongCase kase;
  std::filesystem::copy(folder / "rtdose.dcm", kase.scratch / "dose.dcm");
  DcmFileFormat ct;
  ASSERT_TRUE(ct.loadFile((folder / "ct.0.dcm").c_str()).good());
  const auto text = [&](const DcmTagKey& tag) {
    OFString value;
    ct.getDataset()->findAndGetOFString(tag, value);
    return std::string(value.c_str());
  };
  std::filesystem::remove_all(kase.scratch / "ct");
  write_stack(kase.scratch / "ct", 40, [&](int k, MadeSlice& slice) {
    slice.columns = 60;
    slice.rows = 50;
    slice.spacing = "5\\6";
    slice.position = position_text(-180, -380, -100 + 6 * k);
    slice.frame = text(DCM_FrameOfReferenceUID);
    slice.study = text(DCM_StudyInstanceUID);
    slice.edit = [&](DcmDataset& data) {
      for (const DcmTagKey& tag : {DCM_PatientName, DCM_PatientID}) data.putAndInsertString(tag, text(tag).c_str());
    };
  });
  kase.run("deform ct" + std::string(kTwist) +
           "-o out --with dose.dcm=moved.dcm --with dose.dcm=moved.nii --with dose.dcm=own.dcm:own --with "
           "dose.dcm=own.nii:own");
  for (const std::string name : {"moved", "own"}) {
    const AnyVolume image = kase.image(name + ".nii"), dose = read_dose(kase.scratch / (name + ".dcm"));
    EXPECT_TRUE(same_grid(image.geometry(), dose.geometry(), 1e-3));
    EXPECT_LE(largest_difference(image.as<float>(), dose.as<float>()), quantum(kase) + 2e-6) << name;
    const auto doses = dose.as<float>();
    EXPECT_GT(*std::max_element(doses.begin(), doses.end()), 10) << name;
  }
  if (std::system("command -v plastimatch > /dev/null") == 0) {
    ASSERT_EQ(
        run_program(kase.scratch.path(), "plastimatch", "convert --input moved.dcm --output-dose-img read.mha").status,
        0);
    const AnyVolume read = kase.image("read.mha"), image = kase.image("moved.nii");
    EXPECT_TRUE(same_grid(read.geometry(), image.geometry(), 1e-3));
    EXPECT_LE(largest_difference(read.as<float>(), image.as<float>()), quantum(kase) + 4e-6);
  }
  TETWARP_CHECK_ALONG_WITH(kase, "moved.dcm", "dose.dcm", "dump");
  TETWARP_CHECK_ALONG_WITH(kase, "own.dcm", "dose.dcm", "-");
}

}  // namespace
