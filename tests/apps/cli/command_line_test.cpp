// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Words of the command line: numbers that are none, commands that there are not, sizes of memory.
#include "tests/apps/batch/batch_case.h"

namespace {

using namespace tetwarp::test;

class CommandLine : public BatchCase {
 protected:
  void expect_wrong(const std::string& arguments, const std::vector<std::string>& words) const {
    const Outcome made = run(arguments);
    EXPECT_EQ(made.status, 2) << arguments << "\n" << made.err;
    EXPECT_TRUE(says(made.err, words)) << arguments;
    EXPECT_LT(made.err.size(), 250u) << made.err;
    EXPECT_EQ(std::count(made.err.begin(), made.err.end(), '\n'), 1) << made.err;
    EXPECT_EQ(made.out, "") << arguments;
  }
};

TEST_F(CommandLine, AWordThatIsNoCommandIsRefusedBesideHelpToo) {
  for (const char* words : {"NOSUCH", "NOSUCH --help", "--help NOSUCH", "NOSUCH --version", "NOSUCH deform --help"})
    expect_wrong(words, {"NOSUCH", "tetwarp --help"});
  for (const char* words : {"--help", "deform --help", "--version"}) EXPECT_EQ(run(words).status, 0) << words;
}

TEST_F(CommandLine, EveryNumberThatIsNoneIsRefusedInAShortLine) {
  const std::string deform = "deform ct.nrrd -f identity -o o.nii ", render = "render ct.nrrd -o o.png ",
                    simulate = "simulate s.json ct.nrrd -o o.mha ", batch = "batch m.csv -o out ",
                    phantom = "phantom -o o.nii ";
  const std::string options[] = {
      deform + "--threads",   deform + "--device",    deform + "--cell-size",     deform + "--background",
      deform + "--compress",  deform + "--memory",    deform + "--series-number", render + "--angle",
      render + "--elevation", render + "--zoom",      render + "--step",          render + "--window",
      render + "--level",     render + "--fill",      render + "--turntable",     render + "--frames",
      render + "--rate",      render + "--cell-size", simulate + "--every",       batch + "--jobs",
      batch + "--memory",     batch + "--threads",    phantom + "--seed"};
  for (const std::string& option : options) {
    const std::string name = option.substr(option.rfind("--"));
    for (const char* value : {"nan", "inf", "-inf", "''", "1e999", "four", "0x", "' '", "1,5"})
      expect_wrong(option + "=" + value, {name});
  }
  for (const std::string& option : options) {
    const std::string name = option.substr(option.rfind("--"));
    if (name == "--background" || name == "--fill" || name == "--level" || name == "--angle" || name == "--elevation")
      continue;
    expect_wrong(option + "=-1", {name});
    if (name != "--zoom" && name != "--window" && name != "--seed" && name != "--memory")
      expect_wrong(option + "=99999999999999999999", {name});
  }
  for (const char* values : {"--size 1,2,3", "--size nan,4,4", "--size 4,4,99999", "--size 4,4,-4", "--spacing 1,1,nan",
                             "--spacing 0,1,1", "--spacing 1,1,inf", "--spacing 1,1,1e999", "--spacing 1e-9,1,1",
                             "--spacing 1,9e-7,1", "--spacing 1,1,1000001"})
    expect_wrong(phantom + values, {std::string(values).substr(0, 6)});
  for (const char* values : {"--size 15,99", "--size nan,99", "--position nan/0/0", "--position 0/inf/0"})
    expect_wrong(render + values, {std::string(values).substr(0, 6)});
}

TEST_F(CommandLine, AChoiceIsANameNoNumberAndTheRefusalListsTheNames) {
  const std::string deform = "deform ct.nrrd -f identity -o o.nii ";
  for (const char* word : {"LINEAR", "1", "0", "7", "-1", "lin"}) {
    expect_wrong(deform + "--interpolation=" + word, {"--interpolation", word, "nearest,linear,cubic,vote"});
    expect_wrong(deform + "--outside=" + word, {"--outside", word, "refuse,rest,background"});
    expect_wrong(deform + "--transfer-syntax=" + word, {"--transfer-syntax", word, "explicit,deflated,rle,jpeg-ls"});
  }
}

TEST_F(CommandLine, AnEmptyTextIsNoValue) {
  for (const char* option : {"--report", "--preview", "--inverse", "--grid", "--with", "--series", "--labels"})
    expect_wrong("deform ct.nrrd -f identity -o o.nii " + std::string(option) + " ''", {option});
  expect_wrong("deform ct.nrrd -f identity -o ''", {"--output"});
  expect_wrong("deform '' -f identity -o o.nii", {"empty"});
}

TEST_F(CommandLine, AnOptionOfAFurtherVolumeIsGivenOnce) {
  for (const char* options : {":linear:nearest", ":background=1:background=2", ":cubic:cubic"})
    expect_wrong("deform ct.nrrd -f identity -o o.nii --with ct.nrrd=p.nii" + std::string(options),
                 {"--with has two of"});
}

TEST_F(CommandLine, ASizeMayHaveAFraction) {
  for (const char* size : {"2.5G", "2G", "0.5GB", "900M", "900MiB", "2.5 GiB", "1t", "2500000000"})
    EXPECT_EQ(run("deform ct.nrrd -f identity -o o.nii --dry-run --memory '" + std::string(size) + "'").status, 0)
        << size;
  for (const char* size : {"0", "-1G", "G", "2.5.1G", "2,5G", "1X", "1GG", "1Gib8", "0.0001K", "1e9G", "99999999T"})
    expect_wrong("deform ct.nrrd -f identity -o o.nii --dry-run --memory '" + std::string(size) + "'", {"--memory"});
  for (const auto& [size, shown] :
       {std::pair("0.1G", "100 MB"), std::pair("0.1GB", "100 MB"), std::pair("0.1Gi", "107 MB"),
        std::pair("100MiB", "105 MB"), std::pair("90000K", "90 MB"), std::pair("0.0001t", "100 MB")}) {
    const Outcome little = run("deform ct.nrrd -f identity -o o.nii --backend cpu --memory " + std::string(size));
    EXPECT_EQ(little.status, 1) << size;
    EXPECT_TRUE(says(little.err, {"--memory allows " + std::string(shown)})) << size;
  }
}

TEST_F(CommandLine, ABackendWithoutADeviceIsRefusedInALineThatNamesNoFolder) {
  if (run("--version").out.find("cuda: usable") != std::string::npos) GTEST_SKIP() << "cuda: a device";
  write_file(scratch_ / "push.json",
             R"({"method": "mass-spring", "cell_size": 4, "tissues": [{"name": "all"}], "hold": [{"border": true}],
                 "move": [{"name": "hand", "by_mm": [0, 5, 0], "handle": {"at": {"body": [0.5, 0.3, 0.5]}, "radius_mm": 20}}]})");
  for (const char* command : {"deform ct.nrrd -f identity -o o.nii", "invert twist:angle=3 --like ct.nrrd -o o.mha",
                              "simulate push.json ct.nrrd -o o.mha", "render ct.nrrd -o o.png"}) {
    const Outcome made = run(command + std::string(" --backend cuda"));
    EXPECT_EQ(made.status, 1) << command << made.err;
    EXPECT_TRUE(says(made.err, {"CUDA", "use --backend cpu"})) << command;
    EXPECT_EQ(made.err.find('/'), std::string::npos) << made.err;
    EXPECT_EQ(std::count(made.err.begin(), made.err.end(), '\n'), 1) << made.err;
  }
}

}  // namespace
