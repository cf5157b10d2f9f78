// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Whether good_inputs.cpp lists all of the real data that can be deformed, and nothing else.
#include "tests/apps/deform/good_inputs.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>

#include "io/dicom_series.h"
#include "io/image_file.h"
#include "tests/support/program.h"
#include "tests/support/scratch.h"

namespace tetwarp::test {
namespace {

namespace fs = std::filesystem;

using Names = std::set<std::string>;

Names names_of(const std::vector<GoodInput>& inputs) {
  Names names;
  for (const GoodInput& input : inputs) names.insert(input.at.string() + " " + std::to_string(input.number));
  return names;
}

/// Names of the inputs whose data set is there.
Names present(const std::vector<GoodInput>& inputs) {
  std::vector<GoodInput> found;
  for (const GoodInput& input : inputs) {
    if (fs::exists(test_data() / *input.at.begin())) found.push_back(input);
  }
  return names_of(found);
}

/// The series of a folder of which `tetwarp info` says that they can be deformed.
Names offered_in(const Scratch& scratch, const fs::path& folder) {
  const ::Outcome run = run_tetwarp(scratch.path(), "info --json '" + folder.string() + "'");
  const nlohmann::json info = nlohmann::json::parse(run.out);
  Names names;
  for (const auto& series : info.at("series")) {
    if (series.at("usable") && series.at("slices") > 1)
      names.insert(folder.filename().string() + " " + std::to_string(series.at("number").get<int>()));
  }
  return names;
}

/// The files of a folder that are one slice by themselves, and in no series of several.
Names lone_slices_in(const fs::path& folder) {
  std::set<fs::path> taken;
  for (const DicomSeries& series : scan_dicom(folder).series) {
    for (const DicomSlice& slice : series.slices) {
      if (!series.refusal && series.slices.size() > 1) taken.insert(slice.file);
    }
  }
  Names names;
  for (const auto& file : fs::recursive_directory_iterator(folder)) {
    if (!file.is_regular_file() || taken.contains(file.path())) continue;
    const DicomScan scan = scan_dicom(file.path(), true);
    if (scan.series.size() == 1 && !scan.series[0].refusal && scan.series[0].slices.size() == 1)
      names.insert(fs::relative(file, test_data()).string() + " 1");
  }
  return names;
}

Names volumes_in(const fs::path& folder) {
  Names names;
  for (const auto& file : fs::directory_iterator(folder)) {
    if (has_image_suffix(file.path()) && read_image_header(file.path()).components == 1)
      names.insert(fs::relative(file, test_data()).string() + " 1");
  }
  return names;
}

void expect_same_names(const Names& offered, const Names& listed) {
  for (const std::string& name : offered) EXPECT_TRUE(listed.contains(name)) << name << " is not in good_inputs.cpp";
  for (const std::string& name : listed) EXPECT_TRUE(offered.contains(name)) << name << " is not offered any more";
}

TEST(GoodInputs, AreAllThatIsOffered) {
  if (test_data().empty()) GTEST_SKIP() << "no real data: $TETWARP_TEST_DATA is not set";
  const Scratch scratch;
  Names series, slices, files;
  for (const auto& set : fs::directory_iterator(test_data())) {
    if (!set.is_directory()) continue;
    series.merge(offered_in(scratch, set));
    slices.merge(lone_slices_in(set));
    files.merge(volumes_in(set));
  }
  expect_same_names(series, present(good_series()));
  expect_same_names(slices, present(good_slices()));
  expect_same_names(files, present(good_files()));
}

}  // namespace
}  // namespace tetwarp::test
