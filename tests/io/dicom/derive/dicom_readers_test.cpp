// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Derived series and phantoms as other programs see them: dciodvfy and dcentvfy (dicom3tools), pydicom, dcm2niix.
#include <gtest/gtest.h>

#include "io/dicom_series.h"
#include "tests/support/dicom/dicom_maker.h"
#include "tests/support/dicom/dicom_validators.h"
#include "tests/support/other_readers.h"
#include "tests/support/real_data.h"
#include "tests/support/scratch.h"

namespace fs = std::filesystem;

namespace tetwarp::test {
namespace {

std::vector<fs::path> files_in(const fs::path& folder) {
  return {fs::directory_iterator(folder), fs::directory_iterator()};
}

std::vector<fs::path> files_of(const DicomSeries& series) {
  std::vector<fs::path> files;
  for (const DicomSlice& slice : series.slices) files.push_back(slice.file);
  return files;
}

/// A real series, and one derived from it that has its voxels: what differs is what the writer did.
class DerivedFromReal : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    const std::string set = GetParam();
    TETWARP_REAL_DATA(folder, set);
    const DicomScan scan = scan_dicom(folder);
    ASSERT_EQ(scan.series.size(), 1U);
    series_ = scan.series.front();
    source_ = load_dicom(series_);
    DicomDerivation derivation{.field_sha256 = std::string(64, 'a'),
                               .parameters = "interpolation=linear outside=refuse",
                               .description = "Deformed by a vertex field"};
    std::vector<SliceRange> sampled;
    for (std::int64_t k = 0; k < std::ssize(series_.slices); ++k) sampled.push_back({k, k});
    fs::create_directory(output_);
    write_derived_series(output_, view(source_.volume), *source_.headers, derivation, sampled);
  }

  const Scratch scratch_;
  const fs::path output_ = scratch_ / "series";
  DicomSeries series_;
  DicomVolume source_;
};

TEST_P(DerivedFromReal, DciodvfyFindsNoErrorThatTheSourceHasNot) {
  if (!is_installed("dciodvfy")) GTEST_SKIP() << "dciodvfy (dicom3tools) is not installed";
  const std::set<std::string> before = dciodvfy_errors(files_of(series_)), after = dciodvfy_errors(files_in(output_));
  for (const std::string& line : after) EXPECT_TRUE(before.contains(line)) << line;
}

TEST_P(DerivedFromReal, DcentvfyFindsOneConsistentSeries) {
  if (!is_installed("dcentvfy")) GTEST_SKIP() << "dcentvfy (dicom3tools) is not installed";
  EXPECT_EQ(dcentvfy_errors(files_in(output_)), std::set<std::string>());
}

TEST_P(DerivedFromReal, ReadsBackTheSame) {
  const DicomScan scan = scan_dicom(output_);
  ASSERT_EQ(scan.series.size(), 1U);
  EXPECT_EQ(scan.series[0].refusal, std::nullopt);
  EXPECT_EQ(scan.series[0].study_uid, series_.study_uid);
  EXPECT_NE(scan.series[0].series_uid, series_.series_uid);
  EXPECT_NE(scan.series[0].frame_of_reference_uid, series_.frame_of_reference_uid);
  EXPECT_TRUE(same_grid(scan.series[0].geometry, series_.geometry, 1e-4));
  const DicomVolume again = load_dicom(scan.series[0]);
  EXPECT_TRUE(again.volume.voxels == source_.volume.voxels);
  ASSERT_EQ(again.padding.has_value(), source_.padding.has_value());
  if (again.padding) {
    EXPECT_EQ(again.padding->low, source_.padding->low);
    EXPECT_EQ(again.padding->high, source_.padding->high);
  }
}

TEST_P(DerivedFromReal, PydicomSeesTheSameGeometryAndHu) {
  check_with("pydicom", output_, source_.volume, scratch_ / "expected.json");
}

TEST_P(DerivedFromReal, Dcm2niixSeesTheSameGeometryAndHu) {
  check_with("dcm2niix", output_, source_.volume, scratch_ / "expected.json");
}

INSTANTIATE_TEST_SUITE_P(Sets, DerivedFromReal,
                         testing::Values("chest-cmb-crc", "abdomen-acrin-flt", "head-phantom-multiseries/S21570/S2020",
                                         "overlap-kits-and-topogram/kits-00072"),
                         [](const auto& set) {
                           std::string name = fs::path(set.param).begin()->string();
                           std::erase(name, '-');
                           return name;
                         });

TEST(DerivedFromBareSeries, HasOnlyTheErrorThatNobodyCanMend) {
  if (!is_installed("dciodvfy")) GTEST_SKIP() << "dciodvfy (dicom3tools) is not installed";
  const Scratch scratch;
  write_stack(scratch / "in", 3);  // hardly any type 2 attribute is there
  const DicomVolume source = load_dicom(scan_dicom(scratch / "in").series.at(0));
  fs::create_directory(scratch / "out");
  DicomDerivation bare;
  bare.description = "Deformed";
  const DicomWriteReport report = write_derived_series(scratch / "out", view(source.volume), *source.headers, bare);
  EXPECT_GT(report.added_empty.size(), 10U);
  // It is not known which body part the images show, and so whether it has a side.
  EXPECT_EQ(dciodvfy_errors(files_in(scratch / "out")),
            std::set<std::string>{
                "Error - Missing attribute Type 2C Conditional Element=<Laterality> Module=<GeneralSeries>"});
}

class PhantomForOthers : public testing::Test {
 protected:
  PhantomForOthers() {
    for (std::int64_t n = 0; n < voxel_count(volume_.geometry); ++n) {
      volume_.voxels.push_back(static_cast<std::int16_t>(n % 2500 - 1024));
    }
    fs::create_directory(output_);
    write_phantom_series(output_, view(volume_), 1);
  }

  const Scratch scratch_;
  const fs::path output_ = scratch_ / "series";
  Volume<std::int16_t> volume_{{{40, 30, 5}, {0.7, 0.9, 1.0 / 3}, {-13.65, -13.05, -2.0 / 3}, glm::dmat3(1)}, {}};
};

TEST_F(PhantomForOthers, HasNoErrorOfDciodvfyAndDcentvfy) {
  if (!is_installed("dciodvfy")) GTEST_SKIP() << "dciodvfy (dicom3tools) is not installed";
  EXPECT_EQ(dciodvfy_errors(files_in(output_)), std::set<std::string>());
  EXPECT_EQ(dcentvfy_errors(files_in(output_)), std::set<std::string>());
}

TEST_F(PhantomForOthers, IsWhereItIsForPydicom) { check_with("pydicom", output_, volume_, scratch_ / "expected.json"); }
TEST_F(PhantomForOthers, IsWhereItIsForDcm2niix) {
  check_with("dcm2niix", output_, volume_, scratch_ / "expected.json");
}

}  // namespace
}  // namespace tetwarp::test
