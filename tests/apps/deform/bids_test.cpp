// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// `--bids`: a sidecar with the names of BIDS, beside dcm2niix's own of the same series.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "io/lower_case.h"
#include "tests/support/dicom/dicom_maker.h"
#include "tests/support/program.h"
#include "tests/support/real_data.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"

namespace {

using nlohmann::json;
namespace fs = std::filesystem;
using tetwarp::lower;

json read_json(const fs::path& path) { return json::parse(read_text(path)); }

/// dcm2niix shortens names of makers ("GE") and prints six digits.
bool agree(const json& ours, const json& theirs) {
  if (ours.is_number() && theirs.is_number())
    return std::abs(ours.get<double>() - theirs.get<double>()) <= 1e-5 * std::max(1.0, std::abs(ours.get<double>()));
  if (ours.is_array() && theirs.is_array())
    return std::equal(ours.begin(), ours.end(), theirs.begin(), theirs.end(), agree);
  if (ours.is_string() && theirs.is_string())
    return lower(ours.get<std::string>()).starts_with(lower(theirs.get<std::string>()));
  return ours == theirs;
}

/// The keys of both, but those that say who wrote the file; each has to agree.
std::set<std::string> shared_keys(const json& ours, const json& theirs, const std::set<std::string>& but) {
  std::set<std::string> keys;
  for (const auto& [key, value] : ours.items()) {
    if (!theirs.contains(key) || key.starts_with("ConversionSoftware") || but.contains(key)) continue;
    EXPECT_TRUE(agree(value, theirs[key])) << key << ": " << value << ", dcm2niix has " << theirs[key];
    keys.insert(key);
  }
  return keys;
}

/// What dcm2niix writes of the series of a folder that has a description.
json by_dcm2niix(const Scratch& scratch, const fs::path& folder, const std::string& description) {
  const fs::path out = scratch / "dcm2niix";
  fs::remove_all(out);
  fs::create_directory(out);
  run_program(scratch.path(), "dcm2niix", "-b o -o dcm2niix '" + folder.string() + "'");
  for (const auto& entry : fs::directory_iterator(out)) {
    if (entry.path().extension() != ".json") continue;
    const json found = read_json(entry.path());
    if (found.value("SeriesDescription", "") == description) return found;
  }
  ADD_FAILURE() << "dcm2niix wrote no sidecar of \"" << description << "\"";
  return {};
}

class BidsOfReal : public testing::TestWithParam<const char*> {};

TEST_P(BidsOfReal, AgreesWithDcm2niix) {
  TETWARP_REAL_DATA(folder, GetParam());
  const Scratch scratch;
  if (run_program(scratch.path(), "sh", "-c 'command -v dcm2niix'").status != 0)
    GTEST_SKIP() << "dcm2niix is not installed";
  const std::string deform = "deform '" + folder.string() +
                             "' --series 1 --quiet -f wave:amplitude=3,wavelength=90 "
                             "--cell-size 16 --outside background ";
  ASSERT_EQ(run_tetwarp(scratch.path(), deform + "-o a.nii --bids").status, 0);
  const json ours = read_json(scratch / "a.json");
  const std::string description = ours["SeriesDescription"];
  const std::set<std::string> keys = shared_keys(ours, by_dcm2niix(scratch, folder, description), {"ImageType"});
  EXPECT_GE(keys.size(), 8U);
  for (const char* key : {"Modality", "Manufacturer", "ManufacturersModelName", "PatientPosition", "ConvolutionKernel",
                          "ExposureTime", "ImageOrientationPatientDICOM"})
    EXPECT_TRUE(keys.contains(key)) << key;
  // For the derived series dcm2niix states the same image type, and that this is no raw image. (It takes model and
  // software from the item of Contributing Equipment, which names Tetwarp.)
  ASSERT_EQ(run_tetwarp(scratch.path(), deform + "-o out --series-description derived").status, 0);
  const json of_derived = by_dcm2niix(scratch, scratch / "out", "derived");
  const std::set<std::string> also =
      shared_keys(ours, of_derived, {"SeriesDescription", "ImageType", "ManufacturersModelName", "SoftwareVersions"});
  EXPECT_TRUE(also.contains("RawImage"));
  for (std::size_t n = 0; n < 3; ++n) EXPECT_EQ(ours["ImageType"][n], of_derived["ImageType"][n]);
}

INSTANTIATE_TEST_SUITE_P(Sets, BidsOfReal,
                         testing::Values("chest-cmb-crc", "abdomen-acrin-flt", "tilt-uniform-philips",
                                         "overlap-kits-and-topogram"),
                         [](const auto& set) {
                           std::string name = set.param;
                           std::erase(name, '-');
                           return name;
                         });

void make_series(const Scratch& scratch) {
  write_stack(scratch / "in", 4, [](int, MadeSlice& slice) {
    slice.edit = [](DcmDataset& data) {
      data.putAndInsertString(DCM_KVP, "120");
      data.putAndInsertString(DCM_ProtocolName, "of Secret");
      data.putAndInsertString(DCM_PatientBirthDate, "19501231");
      data.putAndInsertString(DCM_InstitutionName, "ELSEWHERE");
    };
  });
}

TEST(Bids, LiesBesideTheVolumeByItsStem) {
  const Scratch scratch;
  make_series(scratch);
  for (const std::string name : {"sub-01_ct.nii.gz", "sub-02_ct.nii"}) {
    ASSERT_EQ(run_tetwarp(scratch.path(), "deform in -f identity --bids -o " + name).status, 0);
    const std::string stem = name.substr(0, 9);
    EXPECT_EQ(read_json(scratch / (stem + ".json"))["KVP"], 120);
    EXPECT_EQ(read_json(scratch / (name + ".json"))["bids"], stem + ".json");
  }
  EXPECT_TRUE(read_text(scratch / "sub-01_ct.json") == read_text(scratch / "sub-02_ct.json"));
  ASSERT_EQ(run_tetwarp(scratch.path(), "deform in -f identity -o plain.nii").status, 0);
  EXPECT_FALSE(fs::exists(scratch / "plain.json"));
}

TEST(Bids, NamesNobody) {
  const Scratch scratch;
  make_series(scratch);
  ASSERT_EQ(run_tetwarp(scratch.path(), "deform in -f identity --bids -o a.nii").status, 0);
  json found = read_json(scratch / "a.json");
  found.erase("ConversionSoftwareVersion");  // a commit may have any digits
  const std::string text = found.dump();
  EXPECT_NE(text.find("KVP"), std::string::npos);
  for (const char* word : {"SECRET", "Secret", "NAME", "1950", "ELSEWHERE", "1.2.3"})
    EXPECT_EQ(text.find(word), std::string::npos) << word;
}

TEST(Bids, IsForNiftiOfASeries) {
  const Scratch scratch;
  make_series(scratch);
  ASSERT_EQ(run_tetwarp(scratch.path(), "deform in -f identity -o a.nii").status, 0);
  const auto expect_refused = [&](const std::string& arguments, const std::string& word) {
    const Outcome run = run_tetwarp(scratch.path(), arguments);
    EXPECT_EQ(run.status, 2) << arguments;
    EXPECT_TRUE(says(run.err, {word}));
  };
  expect_refused("deform in -f identity --bids -o b.mha", "--bids is for .nii and .nii.gz");
  expect_refused("deform in -f identity --bids -o b", "--bids is for .nii and .nii.gz");
  expect_refused("deform a.nii -f identity --bids -o b.nii", "a.nii has none");
  expect_refused("deform in -f identity --bids -o b.nii --report b.json", "two outputs");
  const auto before = fs::last_write_time(scratch / "a.nii");
  std::ofstream(scratch / "a.json") << "mine";
  const Outcome run = run_tetwarp(scratch.path(), "deform in -f identity --bids -o c.nii --overwrite");
  EXPECT_EQ(run.status, 0) << run.err;
  EXPECT_EQ(run_tetwarp(scratch.path(), "deform in -f identity --bids -o a.nii").status, 1);
  EXPECT_EQ(read_text(scratch / "a.json"), "mine");
  EXPECT_EQ(fs::last_write_time(scratch / "a.nii"), before);
}

}  // namespace
