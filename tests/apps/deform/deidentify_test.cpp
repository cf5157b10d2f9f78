// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// De-identification on the command line, and a hostile reading of all that it leaves.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "io/dicom_series.h"
#include "tests/support/dicom/dicom_maker.h"
#include "tests/support/program.h"
#include "tests/support/real_data.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace fs = std::filesystem;

namespace tetwarp::test {
namespace {

class DeidentifyOption : public testing::Test {
 protected:
  DeidentifyOption() {
    write_stack(scratch_ / "in", 4);
    write_file(scratch_ / "key", std::string(32, 'k') + "\n");
  }
  Outcome deform(const std::string& options) const {
    return run_tetwarp(scratch_.path(), "deform in -f translate:by=1/0/0 --outside rest " + options);
  }

  const Scratch scratch_;
};

TEST_F(DeidentifyOption, SaysWhatItDoesNotDo) {
  const Outcome run = deform("-o out --deidentify retain-device,shift-dates --deidentify-key key");
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_TRUE(
      says(run.err, {"de-identified by PS3.15 2026d, Basic Profile", "text in the pixels", "faces", "--points"}));
  std::ifstream file(scratch_ / "out.json");
  const nlohmann::json said = nlohmann::json::parse(file);
  EXPECT_EQ(said["options"]["dicom"]["deidentified"]["PS3.15 2026d"],
            nlohmann::json({"basic", "shift-dates", "retain-device"}));
  for (const char* key : {"path", "sha256", "series_instance_uid", "set_aside"})
    EXPECT_FALSE(said["input"].contains(key)) << key;
  EXPECT_EQ(said["output"]["series_instance_uid"], scan_dicom(scratch_ / "out").series.at(0).series_uid);
}

TEST_F(DeidentifyOption, GivesTheSameBytesForTheSameKey) {
  ASSERT_EQ(deform("-o one --deidentify basic --deidentify-key key").status, 0);
  ASSERT_EQ(deform("-o two --deidentify basic --deidentify-key key").status, 0);
  write_file(scratch_ / "key", std::string(32, 'l'));
  ASSERT_EQ(deform("-o three --deidentify basic --deidentify-key key").status, 0);
  EXPECT_EQ(run_program(scratch_.path(), "diff", "-r one two").status, 0);
  EXPECT_NE(run_program(scratch_.path(), "diff", "-r one three").status, 0);
}

TEST_F(DeidentifyOption, IsRefusedWhereItCannotBeDone) {
  const auto refused = [&](const std::string& options, int status, std::vector<std::string> words) {
    const Outcome run = deform(options);
    EXPECT_EQ(run.status, status) << options;
    EXPECT_TRUE(says(run.err, words));
    EXPECT_FALSE(fs::exists(scratch_ / "out"));
  };
  refused("-o out --deidentify basic", 2, {"--deidentify-key"});
  refused("-o out --deidentify-key key", 2, {"--deidentify"});
  refused("-o out --deidentify retain-all --deidentify-key key", 2, {"unknown option", "retain-all", "retain-dates"});
  refused("-o out --deidentify clean-graphics --deidentify-key key", 2, {"clean-graphics"});
  refused("-o out --deidentify basic --deidentify-key none", 4, {"none", "openssl rand"});
  write_file(scratch_ / "short", "secret");
  refused("-o out --deidentify basic --deidentify-key short", 4, {"6 bytes", "16"});
  refused("-o out.nii --deidentify basic --deidentify-key key", 2, {"for a DICOM series", "out.nii"});
}

using Case = std::pair<const char*, const char*>;

class HostileReading : public testing::TestWithParam<Case> {};

TEST_P(HostileReading, FindsNothingThatTheOptionsDoNotAllow) {
  const auto& [set, options] = GetParam();
  TETWARP_REAL_DATA(folder, set);
  const Scratch scratch;
  write_file(scratch / "key", std::string(32, 'k'));
  const std::string source = "'" + folder.string() + "'";
  const Outcome run = run_tetwarp(
      scratch.path(), "deform " + source +
                          " -f wave:amplitude=4,wavelength=90 --cell-size 8 --outside rest "
                          "-o out --inverse reg.dcm --report report.json --deidentify-key key --deidentify " +
                          options);
  ASSERT_EQ(run.status, 0) << run.err;
  write_file(scratch / "messages.txt", run.out + run.err);
  const Outcome search = run_program(scratch.path(), TETWARP_PYTHON,
                                     std::string(TETWARP_HOSTILE_SEARCH) + " " + source + " " + options +
                                         " out reg.dcm out.json report.json messages.txt");
  if (search.err.find("No module named 'pydicom'") != std::string::npos) GTEST_SKIP() << "pydicom is not installed";
  EXPECT_EQ(search.status, 0) << search.out << search.err;
}

INSTANTIATE_TEST_SUITE_P(Sets, HostileReading,
                         testing::Values(Case("overlap-kits-and-topogram/kits-00072", "basic"),
                                         Case("overlap-kits-and-topogram/kits-00072", "retain-dates,retain-device"),
                                         Case("abdomen-acrin-flt", "retain-patient,retain-uids"),
                                         Case("head-phantom-multiseries/S21570/S2020",
                                              "retain-institution,shift-dates"),
                                         Case("tilt-uniform-philips", "basic")));

}  // namespace
}  // namespace tetwarp::test
