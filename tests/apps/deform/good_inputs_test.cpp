// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Every real series and volume that can be deformed, through the program: what it writes as other programs read it, and
// as was computed; and the identity as NIfTI beside what dcm2niix makes of the source.
#include "tests/apps/deform/good_inputs.h"

#include <gtest/gtest.h>

#include <set>

#include "deform/fields/formula.h"
#include "deform/fields/point_map.h"
#include "deform/resampler.h"
#include "io/dicom_series.h"
#include "io/image_file.h"
#include "tests/apps/deform/foreign_volumes.h"
#include "tests/support/dicom/dicom_edit.h"
#include "tests/support/dicom/dicom_validators.h"
#include "tests/support/dicom/only_series.h"
#include "tests/support/other_readers.h"
#include "tests/support/program.h"
#include "tests/support/real_data.h"
#include "tests/support/scratch.h"

namespace tetwarp::test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kWave = "wave:amplitude=8,wavelength=96";
constexpr std::int64_t kCell = 8;  // voxels

using Names = std::set<std::string>;

/// The volume after the wave, computed here.
template <class V>
Volume<V> waved(const Volume<V>& source, double background, const std::optional<PaddingRange>& padding = {}) {
  const Geometry grid = straightened(source.geometry);
  const VertexField field = sample_on(lattice_over(grid, kCell), parse_formula(kWave, source.geometry));
  const auto resampler = make_cpu_resampler(grid);
  resampler->set_field(view(field));
  Volume<V> output{grid, std::vector<V>(static_cast<std::size_t>(voxel_count(grid)))};
  const Target target{.source = view(source), .output = view(output), .background = background, .padding = padding};
  resampler->resample(whole(grid), {&target, 1});
  return output;
}

/// A stack of the slice and a copy of it, 2.5 mm along the normal.
void write_stack_of_two(const fs::path& slice, const fs::path& folder) {
  edit_copy(slice, folder / "1", [](DcmDataset&) {});
  edit_copy(slice, folder / "2", [](DcmDataset& data) {
    rename_instance(data, "2");
    std::array<double, 6> cosines{};
    for (unsigned long n = 0; n < 6; ++n) data.findAndGetFloat64(DCM_ImageOrientationPatient, cosines[n], n);
    const glm::dvec3 normal =
        glm::cross(glm::dvec3(cosines[0], cosines[1], cosines[2]), glm::dvec3(cosines[3], cosines[4], cosines[5]));
    std::array<char, 64> text{};
    glm::dvec3 at{0};
    for (int n = 0; n < 3; ++n) data.findAndGetFloat64(DCM_ImagePositionPatient, at[n], static_cast<unsigned long>(n));
    at += 2.5 * normal;
    std::snprintf(text.data(), text.size(), "%.8g\\%.8g\\%.8g", at.x, at.y, at.z);
    data.putAndInsertString(DCM_ImagePositionPatient, text.data());
  });
}

std::vector<fs::path> files_in(const fs::path& folder) {
  std::vector<fs::path> files{fs::directory_iterator(folder), fs::directory_iterator()};
  std::sort(files.begin(), files.end());
  return files;
}

std::vector<fs::path> files_of(const DicomSeries& series) {
  std::vector<fs::path> files;
  for (const DicomSlice& slice : series.slices) {
    if (files.empty() || files.back() != slice.file) files.push_back(slice.file);
  }
  return files;
}

/// The first, the last, and some between: dciodvfy looks at each file by itself.
std::vector<fs::path> spread(const std::vector<fs::path>& files, std::size_t most = 12) {
  if (files.size() <= most) return files;
  std::vector<fs::path> some;
  for (std::size_t n = 0; n < most; ++n) some.push_back(files[n * (files.size() - 1) / (most - 1)]);
  return some;
}

class GoodDicom : public testing::TestWithParam<GoodInput> {
 protected:
  void SetUp() override {
    TETWARP_REAL_DATA(set, GetParam().at.begin()->string());
    input_ = test_data() / GetParam().at;
    if (fs::is_regular_file(input_)) {
      write_stack_of_two(input_, scratch_ / "stack");
      input_ = scratch_ / "stack";
    }
    const DicomScan scan = scan_dicom(input_);
    ASSERT_LE(static_cast<std::size_t>(number_), scan.series.size());
    series_ = scan.series[static_cast<std::size_t>(number_) - 1];
  }

  void deform(const std::string& field, const std::string& output) {
    const ::Outcome run =
        run_tetwarp(scratch_.path(), "deform '" + input_.string() + "' --series " + std::to_string(number_) +
                                         " --uneven exact -f " + field + " -o " + output + " --quiet");
    ASSERT_EQ(run.status, 0) << run.err;
  }

  /// What is read is what was expected; readers that are not there are named at the end.
  void expect_agreement(const std::string& readers, const std::string& path, const std::string& expected) {
    const test::Run run = check_geometry(readers, scratch_ / path, scratch_ / expected);
    if (is_missing(run)) {
      missing_ += run.output;
    } else {
      EXPECT_EQ(run.status, 0) << run.output;
    }
  }

  void expect_no_further_errors(const fs::path& derived) {
    if (!is_installed("dciodvfy") || !is_installed("dcentvfy")) {
      missing_ += "dicom3tools is not installed\n";
      return;
    }
    const Names before = dciodvfy_errors(as_ct(spread(files_of(series_)))),
                after = dciodvfy_errors(spread(files_in(derived)));
    for (const std::string& line : after) EXPECT_TRUE(before.contains(line)) << line;
    EXPECT_EQ(dcentvfy_errors(files_in(derived)), Names());
  }

  /// Without SOP Class UID dciodvfy does not know what to look for: copies that have one.
  std::vector<fs::path> as_ct(std::vector<fs::path> files) {
    if (!series_.slices.front().sop_instance_uid.empty()) return files;
    for (fs::path& file : files) {
      const fs::path copy = scratch_ / "copies" / file.filename();
      edit_copy(file, copy, [](DcmDataset& data) { data.putAndInsertString(DCM_SOPClassUID, UID_CTImageStorage); });
      file = copy;
    }
    return files;
  }

  void skip_where_readers_were_missing() {
    if (!missing_.empty() && !HasFailure()) GTEST_SKIP() << missing_;
  }

  const Scratch scratch_;
  fs::path input_;
  int number_ = GetParam().number;
  DicomSeries series_;
  std::string missing_;
};

void expect_same(const Volume<std::int16_t>& expected, const Volume<std::int16_t>& found) {
  EXPECT_TRUE(same_grid(expected.geometry, found.geometry, 1e-4));
  EXPECT_TRUE(expected.voxels == found.voxels);
}

/// A folder of links to files: these slices, and nothing beside them.
void link_all(const std::vector<fs::path>& files, const fs::path& folder) {
  fs::create_directory(folder);
  for (std::size_t n = 0; n < files.size(); ++n) fs::create_symlink(fs::absolute(files[n]), folder / std::to_string(n));
}

/// What is written depends on headers and voxels: slices that differ in their coding alone are left out, and of most
/// long series some slices are taken.
class WavedDicom : public GoodDicom {
 protected:
  void SetUp() override {
    GoodDicom::SetUp();
    if (!GetParam().thinned || IsSkipped() || HasFatalFailure()) return;
    constexpr std::ptrdiff_t kTaken = 12;
    const std::vector<fs::path> files = files_of(series_);
    ASSERT_GT(std::ssize(files), kTaken);
    const auto first = files.begin() + (std::ssize(files) - kTaken) / 2;
    input_ = scratch_ / "taken";
    link_all({first, first + kTaken}, input_);
    number_ = 1;
    series_ = only_series(input_);
  }
};

std::vector<GoodInput> unlike(std::vector<GoodInput> inputs) {
  std::erase_if(inputs, [](const GoodInput& input) { return input.alike; });
  return inputs;
}

TEST_P(WavedDicom, AWaveIsReadBackByOthersAsItWasComputed) {
  ASSERT_NO_FATAL_FAILURE(deform(std::string(kWave) + " --cell-size 8", "wave"));
  ASSERT_NO_FATAL_FAILURE(deform(std::string(kWave) + " --cell-size 8", "wave.nii"));
  const DicomVolume source = load_dicom(series_);
  const Volume<std::int16_t> truth = waved(source.volume, source.padding ? source.padding->low : -1024, source.padding);
  ASSERT_FALSE(truth.voxels == source.volume.voxels);
  {
    SCOPED_TRACE("DCMTK");
    expect_same(truth, read_with_dcmtk(scratch_ / "wave"));
  }
  {
    SCOPED_TRACE("ITK");
    expect_same(truth, read_with_itk(scratch_ / "wave"));
  }
  write_expected(truth, scratch_ / "truth.json");
  expect_agreement("pydicom", "wave", "truth.json");
  expect_agreement("nibabel", "wave.nii", "truth.json");
  expect_agreement("dcm2niix", "wave", "wave.nii");  // its arithmetic of places is single precision
  expect_no_further_errors(scratch_ / "wave");
  skip_where_readers_were_missing();
}

TEST_P(GoodDicom, IdentityIsWhatDcm2niixMakesOfTheSource) {
  ASSERT_NO_FATAL_FAILURE(deform("identity", "identity.nii.gz"));
  link_all(files_of(series_), scratch_ / "links");
  const char* known = GetParam().dcm2niix;
  if (!known) {
    expect_agreement("dcm2niix", "links", "identity.nii.gz");
  } else if (const test::Run run = check_geometry("dcm2niix", scratch_ / "links", scratch_ / "identity.nii.gz");
             is_missing(run)) {
    missing_ += run.output;
  } else {
    EXPECT_NE(run.status, 0) << "it agrees: docs/reference/dicom-cases.md says that it does not";
    EXPECT_NE(run.output.find(known), std::string::npos) << run.output;
  }
  skip_where_readers_were_missing();
}

const auto kName = [](const testing::TestParamInfo<GoodInput>& input) { return input.param.name; };
INSTANTIATE_TEST_SUITE_P(Series, GoodDicom, testing::ValuesIn(good_series()), kName);
INSTANTIATE_TEST_SUITE_P(Slices, GoodDicom, testing::ValuesIn(good_slices()), kName);
INSTANTIATE_TEST_SUITE_P(Series, WavedDicom, testing::ValuesIn(good_series()), kName);
INSTANTIATE_TEST_SUITE_P(Slices, WavedDicom, testing::ValuesIn(unlike(good_slices())), kName);

class GoodFile : public testing::TestWithParam<GoodInput> {};

TEST_P(GoodFile, AWaveAsNiftiIsReadBackAsItWasComputed) {
  TETWARP_REAL_DATA(set, GetParam().at.begin()->string());
  const Scratch scratch;
  const fs::path file = test_data() / GetParam().at;
  const ::Outcome run = run_tetwarp(scratch.path(), "deform '" + file.string() + "' -f " + kWave +
                                                        " --cell-size 8 --background -1024 -o wave.nii --quiet");
  ASSERT_EQ(run.status, 0) << run.err;
  const AnyVolume source = read_image(file);
  Volume<std::int16_t> truth;
  dispatch(source.type(), [&](auto value) {
    using V = decltype(value);
    const std::span<const V> voxels = source.as<V>();
    const Volume<V> volume = waved(Volume<V>{source.geometry(), {voxels.begin(), voxels.end()}}, -1024);
    truth = {volume.geometry, {volume.voxels.begin(), volume.voxels.end()}};
  });
  write_expected(truth, scratch / "truth.json");
  const test::Run seen = check_geometry("nibabel", scratch / "wave.nii", scratch / "truth.json");
  if (is_missing(seen)) GTEST_SKIP() << seen.output;
  EXPECT_EQ(seen.status, 0) << seen.output;
}

INSTANTIATE_TEST_SUITE_P(Files, GoodFile, testing::ValuesIn(good_files()), kName);

}  // namespace
}  // namespace tetwarp::test
