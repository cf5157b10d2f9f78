// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// What the command line promises: exit statuses, messages, outputs that appear whole or not at all.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "cuda/devices.h"
#include "tests/support/program.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace {

constexpr const char* kPhantom = "phantom --size 24,20,16 --spacing 4,4,5 --quiet -o ";

/// Files of a folder but for the captured output.
std::size_t count_files(const Scratch& scratch) {
  std::size_t count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(scratch.path())) {
    count += entry.path().filename() != ".stdout" && entry.path().filename() != ".stderr";
  }
  return count;
}

/// An error is one line `tetwarp: error: ...` that names what it is about.
void expect_error(const Outcome& run, int status, const std::string& names) {
  EXPECT_EQ(run.status, status) << run.err;
  EXPECT_EQ(run.err.rfind("tetwarp: error: ", 0), 0u) << run.err;
  EXPECT_NE(run.err.find(names), std::string::npos) << run.err;
  EXPECT_EQ(run.out, "");
}

TEST(Program, SaysItsVersionAndBackends) {
  const Scratch scratch;
  const Outcome run = run_tetwarp(scratch.path(), "--version");
  EXPECT_EQ(run.status, 0);
  EXPECT_EQ(run.out.rfind("tetwarp 0.", 0), 0u) << run.out;
  EXPECT_NE(run.out.find("cpu: usable"), std::string::npos) << run.out;
}

TEST(Program, EverySubcommandHasHelpWithAnExample) {
  const Scratch scratch;
  for (const std::string command : {"phantom", "info", "deform", "field"}) {
    const Outcome run = run_tetwarp(scratch.path(), command + " --help");
    EXPECT_EQ(run.status, 0) << command;
    EXPECT_NE(run.out.find("Example: tetwarp " + command), std::string::npos) << run.out;
  }
}

TEST(Program, WrongCommandLinesExitWithTwoAndWriteNothing) {
  const Scratch scratch;
  ASSERT_EQ(run_tetwarp(scratch.path(), kPhantom + std::string("in.nii")).status, 0);
  const struct {
    const char *arguments, *names;
  } kCases[] = {{"", "subcommand"},
                {"deform in.nii -f identity", "--output"},
                {"deform in.nii -o out.nii", "no field"},
                {"deform in.nii -f identity -o out.foo", "out.foo"},
                {"deform in.nii -f identity -o out_folder", "in.nii"},
                {"deform in.nii -f identity -o in.nii --overwrite", "in.nii"},
                {"deform in.nii -f wave:amplitude=8 -o out.nii", "wavelength"},
                {"deform in.nii -f wave:amplitude=8,wavelength=x -o out.nii", "wavelength"},
                {"deform in.nii -f nonsense -o out.nii", "nonsense"},
                {"deform in.nii -f identity --pull-field in.nii -o out.nii", "pull-field"},
                {"deform in.nii -f identity --cell-size 0 -o out.nii", "cell-size"},
                {"deform in.nii -f identity --interpolation quintic -o out.nii", "quintic"},
                {"deform in.nii -f identity -o out.nii --compress 3", "--compress"},
                {"deform in.nii -f identity -o out.nii --coverage out.nii", "out.nii"},
                {"deform in.nii -f identity -o out.nii --no-such-option", "no-such-option"},
                {"deform in.nii -f identity -o out.nii --background nan", "--background"},
                {"deform in.nii -f identity -o out.nii --background 40000", "40000"},
                {"deform in.nii -f identity -o out.nii --preview look.jpg", "look.jpg"},
                {"deform in.nii -f identity -o out.nii --series 1", "--series"},
                {"deform in.nii -f identity -o out.nii --grid nothing", "nothing"},
                {"deform in.nii --pull-field in.nii -o out.nii --grid fit", "--grid"},
                {"deform in.nii -f identity -o out.nii --with in.nii", "in.nii"},
                {"deform in.nii -f identity -o out.nii --with in.nii=with", "with"},
                {"deform in.nii -f identity -o out.nii --with in.nii=out.nii", "out.nii"},
                {"deform in.nii -f identity -o out.nii --with in.nii=b.nii:quintic", "quintic"},
                {"deform in.nii -f identity -o out.nii --with in.nii=b.nii:background=40000", "40000"},
                {"phantom -o out.nii --size 1,20,16", "--size"},
                {"phantom -o out.nii --spacing 0,1,1", "--spacing"},
                {"phantom -o out.nii --spacing 1e-9,1,1", "--spacing has 1e-09"},
                {"field identity --like in.nii -o out.txt", "out.txt"}};
  for (const auto& test : kCases) {
    SCOPED_TRACE(test.arguments);
    expect_error(run_tetwarp(scratch.path(), test.arguments), 2, test.names);
    EXPECT_EQ(count_files(scratch), 1u);
  }
}

TEST(Program, UnusableInputsExitWithFourAndWriteNothing) {
  const Scratch scratch;
  ASSERT_EQ(run_tetwarp(scratch.path(), kPhantom + std::string("in.nii")).status, 0);
  const std::string whole = read_text(scratch / "in.nii");
  write_file(scratch / "short.nii", whole.substr(0, whole.size() / 2));
  write_file(scratch / "junk.nii.gz", "not gzip");
  write_file(scratch / "empty.mha", "");
  std::filesystem::create_directory(scratch / "folder");
  write_file(scratch / "folder/readme.txt", "no DICOM");
  const std::size_t files = count_files(scratch);
  const struct {
    const char *arguments, *names;
  } kCases[] = {{"deform missing.nii -f identity -o out.nii", "missing.nii"},
                {"deform missing_folder -f identity -o out.nii", "missing_folder"},
                {"deform short.nii -f identity -o out.nii", "short.nii"},
                {"deform junk.nii.gz -f identity -o out.nii", "junk.nii.gz"},
                {"deform empty.mha -f identity -o out.nii", "empty.mha"},
                {"deform folder -f identity -o out.nii", "folder"},
                {"deform in.nii -f in.nii -o out.nii", "in.nii"},
                {"info missing.nii", "missing.nii"}};
  for (const auto& test : kCases) {
    SCOPED_TRACE(test.arguments);
    expect_error(run_tetwarp(scratch.path(), test.arguments), 4, test.names);
    EXPECT_EQ(count_files(scratch), files);
  }
}

TEST(Program, FailuresExitWithOneAndLoseNothing) {
  const Scratch scratch;
  ASSERT_EQ(run_tetwarp(scratch.path(), kPhantom + std::string("in.nii")).status, 0);
  write_file(scratch / "out.nii", "precious");
  expect_error(run_tetwarp(scratch.path(), "deform in.nii -f identity -o out.nii"), 1, "out.nii exists");
  EXPECT_EQ(read_text(scratch / "out.nii"), "precious");
  expect_error(run_tetwarp(scratch.path(), "deform in.nii -f identity -o out.nii --dry-run"), 1, "out.nii exists");
  expect_error(run_tetwarp(scratch.path(), "deform in.nii -f identity -o no_folder/out.nii"), 1, "no_folder");
  expect_error(run_tetwarp(scratch.path(), "deform in.nii -f identity -o new.nii --backend cpu --memory 1M"), 1,
               "--memory");
  std::filesystem::create_directory(scratch / "other");
  write_file(scratch / "other/letter.txt", "precious");
  expect_error(run_tetwarp(scratch.path(), kPhantom + std::string("other --overwrite")), 1, "other");
  EXPECT_EQ(read_text(scratch / "other/letter.txt"), "precious");
  EXPECT_EQ(count_files(scratch), 3u);
}

TEST(Program, CudaByNameFailsWhereNoDeviceIsAndAutoUsesTheCpu) {
  if (tetwarp::cuda_device_count() > 0) GTEST_SKIP() << "this machine has a CUDA device";
  const Scratch scratch;
  ASSERT_EQ(run_tetwarp(scratch.path(), kPhantom + std::string("in.nii")).status, 0);
  expect_error(run_tetwarp(scratch.path(), "deform in.nii -f identity -o out.nii --backend cuda"), 1, "CUDA");
  EXPECT_EQ(count_files(scratch), 1u);
  const Outcome run = run_tetwarp(scratch.path(), "deform in.nii -f identity -o out.nii --backend auto");
  EXPECT_EQ(run.status, 0);
  EXPECT_NE(run.err.find("backend cpu"), std::string::npos) << run.err;
}

TEST(Program, AFullDiskFailsAndLeavesNothing) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full on this machine";
  const Scratch scratch;
  ASSERT_EQ(run_tetwarp(scratch.path(), kPhantom + std::string("in.nii")).status, 0);
  // A file size limit stands in for a full disk: writes beyond it fail.
  const std::string limited =
      "sh -c 'trap \"\" XFSZ; ulimit -f 8; exec \"" TETWARP_PROGRAM "\" deform in.nii -f identity -o out.nii'";
  const int status =
      std::system(("cd '" + scratch.path().string() + "' && " + limited + " > .stdout 2> .stderr").c_str());
  EXPECT_EQ(WEXITSTATUS(status), 1);
  const std::string said = read_text(scratch / ".stderr");
  EXPECT_EQ(said.rfind("tetwarp: error: ", 0), 0u) << said;
  EXPECT_EQ(said.find("partial"), std::string::npos) << "names the place where it was staged: " << said;
  EXPECT_EQ(count_files(scratch), 1u);
}

TEST(Program, StandardOutputThatCannotBeWrittenFails) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full on this machine";
  const Scratch scratch;
  ASSERT_EQ(run_tetwarp(scratch.path(), kPhantom + std::string("in.nii")).status, 0);
  for (const std::string arguments : {"info in.nii", "info in.nii --json", "--version", "deform --help"}) {
    const int status = std::system(
        ("cd '" + scratch.path().string() + "' && \"" TETWARP_PROGRAM "\" " + arguments + " > /dev/full 2> .stderr")
            .c_str());
    EXPECT_EQ(WEXITSTATUS(status), 1) << arguments;
  }
}

TEST(Program, ADicomOutputNeverLandsAmongTheSlicesOfItsSource) {
  const Scratch scratch;
  ASSERT_EQ(run_tetwarp(scratch.path(), kPhantom + std::string("in")).status, 0);
  const auto first = std::filesystem::directory_iterator(scratch / "in")->path().filename().string();
  expect_error(run_tetwarp(scratch.path(), "deform in/" + first + " -f identity -o in/derived"), 2, "in/derived");
  expect_error(run_tetwarp(scratch.path(), "deform in -f identity -o in/derived"), 2, "in/derived");
  EXPECT_EQ(run_tetwarp(scratch.path(), "deform in/" + first + " -f identity -o derived").status, 0);
  EXPECT_FALSE(std::filesystem::exists(scratch / "in/derived"));
}

TEST(Program, ABrokenEndSliceIsNotPassedOver) {
  const Scratch scratch;
  ASSERT_EQ(run_tetwarp(scratch.path(), kPhantom + std::string("in")).status, 0);
  std::filesystem::resize_file(scratch / "in/IM00001.dcm", 100);
  expect_error(run_tetwarp(scratch.path(), "deform in -f identity -o out.nii"), 4, "IM00001.dcm");
}

TEST(Program, WithoutDcmtksDictionaryDicomIsRefusedByName) {
  const Scratch scratch;
  ASSERT_EQ(run_tetwarp(scratch.path(), std::string(kPhantom) + "series").status, 0);
  ASSERT_EQ(setenv("DCMDICTPATH", "/nonexistent/dicom.dic", 1), 0);
  const Outcome read = run_tetwarp(scratch.path(), "deform series -f identity -o out.nii");
  const Outcome written = run_tetwarp(scratch.path(), std::string(kPhantom) + "other");
  unsetenv("DCMDICTPATH");
  expect_error(read, 1, "DCMDICTPATH");
  expect_error(written, 1, "DCMDICTPATH");
  EXPECT_FALSE(std::filesystem::exists(scratch.path() / "other"));
}

TEST(Program, QuietIsSilentAndTheDryRunWritesNothing) {
  const Scratch scratch;
  EXPECT_EQ(run_tetwarp(scratch.path(), kPhantom + std::string("in.nii")).err, "");
  const Outcome quiet = run_tetwarp(scratch.path(), "deform in.nii -f twist:angle=20 -o out.nii --quiet");
  EXPECT_EQ(quiet.status, 0);
  EXPECT_EQ(quiet.err + quiet.out, "");
  const std::size_t files = count_files(scratch);
  const Outcome dry = run_tetwarp(scratch.path(), "deform in.nii -f twist:angle=20 -o other.nii --dry-run");
  EXPECT_EQ(dry.status, 0);
  EXPECT_NE(dry.err.find("would write other.nii"), std::string::npos) << dry.err;
  EXPECT_EQ(count_files(scratch), files);
}

TEST(Program, InfoDescribesVolumesAndFieldsAsOneJsonDocument) {
  const Scratch scratch;
  ASSERT_EQ(run_tetwarp(scratch.path(), kPhantom + std::string("in.mha")).status, 0);
  ASSERT_EQ(run_tetwarp(scratch.path(), "field twist:angle=20 --like in.mha --cell-size 4 -o twist.nrrd").status, 0);
  const auto volume = nlohmann::json::parse(run_tetwarp(scratch.path(), "info in.mha --json").out);
  EXPECT_EQ(volume["kind"], "volume");
  EXPECT_EQ(volume["voxel_type"], "int16");
  EXPECT_EQ(volume["geometry"]["size"], nlohmann::json::array({24, 20, 16}));
  EXPECT_EQ(volume["geometry"]["spacing_mm"], nlohmann::json::array({4, 4, 5}));
  const auto field = nlohmann::json::parse(run_tetwarp(scratch.path(), "info twist.nrrd --json").out);
  EXPECT_EQ(field["kind"], "field");
  EXPECT_EQ(field["direction"], "forward");
  EXPECT_EQ(field["lattice"]["size"], nlohmann::json::array({7, 6, 5}));
}

}  // namespace
