// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Nothing that a command reads is written over, whatever it is called.
#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>

#include "tests/support/field_texts.h"
#include "tests/support/program.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/transforms.h"
#include "tests/support/write_file.h"

namespace {

namespace fs = std::filesystem;

/// Files of all kinds that commands read.
class WhatIsRead : public testing::Test {
 protected:
  void SetUp() override {
    const std::string phantom = "phantom --size 24,20,16 --spacing 12,12,14 --quiet -o ";
    ASSERT_EQ(run(phantom + "ct.nii.gz").status, 0);
    ASSERT_EQ(run(phantom + "series").status, 0);
    write_file(scratch_ / "first.txt", translation("NoInitialTransform"));
    write_file(scratch_ / "second.txt", translation("first.txt"));
    write_file(scratch_ / "third.txt", translation("second.txt"));
    write_file(scratch_ / "rest.msh", tetrahedron(0));
    write_file(scratch_ / "deformed.msh", tetrahedron(3));
    write_file(scratch_ / "key", "a secret of more than sixteen bytes");
    write_file(scratch_ / "p.csv", "x,y,z\n1,2,3\n");
    write_file(scratch_ / "push.json",
               R"({"method": "mass-spring", "cell_size": 4, "tissues": [{"name": "all"}], "hold": [{"border": true}],
  "move": [{"name": "hand", "by_mm": [0, 5, 0], "handle": {"at": {"body": [0.5, 0.3, 0.5]}, "radius_mm": 30}}]})");
    write_file(
        scratch_ / "look.json",
        R"({"points": [{"value": 150, "colour": "#c02818", "opacity": 0}, {"value": 300, "colour": "#f07850", "opacity": 0.4}]})");
    fs::create_hard_link(scratch_ / "ct.nii.gz", scratch_ / "hard.nii.gz");
    fs::create_hard_link(scratch_ / "look.json", scratch_ / "look.png");
    fs::create_directory(scratch_ / "far");
    fs::create_directory_symlink(scratch_ / "far", scratch_ / "link");
    fs::rename(scratch_ / "series/IM00005.dcm", scratch_ / "far/IM00005.dcm");
    fs::create_symlink(scratch_ / "far/IM00005.dcm", scratch_ / "series/IM00005.dcm");
  }

  Outcome run(const std::string& arguments) const { return run_tetwarp(scratch_.path(), arguments); }
  std::map<std::string, std::string> files() const {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(scratch_.path())) {
      const std::string name = entry.path().lexically_relative(scratch_.path()).string();
      if (entry.is_regular_file() && !name.starts_with(".std")) files[name] = read_text(entry.path());
    }
    return files;
  }
  /// Whether a command ends with status 2, names what it would write over, and changes no file.
  testing::AssertionResult is_refused(const std::string& arguments, const std::string& input) const {
    const auto before = files();
    const Outcome refused = run(arguments + " --overwrite");
    if (refused.status != 2)
      return testing::AssertionFailure() << arguments << ": status " << refused.status << ", " << refused.err;
    if (files() != before) return testing::AssertionFailure() << arguments << ": a file was changed";
    return says(refused.err, {"is, is inside, or is around the input " + input});
  }

  Scratch scratch_;
};

TEST_F(WhatIsRead, IsNotWrittenOverByDeform) {
  const std::string identity = "deform ct.nii.gz -f identity -o out.nii.gz ";
  EXPECT_TRUE(is_refused("deform ct.nii.gz -f identity -o hard.nii.gz", "ct.nii.gz"));
  EXPECT_TRUE(is_refused("deform ct.nii.gz -f identity -o link/../ct.nii.gz", "ct.nii.gz"));
  EXPECT_TRUE(is_refused("deform ct.nii.gz -f rest.msh:deformed=deformed.msh -o out.nii.gz --report deformed.msh",
                         "deformed.msh"));
  EXPECT_TRUE(
      is_refused("deform series -f identity -o out --deidentify basic --deidentify-key key --report key", "key"));
  EXPECT_TRUE(is_refused(identity + "--points p.csv=q.csv --report p.csv", "p.csv"));
  EXPECT_TRUE(is_refused(identity + "--with hard.nii.gz=with.nii.gz --report link/../hard.nii.gz", "hard.nii.gz"));
  EXPECT_TRUE(is_refused("deform ct.nii.gz --scenario push.json -o out.nii.gz --report push.json", "push.json"));
  EXPECT_TRUE(is_refused(
      "deform ct.nii.gz --scenario push.json --labels series/IM00001.dcm -o out.nii.gz --report series/IM00002.dcm",
      "series/IM00002.dcm"));
}

TEST_F(WhatIsRead, CountsSlicesBesideASingleFileAndBehindLinks) {
  const std::string identity = "deform ct.nii.gz -f identity -o out.nii.gz ";
  EXPECT_TRUE(is_refused("deform series/IM00001.dcm -f identity -o out.nii.gz --report series/IM00002.dcm",
                         "series/IM00002.dcm"));
  EXPECT_TRUE(is_refused("deform series -f identity -o out.nii.gz --report far/IM00005.dcm", "series/IM00005.dcm"));
  EXPECT_TRUE(is_refused(identity + "--with series=with.nii.gz --report far/IM00005.dcm", "series/IM00005.dcm"));
  EXPECT_TRUE(
      is_refused(identity + "--with series/IM00001.dcm=with.nii.gz --report series/IM00003.dcm", "series/IM00003.dcm"));
  EXPECT_TRUE(is_refused(identity + "--grid series/IM00001.dcm --outside background --report series/IM00003.dcm",
                         "series/IM00003.dcm"));
  const Outcome beside = run("deform series/IM00001.dcm -f identity -o series/out.nii.gz");
  EXPECT_EQ(beside.status, 0) << beside.err;
  const Outcome again = run("deform series/IM00001.dcm -f identity -o series/out.nii.gz --overwrite");
  EXPECT_EQ(again.status, 0) << "no slice of the series: " << again.err;
}

TEST_F(WhatIsRead, IsNotWrittenOverByOtherCommands) {
  EXPECT_TRUE(is_refused("field identity --like ct.nii.gz -o hard.nii.gz", "ct.nii.gz"));
  EXPECT_TRUE(
      is_refused("invert rest.msh:deformed=deformed.msh --like series/IM00001.dcm -o i.mha --report series/IM00004.dcm",
                 "series/IM00004.dcm"));
  EXPECT_TRUE(
      is_refused("simulate push.json series/IM00001.dcm -o f.mha --report series/IM00004.dcm", "series/IM00004.dcm"));
  EXPECT_TRUE(
      is_refused("simulate push.json ct.nii.gz --labels hard.nii.gz -o f.mha --report hard.nii.gz", "hard.nii.gz"));
  EXPECT_TRUE(is_refused("render ct.nii.gz --transfer look.json -o look.png", "look.json"));
  fs::create_hard_link(scratch_ / "series/IM00004.dcm", scratch_ / "slice.png");
  EXPECT_TRUE(is_refused("render series/IM00001.dcm --view axial -o slice.png", "series/IM00004.dcm"));
}

TEST_F(WhatIsRead, CountsWhatATransformNames) {
  if (!program_reads_transforms(scratch_.path())) GTEST_SKIP() << "no ITK in this build";
  EXPECT_TRUE(is_refused("deform ct.nii.gz --pull-field second.txt -o out.nii.gz --report first.txt", "first.txt"));
  EXPECT_TRUE(is_refused("deform ct.nii.gz --pull-field third.txt -o out.nii.gz --report first.txt", "first.txt"));
  EXPECT_TRUE(is_refused("deform ct.nii.gz -f second.txt -o out.nii.gz --report first.txt", "first.txt"));
  EXPECT_TRUE(is_refused("invert second.txt --like ct.nii.gz -o i.mha --report first.txt", "first.txt"));
  EXPECT_TRUE(
      is_refused("invert --pull-field second.txt --like series/IM00001.dcm -o i.mha --report series/IM00004.dcm",
                 "series/IM00004.dcm"));
  fs::create_hard_link(scratch_ / "first.txt", scratch_ / "first.png");
  EXPECT_TRUE(is_refused("render ct.nii.gz --view axial --overlay lattice=second.txt -o first.png", "first.txt"));
  EXPECT_TRUE(
      is_refused("render ct.nii.gz --view axial --outside background --sequence second.txt -o first.png", "first.txt"));
}

TEST_F(WhatIsRead, IsHashedWithEverySliceOfASeriesOfLabels) {
  const auto hash_of_labels = [&](const std::string& labels) {
    const Outcome made =
        run("deform series --scenario push.json --backend cpu -o out.nii.gz --overwrite --labels " + labels);
    EXPECT_EQ(made.status, 0) << made.err;
    const auto document = nlohmann::json::parse(read_text(scratch_ / "out.nii.gz.json"));
    return document["field"]["simulation"]["labels_sha256"].get<std::string>();
  };
  const std::string whole = hash_of_labels("series");
  EXPECT_EQ(hash_of_labels("series/IM00001.dcm"), whole);
  std::string slice = read_text(scratch_ / "series/IM00003.dcm");
  slice.back() = static_cast<char>(slice.back() ^ 1);
  write_file(scratch_ / "series/IM00003.dcm", slice);
  EXPECT_NE(hash_of_labels("series/IM00001.dcm"), whole);
}

TEST_F(WhatIsRead, StaysWhereItIsWhenAnOutputIsNamedThroughALinkAndDots) {
  fs::create_directory(scratch_ / "data");
  fs::create_directory(scratch_ / "far/deep");
  fs::create_directory_symlink(scratch_ / "far/deep", scratch_ / "data/out");
  fs::copy(scratch_ / "ct.nii.gz", scratch_ / "data/ct.nii.gz");
  const std::string before = read_text(scratch_ / "data/ct.nii.gz");
  const Outcome made =
      run("deform data/ct.nii.gz -f translate:by=30/0/0 --outside rest -o data/out/../ct.nii.gz "
          "--overwrite");
  EXPECT_EQ(made.status, 0) << made.err;
  EXPECT_EQ(read_text(scratch_ / "data/ct.nii.gz"), before);
  EXPECT_TRUE(fs::exists(scratch_ / "far/ct.nii.gz")) << "where the system finds the name";
  EXPECT_TRUE(is_refused("deform far/ct.nii.gz -f identity -o data/out/../ct.nii.gz", "far/ct.nii.gz"));
}

TEST_F(WhatIsRead, IsNotWrittenOverByBatch) {
  const auto refused = [&](const std::string& arguments, int status, const std::vector<std::string>& words) {
    SCOPED_TRACE(arguments);
    const auto before = files();
    const Outcome made = run(arguments);
    EXPECT_EQ(made.status, status) << made.err;
    EXPECT_TRUE(says(made.err, words));
    EXPECT_EQ(files(), before);
  };
  fs::create_directory(scratch_ / "study");
  write_file(scratch_ / "study/results.jsonl", R"({"case": "a", "input": "../ct.nii.gz", "field": "identity"})");
  refused("batch study/results.jsonl -o study --shard 1/2", 2, {"the input study/results.jsonl"});
  refused("batch study/results.jsonl -o study --merge", 2, {"the input study/results.jsonl"});
  fs::copy(scratch_ / "ct.nii.gz", scratch_ / "study/ct.nii.gz");
  write_file(scratch_ / "m.jsonl",
             "\n"
             R"({"case": "a", "input": "study/ct.nii.gz", "field": "identity"})");
  refused("batch m.jsonl -o study --shard 1/1 --resume", 4, {"m.jsonl:2: a: the output study", "study/ct.nii.gz"});
  write_file(scratch_ / "m.jsonl", R"({"case": "a", "input": "series", "field": "identity"})");
  refused("batch m.jsonl -o far --shard 1/1 --resume", 4, {"m.jsonl:1: a: the output far", "series/IM00005.dcm"});
  refused("batch --init series -o series/m.csv", 2, {"the output series/m.csv", "the input series"});
}

}  // namespace
