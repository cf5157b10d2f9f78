// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// First light on real patients' CT: in through DICOM, out through DICOM and NIfTI.
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "io/dicom_series.h"
#include "io/image_file.h"
#include "tests/support/program.h"
#include "tests/support/real_data.h"
#include "tests/support/scratch.h"

namespace {

using namespace tetwarp;

struct RealSeries {
  const char *set, *folder;
  glm::i64vec3 size;
};

void PrintTo(const RealSeries& series, std::ostream* out) { *out << series.set; }

class RealCt : public testing::TestWithParam<RealSeries> {};

DicomVolume load_only_series(const std::filesystem::path& folder) {
  const DicomScan scan = scan_dicom(folder);
  EXPECT_EQ(scan.series.size(), 1u);
  return load_dicom(scan.series.at(0));
}

/// Patient's name, ID and birth date of the first file of a folder, where they say anything.
std::vector<std::string> identity_of(const std::filesystem::path& folder) {
  std::vector<std::string> identity;
  DcmFileFormat file;
  const std::filesystem::path first = std::filesystem::directory_iterator(folder)->path();
  if (file.loadFile(first.c_str()).bad()) return identity;
  for (const DcmTagKey& key : {DCM_PatientName, DCM_PatientID, DCM_PatientBirthDate}) {
    OFString value;
    file.getDataset()->findAndGetOFString(key, value);
    if (value.size() >= 4) identity.emplace_back(value.c_str());
  }
  return identity;
}

TEST_P(RealCt, IdentityReturnsTheSourceThroughDicomAndNifti) {
  TETWARP_REAL_DATA(root, GetParam().set);
  const std::filesystem::path series = root / GetParam().folder;
  const Scratch scratch;
  ASSERT_EQ(run_tetwarp(scratch.path(), "deform '" + series.string() + "' -f identity -o out.nii.gz").status, 0);
  ASSERT_EQ(run_tetwarp(scratch.path(), "deform '" + series.string() + "' -f identity -o out_dicom/").status, 0);
  const DicomVolume source = load_only_series(series), derived = load_only_series(scratch / "out_dicom");
  const AnyVolume nifti = read_image(scratch / "out.nii.gz");
  ASSERT_EQ(source.volume.geometry.size, GetParam().size);
  EXPECT_TRUE(derived.volume.voxels == source.volume.voxels);
  EXPECT_TRUE(std::equal(source.volume.voxels.begin(), source.volume.voxels.end(), nifti.as<std::int16_t>().begin()));
  EXPECT_TRUE(same_grid(source.volume.geometry, derived.volume.geometry, 1e-4));
  EXPECT_TRUE(same_grid(source.volume.geometry, nifti.geometry(), 1e-3));
  EXPECT_EQ(source.padding.has_value(), derived.padding.has_value());
  if (source.padding && derived.padding) {
    EXPECT_EQ(source.padding->low, derived.padding->low);
  }
}

TEST_P(RealCt, AWaveGivesTheSameVoxelsThroughDicomAndNifti) {
  TETWARP_REAL_DATA(root, GetParam().set);
  const std::filesystem::path series = root / GetParam().folder;
  const Scratch scratch;
  const std::string wave = "deform '" + series.string() + "' -f wave:amplitude=8,wavelength=64 -o ";
  const Outcome run = run_tetwarp(scratch.path(), wave + "out.nii.gz");
  ASSERT_EQ(run.status, 0) << run.err;
  ASSERT_EQ(run_tetwarp(scratch.path(), wave + "out_dicom/ --report report.json").status, 0);
  const DicomVolume derived = load_only_series(scratch / "out_dicom");
  const AnyVolume nifti = read_image(scratch / "out.nii.gz");
  EXPECT_TRUE(std::equal(derived.volume.voxels.begin(), derived.volume.voxels.end(), nifti.as<std::int16_t>().begin()));
  const auto report = nlohmann::json::parse(read_text(scratch / "report.json"));
  EXPECT_EQ(report["report"]["inverted"], 0);
  EXPECT_GT(report["report"]["covered"].get<double>(),
            0.95 * static_cast<double>(voxel_count(derived.volume.geometry)));
}

TEST_P(RealCt, NothingThatIsPrintedOrWrittenBesideTheSeriesNamesThePatient) {
  TETWARP_REAL_DATA(root, GetParam().set);
  const std::filesystem::path series = root / GetParam().folder;
  const Scratch scratch;
  const Outcome run = run_tetwarp(
      scratch.path(), "deform '" + series.string() +
                          "' -f translate:by=2/0/0vox --cell-size 8 -o out_dicom --report report.json --verbose");
  ASSERT_EQ(run.status, 0) << run.err;
  const std::string said = run.out + run.err + read_text(scratch / "report.json") +
                           read_text(scratch / "out_dicom.json") + run_tetwarp(scratch.path(), "info out_dicom").out;
  for (const std::string& secret : identity_of(series)) {
    EXPECT_EQ(said.find(secret), std::string::npos) << "a patient attribute of " << series << " was given away";
  }
}

INSTANTIATE_TEST_SUITE_P(Series, RealCt,
                         testing::Values(RealSeries{"chest-cmb-crc", "dicom", {512, 512, 100}},
                                         RealSeries{"abdomen-acrin-flt", "dicom", {512, 512, 99}},
                                         RealSeries{"head-phantom-multiseries", "S21570/S2020", {512, 512, 140}},
                                         RealSeries{"overlap-kits-and-topogram", "kits-00072", {512, 512, 18}}),
                         [](const auto& tested) { return "Set" + std::to_string(tested.index); });

}  // namespace
