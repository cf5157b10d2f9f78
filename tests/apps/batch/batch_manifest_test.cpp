// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// `tetwarp batch`: what a manifest says, and what is wrong with one.
#include "tests/apps/batch/batch_case.h"

namespace {

using namespace tetwarp::test;
using nlohmann::json;

class BatchManifest : public BatchCase {};

TEST_F(BatchManifest, AllErrorsAreListedWithTheirLinesAndNothingIsRun) {
  const Outcome refused = batch(
      R"({"case": "a", "input": "ct.nii.gz", "field": "identity", "covrage": "x.nii.gz"}
{"case": "b", "input": "nowhere.nii.gz", "field": "identity"}
{"case": "B", "input": "ct.nii.gz", "field": "identity"}
{"case": "../c", "input": "ct.nii.gz", "field": "identity"}
{"case": "d", "input": "ct.nii.gz"}
{"case": "e", "input": "ct.nii.gz", "field": "identity", "pull-field": "f.mha"}
{"case": "f", "input": "ct.nii.gz", "field": "wave:amplitud=3,wavelength=5"}
{"case": "g", "input": "ct.nii.gz", "field": "elastic:amplitude=2..8,spacing=40"}
{"case": "h", "input": "ct.nii.gz", "field": "elastic:amplitude=8..2,spacing=40", "seed": 1}
{"case": "i", "input": "ct.nii.gz", "field": "twist:angle=1..x", "seed": 1}
{"case": "j", "input": "ct.nii.gz", "field": "identity", "output": "../out.nii.gz"}
{"case": "k", "input": "ct.nii.gz", "field": "identity", "threads": 4}
{"case": "l", "input": "ct.nii.gz", "field": "identity", "interpolation": "quick"}
{"case": "m", "input": "ct.nii.gz", "field": "identity", "seed": -1, "variants": 2}
{"case": "n", "input": "ct.nii.gz", "field": "nowhere.mha"}
{"case": "o", "input": "ct.nii.gz", "field": "identity", "with": ["nowhere.nrrd=out.nrrd"]}
{"case": "p", "input": "ct.nii.gz", "field": "identity", "bids": "perhaps"}
{"case": "q", "input": "ct.nii.gz", "field": "identity", "case": "q"}
{"case": "r", "input": "ct.nii.gz", "scenario": "springs.json"}
{"case": "s", "input": {"path": "ct.nii.gz"}, "field": "identity"}
no json
{"input": "ct.nii.gz", "field": "identity"}
{"case": "t", "input": "ct.nii.gz", "field": "identity", "variants": 0}
)");
  EXPECT_EQ(refused.status, 4);
  for (const char* words : {"m.jsonl:1: unknown key \"covrage\"; is \"coverage\" meant?",
                            "m.jsonl:2: no such file or folder, nowhere.nii.gz",
                            "m.jsonl:3: the case id \"B\" is taken",
                            "m.jsonl:4: the case id \"../c\"",
                            "m.jsonl:5: one of field, pull-field and scenario",
                            "m.jsonl:6: one of field, pull-field and scenario",
                            "m.jsonl:7: ",
                            "amplitud",
                            "m.jsonl:8: \"elastic:amplitude=2..8,spacing=40\" is drawn at random",
                            "m.jsonl:9: the range \"8..2\" ends below its begin",
                            "m.jsonl:10: \"1..x\" is no range",
                            "m.jsonl:11: output is \"../out.nii.gz\"",
                            "m.jsonl:12: \"threads\" is for the whole batch",
                            "m.jsonl:13: --interpolation: ",
                            "m.jsonl:14: seed is \"-1\"",
                            "m.jsonl:15: \"nowhere.mha\" is neither",
                            "m.jsonl:16: no such file or folder, nowhere.nrrd",
                            "m.jsonl:17: bids is \"perhaps\"",
                            "m.jsonl:18: the key \"case\" stands there twice",
                            "m.jsonl:19: no such file or folder, springs.json",
                            "m.jsonl:20: \"input\" is an object",
                            "m.jsonl:21: no JSON object",
                            "m.jsonl:22: no case id",
                            "m.jsonl:23: variants is \"0\""}) {
    EXPECT_TRUE(says(refused.err, {words}));
  }
  EXPECT_FALSE(std::filesystem::exists(scratch_ / "out"));
}

TEST_F(BatchManifest, OneThatCannotBeReadIsNamedWithTheReason) {
  std::filesystem::create_directory(scratch_ / "folder.csv");
  for (const auto& [manifest, reason] :
       {std::pair("absent.csv", "(No such file or directory)"), std::pair("folder.csv", "(Is a directory)")}) {
    const Outcome refused = run("batch " + std::string(manifest) + " -o out");
    EXPECT_EQ(refused.status, 4);
    EXPECT_TRUE(says(refused.err, {reason, manifest}));
  }
}

TEST_F(BatchManifest, WhatHeadersShowToBeWrongIsListedToo) {
  const Outcome refused = batch(
      R"({"case": "a", "input": "ct.nii.gz", "field": "identity", "output": "dicom"}
{"case": "b", "input": "ct.nii.gz", "field": "identity", "background": 1e9}
{"case": "c", "input": "ct.nii.gz", "field": "identity", "output": "x.nii.gz", "coverage": "x.nii.gz"}
{"case": "d", "input": "series", "field": "identity", "output": "case.nii.gz", "bids": true}
{"case": "e", "input": "ct.nii.gz", "field": "identity"}
)");
  EXPECT_EQ(refused.status, 4);
  EXPECT_TRUE(says(refused.err,
                   {"m.jsonl:1: a: a DICOM series can only be derived from DICOM", "m.jsonl:2: b: --background",
                    "m.jsonl:3: c: two outputs have the same place", "m.jsonl:4: d: two outputs have the same place"}));
  EXPECT_EQ(refused.err.find("m.jsonl:5"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(scratch_ / "out"));
}

TEST_F(BatchManifest, EveryRefusalNamesItsLine) {
  const std::string good = R"({"case": "good", "input": "ct.nii.gz", "field": "identity"})", long_name(300, 'x');
  const auto row = [](const std::string& rest) { return R"({"case": "bad", "input": "ct.nii.gz", )" + rest + "}"; };
  for (const std::string& bad :
       {row(R"("field": "identity", "output": "x.foo")"), row(R"("field": "identity", "coverage": "x.foo")"),
        row(R"("field": "identity", "with": ["ct.nrrd=x.foo"])"),
        row(R"("field": "identity", "with": [")" + long_name + R"(=x.mha"])"),
        row(R"("field": "identity", "points": ["ct.nrrd=x.csv"])"),
        row(R"("field": "identity", "grid": "fit", "output": "dicom")"),
        row(R"("field": "identity", "labels": "ct.nrrd")"), row(R"("field": "identity", "coverage": "c.nii.gz\u0000")"),
        row(R"("field": ")" + long_name + '"'), row(R"("pull-field": ")" + long_name + '"'),
        row(R"("scenario": ")" + long_name + '"')}) {
    SCOPED_TRACE(bad);
    const Outcome refused = batch(good + "\n" + bad + "\n");
    EXPECT_EQ(refused.status, 4);
    EXPECT_TRUE(refused.err.starts_with("tetwarp: error: m.jsonl:2: ")) << refused.err;
    EXPECT_FALSE(std::filesystem::exists(scratch_ / "out"));
  }
  for (const char* own : {"summary.txt", "Results.jsonl", "timings.2-of-3.jsonl", "batch.json", "batch.lock"}) {
    write_file(scratch_ / "m.csv",
               "case,input,field\na,ct.nii.gz,identity\n" + std::string(own) + ",ct.nii.gz,identity\n");
    const Outcome refused = run("batch m.csv -o out");
    EXPECT_EQ(refused.status, 4);
    EXPECT_TRUE(refused.err.starts_with("tetwarp: error: m.csv:3: the case id \"" + std::string(own))) << refused.err;
    EXPECT_FALSE(std::filesystem::exists(scratch_ / "out"));
  }
  for (const char* bad : {"b,\"ct.nii.gz,identity\n", "b,\"ct.nii.gz\"x,identity\n"}) {
    write_file(scratch_ / "m.csv", std::string("case,input,field\na,ct.nii.gz,identity\n") + bad);
    const Outcome refused = run("batch m.csv -o out");
    EXPECT_EQ(refused.status, 4);
    EXPECT_TRUE(refused.err.starts_with("tetwarp: error: m.csv:3: ")) << refused.err;
  }
}

TEST_F(BatchManifest, ASecondMeshAndDotsBehindALinkCountFromTheManifest) {
  std::filesystem::create_directories(scratch_ / "study/near");
  std::filesystem::create_directories(scratch_ / "far/deep");
  std::filesystem::create_directory_symlink(scratch_ / "far/deep", scratch_ / "study/near/link");
  std::filesystem::rename(scratch_ / "ct.nii.gz", scratch_ / "far/ct.nii.gz");
  write_file(
      scratch_ / "study/m.jsonl",
      R"({"case": "a", "input": "near/link/../ct.nii.gz", "field": "rest.msh:deformed=./deformed.msh,units=m"})");
  for (const char* name : {"study/rest.msh", "study/deformed.msh"}) write_file(scratch_ / name, "no mesh");
  const Outcome listed = run("batch study/m.jsonl -o out --dry-run");
  EXPECT_TRUE(says(listed.out,
                   {"'study/near/link/../ct.nii.gz'", "'--field=study/rest.msh:deformed=study/deformed.msh,units=m'"}))
      << listed.err;
  std::filesystem::remove(scratch_ / "study/deformed.msh");
  EXPECT_TRUE(says(run("batch study/m.jsonl -o out").err, {"m.jsonl:1: no such file", "study/deformed.msh"}));
}

TEST_F(BatchManifest, CsvAndJsonLinesSayTheSame) {
  write_file(scratch_ / "m.csv",
             "\xEF\xBB\xBF# to be edited\r\n"
             "case,input,field,seed,variants,output,bids,comment\r\n"
             "a,ct.nii.gz,\"elastic:amplitude=2..8,spacing=60..90 ; twist:angle=-5..5\",3,2,,no,\"a \"\"b\"\", c\"\r\n"
             "\r\n#b,ct.nii.gz,identity,,,,,\r\n"
             "c,series,identity,,,dicom,,\r\n");
  const Outcome csv = run("batch m.csv -o out --dry-run");
  const Outcome lines = batch(
      R"({"comment": "x", "variants": 2, "case": "a", "input": "ct.nii.gz", "seed": 3, "field": ["elastic:amplitude=2..8,spacing=60..90", "twist:angle=-5..5"], "bids": false}

{"case": "c", "input": "series", "field": "identity", "output": "dicom"}
)",
      "-o out --dry-run");
  EXPECT_EQ(csv.status, 0) << csv.err;
  EXPECT_EQ(lines.status, 0) << lines.err;
  EXPECT_EQ(csv.out, lines.out);
  EXPECT_TRUE(says(csv.out, {"a-1: tetwarp 'deform' 'ct.nii.gz'",
                             "'--field=twist:angle=", "c: tetwarp 'deform' 'series'", "'--output=out/c/dicom'"}));
  EXPECT_FALSE(std::filesystem::exists(scratch_ / "out"));
}

TEST_F(BatchManifest, CellsThatDoNotFitTheColumnsAreRefused) {
  write_file(scratch_ / "m.csv", "case,input,field\na,ct.nii.gz,wave:amplitude=8,wavelength=64\n");
  const Outcome refused = run("batch m.csv -o out");
  EXPECT_EQ(refused.status, 4);
  EXPECT_TRUE(says(refused.err, {"m.csv:2: 4 cells, the first line names 3 columns"}));
}

TEST_F(BatchManifest, PathsAreRelativeToTheManifest) {
  std::filesystem::create_directories(scratch_ / "study");
  write_file(scratch_ / "study/m.jsonl", R"({"case": "a", "input": "../ct.nii.gz", "field": "identity"})");
  const Outcome made = run("batch study/m.jsonl -o out --quiet");
  EXPECT_EQ(made.status, 0) << made.err;
  EXPECT_TRUE(std::filesystem::exists(scratch_ / "out/a/deformed.nii.gz"));
}

/// Expected numbers come from an implementation of the rule in docs/reference/batch.md in another language.
TEST_F(BatchManifest, NumbersAreDrawnByTheRuleOfTheDocuments) {
  write_file(scratch_ / "draw.py", R"(
M = (1 << 64) - 1
def m(x):
    z = (x + 0x9e3779b97f4a7c15) & M
    z = ((z ^ (z >> 30)) * 0xbf58476d1ce4e5b9) & M
    z = ((z ^ (z >> 27)) * 0x94d049bb133111eb) & M
    return z ^ (z >> 31)
def h(seed, variant, field, name, component=0):
    g = m((m((m(seed) + variant) & M) + field) & M)
    for byte in name.encode(): g = m((g + byte) & M)
    return m((g + component) & M)
def number(low, high, *of): return '%.6g' % (low + (h(*of) >> 11) / 2**53 * (high - low))
for variant in range(3):
    s = (18446744073709551615, variant)
    print("elastic:amplitude=%svox,spacing=%s,seed=%d" % (number(2, 8, *s, 0, "amplitude"), number(30.5, 60, *s, 0, "spacing"), h(*s, 0, "seed") >> 12))
    print("translate:by=%s/0/%s" % (number(-1, 1, *s, 1, "by"), number(5, 9, *s, 1, "by", 2)))
)");
  const Outcome drawn = batch(
      R"({"case": "a", "input": "ct.nii.gz", "field": ["elastic:amplitude=2..8vox,spacing=30.5..60", "translate:by=-1..1/0/5..9"], "seed": 18446744073709551615, "variants": 3})",
      "-o out --dry-run");
  ASSERT_EQ(drawn.status, 0) << drawn.err;
  std::string found;
  for (std::size_t at = drawn.out.find("'--field="); at != std::string::npos; at = drawn.out.find("'--field=", at + 1))
    found += drawn.out.substr(at + 9, drawn.out.find('\'', at + 1) - at - 9) + "\n";
  EXPECT_EQ(found, run_program(scratch_.path(), TETWARP_PYTHON, "draw.py").out);
}

TEST_F(BatchManifest, MassSpringGoesByAnyBackend) {
  write_file(scratch_ / "springs.json",
             R"({"method": "mass-spring", "cell_size": 4, "tissues": [{"name": "all"}], "hold": [{"border": true}],
                 "move": [{"name": "hand", "by_mm": [0, 5, 0], "handle": {"at": {"body": [0.5, 0.3, 0.5]}, "radius_mm": 20}}]})");
  const Outcome made = batch(R"({"case": "a", "input": "ct.nii.gz", "scenario": "springs.json"})"
                             "\n"
                             R"({"case": "b", "input": "ct.nii.gz", "scenario": "springs.json", "backend": "cpu"})");
  EXPECT_EQ(made.status, 0) << made.err;
}

TEST_F(BatchManifest, SchemaTakesTheKeysThatTheReaderTakes) {
  const json schema = json::parse(read_text(TETWARP_MANIFEST_SCHEMA));
  std::set<std::string> keys;
  for (const auto& [key, value] : schema["properties"].items()) keys.insert(key);
  for (const std::string& key : keys) {
    const Outcome outcome = batch(json{{"case", "a"}, {key, "1"}}.dump());
    EXPECT_EQ(outcome.err.find("unknown key"), std::string::npos) << key;
    EXPECT_EQ(outcome.err.find("is for the whole batch"), std::string::npos) << key;
  }
  std::istringstream help(run("deform --help").out);
  std::size_t options = 0;
  for (std::string line; std::getline(help, line);) {
    const std::size_t at = line.substr(0, 12).find("--");
    if (at == std::string::npos || line.find_first_not_of(" -abcdefghijklmnopqrstuvwxyz,") < at) continue;
    const std::string name =
        line.substr(at + 2, line.find_first_not_of("abcdefghijklmnopqrstuvwxyz-", at + 2) - at - 2);
    if (keys.contains(name) || name == "help") continue;
    const Outcome outcome = batch(json{{"case", "a"}, {name, "1"}}.dump());
    EXPECT_TRUE(says(outcome.err, {"is for the whole batch"})) << name;
    ++options;
  }
  EXPECT_GE(options, 5u);
}

TEST_F(BatchManifest, ExamplesOfTheDocumentsMeetTheSchemaAndBadRowsDoNot) {
  if (std::system("'" TETWARP_PYTHON "' -c 'import jsonschema' 2> '/dev/null'") != 0)
    GTEST_SKIP() << "python3-jsonschema is not installed";
  const std::string document = read_text(TETWARP_BATCH_DOCUMENT);
  const std::size_t begin = document.find("```jsonl\n") + 9;
  std::istringstream lines(document.substr(begin, document.find("```", begin) - begin));
  std::string good, bad;
  std::size_t number = 0;
  const auto put = [&](const std::string& line, std::string& list) {
    const std::string name = std::to_string(number++) + ".json";
    write_file(scratch_ / name, line);
    list += " '" + (scratch_ / name).string() + "'";
  };
  for (std::string line; std::getline(lines, line);) put(line, good);
  EXPECT_EQ(number, 3u);
  for (const char* line : {R"({"case": "a", "input": "x", "field": "identity", "colour": 3})",
                           R"({"case": "a/b", "input": "x", "field": "identity"})", R"({"case": "a", "input": "x"})",
                           R"({"case": "a", "input": "x", "field": "f", "scenario": "s"})",
                           R"({"case": "a", "input": "x", "field": "f", "output": "../y.nii"})",
                           R"({"case": "a", "input": "x", "field": "f", "variants": 0})"})
    put(line, bad);
  const std::string check = "'" TETWARP_PYTHON "' '" TETWARP_CHECK_SCENARIO "' '" TETWARP_MANIFEST_SCHEMA "'";
  EXPECT_EQ(std::system((check + " good" + good).c_str()), 0);
  EXPECT_EQ(std::system((check + " bad" + bad).c_str()), 0);
}

TEST_F(BatchManifest, InitNamesEveryVolumeAndWhatItWritesIsTaken) {
  std::filesystem::create_directories(scratch_ / "study/b");
  std::filesystem::rename(scratch_ / "series", scratch_ / "study/a");
  std::filesystem::copy(scratch_ / "study/a/IM00001.dcm", scratch_ / "study/b/one.dcm");
  ASSERT_EQ(run("deform study/a -f wave:amplitude=3,wavelength=90 -o study/c --quiet").status, 0);
  const Outcome made = run("batch --init study -o m.csv --field twist:angle=3");
  ASSERT_EQ(made.status, 0) << made.err;
  const std::string text = read_text(scratch_ / "m.csv");
  EXPECT_TRUE(says(text, {"case-001,study", "case-002,study/c,,,twist:angle=3"}));
  EXPECT_EQ(text.find("hantom"), std::string::npos) << "the patient's name: " << text;
  EXPECT_EQ(run("batch --init study -o m.csv").status, 1) << "exists";
  const Outcome all = run("batch m.csv -o out --quiet");
  EXPECT_EQ(all.status, 0) << all.err;
  EXPECT_EQ(run("batch --init ct.nii.gz -o n.csv").status, 4);
  EXPECT_EQ(run("batch --init study -o n.txt").status, 2);
}

TEST_F(BatchManifest, WhatInitWritesIsReadBackWhateverTheFoldersAreCalled) {
  const std::vector<std::string> names = {"blank ", " blank",  "tab\t",      "comma, and \"quotes\"", "-dash",
                                          "#hash",  "semi;co", "two\nlines", "$(touch hurt) `x` 'y'", "caf\xe9"};
  for (std::size_t n = 0; n < names.size(); ++n) {
    const std::string seed = " --seed " + std::to_string(n + 1);
    ASSERT_EQ(run("phantom --size 8,8,4 --spacing 40,40,50 --quiet -o s" + seed).status, 0);
    std::filesystem::create_directories(scratch_ / "all");
    std::filesystem::rename(scratch_ / "s", scratch_ / "all" / names[n]);
  }
  ASSERT_EQ(run("batch --init all -o m.csv --quiet").status, 0);
  const Outcome made = run("batch m.csv -o out --quiet");
  EXPECT_EQ(made.status, 0) << made.err;
  EXPECT_EQ(lines_of("out/results.jsonl").size(), names.size());
  const Outcome listed = run("batch m.csv -o again --dry-run");
  std::istringstream text(listed.out);
  std::size_t lines = 0;
  for (std::string line; std::getline(text, line); ++lines) {
    const std::string id = line.substr(0, line.find(": "));
    write_file(scratch_ / "pasted.sh", "mkdir -p again/" + id + "; tetwarp() { " TETWARP_PROGRAM " \"$@\"; }\n" +
                                           line.substr(id.size() + 2) + " --quiet\n");
    const Outcome pasted = run_program(scratch_.path(), "/bin/bash", "pasted.sh");
    EXPECT_EQ(pasted.status, 0) << line << pasted.err;
    EXPECT_EQ(read_text(scratch_ / "again" / id / "deformed.nii.gz"),
              read_text(scratch_ / "out" / id / "deformed.nii.gz"));
  }
  EXPECT_EQ(lines, names.size()) << "a line a case, whatever is in it";
  EXPECT_FALSE(std::filesystem::exists(scratch_ / "hurt"));
}

TEST_F(BatchManifest, ACommentMayHaveCommasAndQuotes) {
  write_file(scratch_ / "m.csv",
             "# \"a, b\" c\ncase,input,field\n# x, \"y\" z, \"\na,ct.nrrd,identity\n#,\"\nb,ct.nrrd,bogus:\n");
  const Outcome made = run("batch m.csv -o out --quiet");
  EXPECT_EQ(made.status, 4);
  EXPECT_TRUE(says(made.err, {"m.csv:6: "})) << "lines are counted through comments";
}

TEST_F(BatchManifest, ABatchThatTheDiskCannotHoldLeavesNoFolder) {
  write_file(
      scratch_ / "huge.mha",
      "ObjectType = Image\nNDims = 3\nDimSize = 4000 4000 4000\nElementType = MET_FLOAT\nElementSpacing = 1 1 1\n"
      "Offset = 0 0 0\nTransformMatrix = 1 0 0 0 1 0 0 0 1\nElementDataFile = LOCAL\n");
  std::filesystem::resize_file(scratch_ / "huge.mha", std::filesystem::file_size(scratch_ / "huge.mha") +
                                                          std::uintmax_t{4} * 4000 * 4000 * 4000);
  const std::string row =
      R"({"case": "v", "input": "huge.mha", "field": "identity", "cell-size": 64, "output": "o.nii", "variants": 400})";
  const Outcome refused = batch(row);
  EXPECT_EQ(refused.status, 1) << refused.err;
  EXPECT_TRUE(says(refused.err, {"the outputs take at least", "are free"}));
  EXPECT_FALSE(std::filesystem::exists(scratch_ / "out"));
  EXPECT_EQ(batch(R"({"case": "v", "input": "ct.nrrd", "field": "identity"})").status, 0) << "the folder is free";
}

TEST_F(BatchManifest, ABatchThatHasNoDeviceLeavesNoFolder) {
  if (run("--version").out.find("cuda: usable") != std::string::npos) GTEST_SKIP() << "cuda: a device";
  const std::string row = R"({"case": "v", "input": "ct.nrrd", "field": "identity"})";
  const Outcome refused = batch(row, "-o out --quiet --backend cuda");
  EXPECT_EQ(refused.status, 1) << refused.err;
  EXPECT_TRUE(says(refused.err, {"CUDA", "use --backend cpu"}));
  EXPECT_FALSE(std::filesystem::exists(scratch_ / "out"));
  EXPECT_EQ(batch(row, "-o out --quiet --backend cpu").status, 0) << "the folder is free";
}

}  // namespace
