// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Where pydicom and dcm2niix see the voxels of a stack, Tetwarp does, however it lies and its slices are numbered.
#include <gtest/gtest.h>

#include <cmath>

#include <glm/geometric.hpp>

#include "io/dicom_series.h"
#include "tests/support/dicom/dicom_maker.h"
#include "tests/support/other_readers.h"
#include "tests/support/real_data.h"
#include "tests/support/scratch.h"

namespace tetwarp::test {
namespace {

namespace fs = std::filesystem;

struct Lie {
  const char* name;
  glm::dvec3 row, column;
  int first_number, step;  ///< Instance Numbers along the normal
};

void PrintTo(const Lie& lie, std::ostream* out) { *out << lie.name; }

std::string decimals(const glm::dvec3& v) {
  char text[96];
  std::snprintf(text, sizeof text, "%.12g\\%.12g\\%.12g", v.x, v.y, v.z);
  return text;
}

/// Nine slices, one voxel brighter than all others.
void write_lying(const fs::path& folder, const Lie& lie) {
  const glm::dvec3 normal = glm::cross(lie.row, lie.column);
  write_stack(folder, 9, [&](int k, MadeSlice& slice) {
    slice.position = decimals(glm::dvec3(-31, 17, 202) + 1.75 * k * normal);
    slice.orientation = decimals(lie.row) + "\\" + decimals(lie.column);
    slice.instance_number = lie.first_number + lie.step * k;
    slice.rows = 7;
    slice.columns = 5;
    for (int n = 0; n < 35; ++n) slice.words.push_back(static_cast<std::uint16_t>((n * 13 + k * 29) % 100));
    if (k == 2) slice.words[8] = 900;
    slice.edit = [](DcmDataset& data) {
      data.putAndInsertString(DCM_Manufacturer, "SIEMENS");
      data.putAndInsertString(DCM_PatientPosition, "HFS");
    };
  });
}

class LyingStack : public testing::TestWithParam<Lie> {
 protected:
  LyingStack() { write_lying(scratch_ / "in", GetParam()); }
  DicomVolume load() const { return load_dicom(scan_dicom(scratch_ / "in").series.at(0)); }

  const Scratch scratch_;
};

TEST_P(LyingStack, IsWherePydicomSeesIt) {
  check_with("pydicom", scratch_ / "in", load().volume, scratch_ / "expected.json");
}

TEST_P(LyingStack, IsWhereDcm2niixSeesIt) {
  check_with("dcm2niix", scratch_ / "in", load().volume, scratch_ / "expected.json");
}

const double kSine = std::sin(0.4), kCosine = std::cos(0.4);

INSTANTIATE_TEST_SUITE_P(
    Stacks, LyingStack,
    testing::Values(Lie{"AxialUp", {1, 0, 0}, {0, 1, 0}, 1, 1}, Lie{"AxialNumberedDown", {1, 0, 0}, {0, 1, 0}, 9, -1},
                    Lie{"AxialFromTheHead", {1, 0, 0}, {0, -1, 0}, 1, 1},
                    Lie{"AxialFeetFirst", {-1, 0, 0}, {0, 1, 0}, 9, -1}, Lie{"Coronal", {1, 0, 0}, {0, 0, -1}, 1, 1},
                    Lie{"CoronalDown", {1, 0, 0}, {0, 0, -1}, 9, -1}, Lie{"Sagittal", {0, 1, 0}, {0, 0, -1}, 1, 1},
                    Lie{"SagittalDown", {0, 1, 0}, {0, 0, -1}, 9, -1},
                    Lie{"Oblique", {kCosine, kSine, 0}, {0, 0, -1}, 1, 1},
                    Lie{"ObliqueDown", {kCosine, 0, kSine}, {-kSine * kSine, kCosine, kSine* kCosine}, 9, -1}),
    [](const auto& tested) { return tested.param.name; });

TEST(RealStack, SagittalReformatIsWhereDcm2niixSeesIt) {
  TETWARP_REAL_DATA(folder, "sagittal-with-scout");
  const Scratch scratch;
  const DicomSeries series = scan_dicom(folder).series.at(0);
  fs::create_directory(scratch / "in");
  for (const DicomSlice& slice : series.slices) fs::copy_file(slice.file, scratch / "in" / slice.file.filename());
  check_with("dcm2niix", scratch / "in", load_dicom(series).volume, scratch / "expected.json");
}

}  // namespace
}  // namespace tetwarp::test
