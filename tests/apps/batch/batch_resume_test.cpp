// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// `tetwarp batch --resume`: which cases are kept, and what is said of the others.
#include "tests/apps/batch/batch_case.h"
#include "tests/support/transforms.h"

namespace {

using namespace tetwarp::test;
using nlohmann::json;
namespace fs = std::filesystem;

class BatchResume : public BatchCase {
 protected:
  /// What a resumed batch makes, "again: REASON: a b" where it says that it made them before.
  std::string made_by(const std::string& arguments) const {
    const Outcome resumed = run("batch " + arguments + " --resume --log-json");
    EXPECT_EQ(resumed.status, 0) << resumed.err;
    std::string made, again;
    std::istringstream events(resumed.err);
    for (std::string line; std::getline(events, line);) {
      const json event = json::parse(line);
      if (event["event"] == "done") made += event["case"].get<std::string>() + " ";
      if (event["event"] != "again") continue;
      again += "again: " + event["reason"].get<std::string>() + ":";
      for (const json& id : event["ids"]) again += " " + id.get<std::string>();
      again += "; ";
    }
    return again + made;
  }
  void change(const std::string& name) const {
    std::string bytes = read_text(scratch_ / name);
    bytes.back() = static_cast<char>(bytes.back() ^ 1);
    write_file(scratch_ / name, bytes);
  }
};

std::string translation(int x, const std::string& initial) {
  return "(Transform \"TranslationTransform\")\n(NumberOfParameters 3)\n(TransformParameters " + std::to_string(x) +
         " 0 0)\n(InitialTransformParametersFileName \"" + initial + "\")\n(HowToCombineTransforms \"Compose\")\n";
}

std::string tetrahedron(int x) {
  return "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 " + std::to_string(x - 1000) +
         " -1000 -1000\n2 3000 -1000 -1000\n3 -1000 3000 -1000\n4 -1000 -1000 3000\n$EndNodes\n"
         "$Elements\n1\n1 4 0 1 2 3 4\n$EndElements\n";
}

TEST_F(BatchResume, SeesAChangeOfEveryFileThatIsRead) {
  fs::create_directory(scratch_ / "study");
  for (const char* name : {"ct.nii.gz", "ct.nrrd", "series"}) fs::rename(scratch_ / name, scratch_ / "study" / name);
  write_file(scratch_ / "study/first.txt", translation(1, "NoInitialTransform"));
  write_file(scratch_ / "study/second.txt", translation(2, "first.txt"));
  write_file(scratch_ / "study/rest.msh", tetrahedron(0));
  write_file(scratch_ / "study/deformed.msh", tetrahedron(3));
  write_file(scratch_ / "study/p.csv", "x,y,z\n1,2,3\n");
  const auto push_by = [&](int mm) {
    write_file(scratch_ / "study/push.json",
               R"({"method": "chainmail", "cell_size": 4, "tissues": [{"name": "all"}], "hold": [{"border": true}],
  "move": [{"name": "hand", "by_mm": [0, )" +
                   std::to_string(mm) + R"(, 0], "handle": {"at": {"body": [0.5, 0.3, 0.5]}, "radius_mm": 30}}]})");
  };
  push_by(5);
  const bool has_transforms = program_reads_transforms(scratch_.path());
  const std::string elastix = R"({"case": "elastix", "input": "ct.nii.gz", "pull-field": "second.txt"})"
                              "\n";
  write_file(
      scratch_ / "study/m.jsonl",
      (has_transforms ? elastix : std::string()) +
          R"({"case": "mesh", "input": "ct.nii.gz", "field": "rest.msh:deformed=deformed.msh", "outside": "background"}
{"case": "with", "input": "ct.nii.gz", "field": "identity", "with": ["series=with.nii.gz"]}
{"case": "grid", "input": "ct.nii.gz", "field": "identity", "grid": "series", "outside": "background"}
{"case": "single", "input": "ct.nii.gz", "field": "identity", "with": ["series/IM00001.dcm=with.nii.gz"]}
{"case": "points", "input": "ct.nii.gz", "field": "identity", "points": ["p.csv=q.csv"]}
{"case": "scenario", "input": "ct.nii.gz", "scenario": "push.json"}
)");
  const Outcome made = run("batch study/m.jsonl -o out --quiet");
  ASSERT_EQ(made.status, 0) << made.err;
  const std::string batch = "study/m.jsonl -o out", why = "again: another file that is read has changed: ";
  EXPECT_EQ(made_by(batch), "");
  write_file(scratch_ / "study/first.txt", translation(5, "NoInitialTransform"));
  EXPECT_EQ(made_by(batch), has_transforms ? why + "elastix; elastix " : "");
  write_file(scratch_ / "study/deformed.msh", tetrahedron(7));
  EXPECT_EQ(made_by(batch), why + "mesh; mesh ");
  change("study/series/IM00003.dcm");
  EXPECT_EQ(made_by(batch + " --jobs 1"), why + "with grid single; with grid single ");
  write_file(scratch_ / "study/p.csv", "x,y,z\n1,2,4\n");
  EXPECT_EQ(made_by(batch), why + "points; points ");
  push_by(6);
  EXPECT_EQ(made_by(batch), why + "scenario; scenario ");
  EXPECT_EQ(made_by(batch), "");
}

TEST_F(BatchResume, KnowsFinishedCasesWhereverTheFolderLiesAndHoweverItIsNamed) {
  ASSERT_EQ(batch(kSixCases).status, 0);
  const std::string here = scratch_.path().string();
  fs::create_directory_symlink(scratch_ / "out", scratch_ / "link");
  for (const std::string& named :
       {std::string("./out"), std::string("out/"), here + "/out", std::string("link"), std::string("link/../out")})
    EXPECT_EQ(made_by("m.jsonl -o " + named), "") << named;
  EXPECT_EQ(made_by(here + "/m.jsonl -o out"), "") << "the manifest by its whole name";
  fs::remove(scratch_ / "link");
  fs::create_directory(scratch_ / "moved");
  fs::rename(scratch_ / "out", scratch_ / "moved/results");
  EXPECT_EQ(made_by("m.jsonl -o moved/results"), "");
  const json line = lines_of("moved/results/results.jsonl").at("c");
  EXPECT_TRUE(says(line["command"].dump(), {"--output=moved/results/c/c.mha"})) << "the command that repeats it";
}

TEST_F(BatchResume, SaysHowManyAreMadeAgainAndWhy) {
  ASSERT_EQ(batch(kSixCases).status, 0);
  std::string other = kSixCases;
  other.replace(other.find("angle=10"), 8, "angle=11");
  write_file(scratch_ / "m.jsonl", other);
  fs::remove_all(scratch_ / "out/c");
  change("out/a-2/deformed.nii.gz");
  ASSERT_EQ(run("phantom --size 40,40,16 --spacing 9,9,12 --seed 2 --quiet --overwrite -o ct.nii.gz").status, 0);
  const Outcome resumed = run("batch m.jsonl -o out --resume");
  EXPECT_EQ(resumed.status, 0) << resumed.err;
  EXPECT_TRUE(says(resumed.err, {"tetwarp: made again: 3 cases, the input has changed: a-1, a-2, a-3\n",
                                 "tetwarp: made again: 1 case, the row has changed: b\n",
                                 "tetwarp: made again: 1 case, the folder is gone: c\n",
                                 "tetwarp: made again: 1 case, another file that is read has changed: d\n"}));
  change("out/a-2/deformed.nii.gz");
  EXPECT_EQ(made_by("m.jsonl -o out"), "again: the outputs are not as they were written: a-2; a-2 ");
  EXPECT_EQ(run("batch m.jsonl -o out --resume --quiet").err, "");
}

TEST_F(BatchResume, NeedsRoomForTheCasesThatItMakesAndNotForThoseThatAreThere) {
  write_file(scratch_ / "m.jsonl",
             R"({"case": "v", "input": "ct.nrrd", "field": "identity", "output": "o.mha", "variants": 4})");
  // Four outputs of 51 kB and what lies beside them fit on this disk; beside three there is no room for four more.
  write_file(scratch_ / "script",
             "mkdir disk && mount -t tmpfs -o size=360k none disk || exit 77\n"
             "'" TETWARP_PROGRAM
             "' batch m.jsonl -o disk/out --quiet || exit 99\n"
             "rm -r disk/out/v-3\n"
             "'" TETWARP_PROGRAM
             "' batch m.jsonl -o disk/out --quiet --resume || exit\n"
             "grep -c '\"status\":\"done\"' disk/out/results.jsonl\n");
  const Outcome made = run_program(scratch_.path(), "/bin/sh", "-c 'unshare --map-root-user --mount sh script'");
  if (made.status == 77 || says(made.err, {"unshare"})) GTEST_SKIP() << "no disk can be mounted: " << made.err;
  EXPECT_EQ(made.status, 0) << made.err;
  EXPECT_EQ(made.out, "4\n");
}

}  // namespace
