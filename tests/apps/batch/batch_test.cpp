// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// `tetwarp batch`: what becomes of cases.
#include <fcntl.h>
#include <signal.h>
#include <sys/file.h>
#include <unistd.h>

#include <thread>

#include "tests/apps/batch/batch_case.h"

namespace {

using namespace tetwarp::test;
using nlohmann::json;
namespace fs = std::filesystem;

class Batch : public BatchCase {};

/// What lies in a folder under hidden names.
std::vector<std::string> hidden_in(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().filename().string().starts_with(".")) names.push_back(entry.path().filename().string());
  }
  return names;
}

TEST_F(Batch, EveryCaseHasTheBytesOfItsCommandAlone) {
  const Outcome made = batch(kSixCases, "-o out");
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_TRUE(says(made.out, {"6 of 6 cases done"}));
  EXPECT_TRUE(says(made.err, {"bottleneck: "}));
  const auto lines = lines_of("out/results.jsonl");
  ASSERT_EQ(lines.size(), 6u);
  const auto of_batch = files_of("out");
  for (const auto& [id, line] : lines) {
    SCOPED_TRACE(id);
    fs::remove_all(scratch_ / "out" / id);
    fs::create_directories(scratch_ / "out" / id);
    std::string command;
    for (const json& argument : line["command"]) command += "'" + argument.get<std::string>() + "' ";
    ASSERT_EQ(run(command + "--quiet").status, 0);
    for (const auto& [name, bytes] : files_of("out/" + id)) EXPECT_EQ(of_batch.at(id + "/" + name), bytes) << name;
    for (const json& output : line["outputs"])
      EXPECT_TRUE(fs::exists(scratch_ / "out" / output["path"].get<std::string>())) << output;
  }
}

TEST_F(Batch, BytesDependOnNeitherOrderNorWorkersNorShards) {
  ASSERT_EQ(batch(kSixCases, "-o one/out --jobs 1 --threads 1 --quiet").status, 1) << "the folder around it is missing";
  for (const char* folder : {"one", "two", "three"}) fs::create_directories(scratch_ / folder);
  std::string reversed;
  std::istringstream lines(kSixCases);
  for (std::string line; std::getline(lines, line);) reversed = line + "\n" + reversed;
  write_file(scratch_ / "m.jsonl", kSixCases);
  write_file(scratch_ / "reversed.jsonl", reversed);
  const auto run_in = [&](const std::string& folder, const std::string& arguments) {
    const Outcome made = run_program(scratch_ / folder, TETWARP_PROGRAM, "batch " + arguments + " -o out --quiet");
    EXPECT_EQ(made.status, 0) << made.err;
  };
  for (const char* name : {"m.jsonl", "reversed.jsonl", "ct.nii.gz", "ct.nrrd", "series"}) {
    for (const char* folder : {"one", "two", "three"}) fs::create_symlink(scratch_ / name, scratch_ / folder / name);
  }
  run_in("one", "m.jsonl --jobs 1 --threads 1");
  run_in("two", "reversed.jsonl --jobs 5 --threads 2");
  for (const char* shard : {"2/3", "3/3", "1/3"}) run_in("three", std::string("m.jsonl --shard ") + shard);
  run_in("three", "m.jsonl --merge");
  const auto cases_in = [&](const std::string& folder) {
    auto files = files_of(folder + "/out");
    std::erase_if(files, [](const auto& file) { return file.first.find('/') == std::string::npos; });
    return files;
  };
  const auto once = cases_in("one");
  EXPECT_GT(once.size(), 20u);
  EXPECT_EQ(once, cases_in("two"));
  EXPECT_EQ(once, cases_in("three"));
  EXPECT_EQ(read_text(scratch_ / "one/out/results.jsonl"), read_text(scratch_ / "three/out/results.jsonl"));
  EXPECT_EQ(read_text(scratch_ / "one/out/summary.txt"), read_text(scratch_ / "three/out/summary.txt"));
}

TEST_F(Batch, MergeNamesWhatIsMissing) {
  ASSERT_EQ(batch(kSixCases, "-o out --quiet --shard 1/2").status, 0);
  const Outcome refused = run("batch m.jsonl -o out --merge");
  EXPECT_EQ(refused.status, 1);
  EXPECT_TRUE(says(refused.err, {"3 cases have no result", "a-2 (shard 2)", "--resume"}));
  EXPECT_EQ(run("batch m.jsonl -o out --shard 3/2").status, 2);
  EXPECT_EQ(run("batch m.jsonl -o out --shard 0/2").status, 2);
  EXPECT_EQ(run("batch m.jsonl -o nowhere --merge").status, 1);
}

TEST_F(Batch, ACaseThatFailsIsRecordedAndTheOthersGoOn) {
  const std::string content = read_text(scratch_ / "ct.nii.gz");
  write_file(scratch_ / "cut.nii.gz", content.substr(0, content.size() / 2));
  const std::string broken = R"({"case": "x", "input": "cut.nii.gz", "field": "identity"}
{"case": "y", "input": "ct.nii.gz", "field": "translate:by=900/0/0", "outside": "refuse"}
)";
  const Outcome made = batch(broken + kSixCases, "-o out");
  EXPECT_EQ(made.status, 3);
  EXPECT_TRUE(says(made.out, {"7 of 8 cases done, 1 failed", "x     refused"}));
  const auto lines = lines_of("out/results.jsonl");
  EXPECT_EQ(lines.at("x")["status"], "refused");
  EXPECT_TRUE(says(lines.at("x")["reason"], {"cut.nii.gz"}));
  EXPECT_EQ(lines.at("y")["report"]["covered"], 0);
  EXPECT_FALSE(fs::exists(scratch_ / "out/x"));
  EXPECT_EQ(hidden_in(scratch_ / "out"), std::vector<std::string>());
  write_file(scratch_ / "cut.nii.gz", content);  // mended
  const Outcome resumed = run("batch m.jsonl -o out --resume --log-json");
  EXPECT_EQ(resumed.status, 0) << resumed.err;
  EXPECT_TRUE(says(resumed.err, {R"("cases":1,"event":"batch","finished_before":7)"}));
  EXPECT_EQ(lines_of("out/results.jsonl").at("x")["status"], "done");
}

TEST_F(Batch, ResumeKeepsWhatIsWholeAndMakesTheRest) {
  ASSERT_EQ(batch(kSixCases).status, 0);
  const auto before = files_of("out");
  const auto made_again = [&](const std::string& id) {
    const Outcome resumed = run("batch m.jsonl -o out --resume --log-json");
    EXPECT_EQ(resumed.status, 0) << resumed.err;
    EXPECT_EQ(files_of("out"), before);
    std::string ids;
    std::istringstream events(resumed.err);
    for (std::string line; std::getline(events, line);) {
      const json event = json::parse(line);
      EXPECT_TRUE(event.contains("time"));
      if (event["event"] == "done") ids += event["case"].get<std::string>() + " ";
    }
    EXPECT_EQ(ids, id);
  };
  made_again("");
  write_file(scratch_ / "out/c/c.mha", before.at("c/c.mha") + "x");
  made_again("c ");
  fs::remove(scratch_ / "out/b/dicom/IM00002.dcm");
  made_again("b ");
  fs::remove_all(scratch_ / "out/d");
  made_again("d ");
  write_file(scratch_ / "out/a-1/case.json", "{");
  EXPECT_EQ(run("batch m.jsonl -o out --resume --quiet").status, 3) << "what is in a-1 may be somebody's";
  fs::remove_all(scratch_ / "out/a-1");
  made_again("a-1 ");
}

TEST_F(Batch, ResumeSeesThatRowOrInputHaveChanged) {
  ASSERT_EQ(batch(kSixCases).status, 0);
  const auto begun = [&] {
    const std::string events = run("batch m.jsonl -o out --resume --log-json").err;
    return events.substr(0, events.find(",\"event\""));
  };
  std::string other = kSixCases;
  other.replace(other.find("angle=10"), 8, "angle=11");
  write_file(scratch_ / "m.jsonl", other);
  EXPECT_EQ(begun(), "{\"cases\":1");
  std::string slice = read_text(scratch_ / "series/IM00003.dcm");
  slice.back() = static_cast<char>(slice.back() ^ 1);
  write_file(scratch_ / "series/IM00003.dcm", slice);
  EXPECT_EQ(begun(), "{\"cases\":1") << "of DICOM";
  ASSERT_EQ(run("phantom --size 40,40,16 --spacing 9,9,12 --seed 2 --quiet --overwrite -o ct.nii.gz").status, 0);
  EXPECT_EQ(begun(), "{\"cases\":4") << "as INPUT of three, and along with d";
  EXPECT_EQ(begun(), "{\"cases\":0");
}

TEST_F(Batch, AFolderThatIsNotABatchOrInUseIsLeftAlone) {
  write_file(scratch_ / "m.jsonl", kSixCases);
  fs::create_directories(scratch_ / "mine");
  write_file(scratch_ / "mine/thesis.txt", "words");
  EXPECT_TRUE(says(run("batch m.jsonl -o mine --resume").err, {"mine is not empty, and no batch was begun in it"}));
  EXPECT_EQ(files_of("mine").size(), 1u);
  fs::create_directories(scratch_ / "killed");
  write_file(scratch_ / "killed/batch.lock", "");  // all that is there where a batch is killed in its first moment
  EXPECT_EQ(run("batch m.jsonl -o killed --resume").status, 0);
  ASSERT_EQ(batch(kSixCases).status, 0);
  const Outcome again = run("batch m.jsonl -o out");
  EXPECT_EQ(again.status, 1);
  EXPECT_TRUE(says(again.err, {"--resume"}));
  const int lock = open((scratch_ / "out/batch.json").c_str(), O_RDWR);
  ASSERT_EQ(flock(lock, LOCK_EX), 0);
  const Outcome second = run("batch m.jsonl -o out --resume");
  close(lock);
  EXPECT_EQ(second.status, 1);
  EXPECT_TRUE(says(second.err, {"another process works on this batch"}));
  write_file(scratch_ / "out/b/notes.txt", "somebody's");
  const Outcome damaged = run("batch m.jsonl -o out --resume --quiet");
  EXPECT_EQ(damaged.status, 3);
  EXPECT_TRUE(says(lines_of("out/results.jsonl").at("b")["reason"], {"notes.txt was not written by Tetwarp"}));
  EXPECT_EQ(read_text(scratch_ / "out/b/notes.txt"), "somebody's");
}

TEST_F(Batch, FilesThatMayNotBeSoLargeFailTheirCaseAndNothingIsLeft) {
  write_file(
      scratch_ / "m.jsonl",
      R"({"case": "large", "input": "ct.nrrd", "field": "identity", "output": "out.mha", "inverse": "inverse.mha"}
{"case": "small", "input": "ct.nii.gz", "field": "identity"}
)");
  const Outcome made = run_program(scratch_.path(), "/bin/sh",
                                   "-c 'ulimit -f 200; exec \"" TETWARP_PROGRAM "\" batch m.jsonl -o out --quiet'");
  EXPECT_EQ(made.status, 3) << made.err;
  const auto lines = lines_of("out/results.jsonl");
  EXPECT_EQ(lines.at("small")["status"], "done");
  EXPECT_EQ(lines.at("large")["status"], "failed");
  EXPECT_TRUE(says(lines.at("large")["reason"], {"out/large/inverse.mha"}));
  EXPECT_FALSE(fs::exists(scratch_ / "out/large"));
  EXPECT_EQ(hidden_in(scratch_ / "out"), std::vector<std::string>());
  EXPECT_EQ(run("batch m.jsonl -o out --resume --quiet").status, 0);
}

TEST_F(Batch, AFileThatCannotBeReadFailsItsCaseAlone) {
  write_file(scratch_ / "m.jsonl",
             std::string(R"({"case": "x", "input": "hidden.nrrd", "field": "identity"})") + "\n" + kSixCases);
  fs::copy(scratch_ / "ct.nrrd", scratch_ / "hidden.nrrd");
  fs::permissions(scratch_ / "hidden.nrrd", fs::perms::none);
  const std::optional<std::string> as_other = as_another_user(65534);
  if (!as_other) GTEST_SKIP() << "another user cannot run the program where it lies";
  const Outcome made =
      run_program(scratch_.path(), "/bin/sh", "-c '" + *as_other + TETWARP_PROGRAM + " batch m.jsonl -o out --quiet'");
  EXPECT_EQ(made.status, 3) << made.err;
  const auto lines = lines_of("out/results.jsonl");
  EXPECT_EQ(lines.size(), 7u);
  for (const auto& [id, line] : lines) EXPECT_EQ(line["status"] == "done", id != "x") << line;
  EXPECT_TRUE(says(lines.at("x")["reason"], {"hidden.nrrd"}));
}

TEST_F(Batch, FewerThreadsThanWantedCostNoCase) {
  write_file(
      scratch_ / "m.jsonl",
      R"({"case": "a", "input": "ct.nrrd", "field": "elastic:amplitude=2,spacing=90", "seed": 1, "variants": 24})"
      "\n");
  if (geteuid() != 0) GTEST_SKIP() << "needs a user who has no other processes";
  const std::optional<std::string> as_other = as_another_user(65533);
  if (!as_other) GTEST_SKIP() << "another user cannot run the program where it lies";
  const Outcome made =
      run_program(scratch_.path(), "/bin/sh",
                  "-c '" + *as_other + "prlimit --nproc=20 " TETWARP_PROGRAM " batch m.jsonl -o out --jobs 24'");
  EXPECT_EQ(made.status, 0) << made.err;
  EXPECT_TRUE(says(made.err, {"the system gives only", "cases at once", "ulimit -u"}));
  EXPECT_EQ(lines_of("out/results.jsonl").size(), 24u);
}

TEST_F(Batch, ASignalEndsItWithinFiveSecondsAndResumeContinues) {
  ASSERT_EQ(run("phantom --size 256,256,160 --spacing 1.5,1.5,2 --quiet -o large.nrrd").status, 0);
  write_file(
      scratch_ / "m.jsonl",
      R"({"case": "v", "input": "large.nrrd", "field": "elastic:amplitude=2..8,spacing=60..90", "seed": 3, "variants": 40, "inverse": "inverse.nii.gz"})");
  for (const int signal : {SIGTERM, SIGINT}) {
    const pid_t child = fork();
    if (child == 0) {
      if (chdir(scratch_.path().c_str()) != 0) _exit(99);
      freopen("log", "w", stderr);
      execl(TETWARP_PROGRAM, TETWARP_PROGRAM, "batch", "m.jsonl", "-o", "out", "--quiet", "--resume", nullptr);
      _exit(98);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2500));
    const auto asked = std::chrono::steady_clock::now();
    kill(child, signal);
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_LT(std::chrono::steady_clock::now() - asked, std::chrono::seconds(5));
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 130) << read_text(scratch_ / "log");
    EXPECT_EQ(hidden_in(scratch_ / "out"), std::vector<std::string>());
    for (const auto& [id, line] : lines_of("out/results.jsonl")) {
      EXPECT_EQ(line["status"], "done") << line;
      EXPECT_TRUE(fs::exists(scratch_ / "out" / id / "inverse.nii.gz"));
    }
  }
}

TEST_F(Batch, MoreMemoryThanThereIsFailsACaseBeforeItBegins) {
  const Outcome made = batch(kSixCases, "-o out --memory 100M");
  EXPECT_EQ(made.status, 3);
  EXPECT_TRUE(says(made.err, {"warning: a-1: about 200 MB of memory are needed, the batch has 100 MB"}));
  EXPECT_TRUE(says(lines_of("out/results.jsonl").at("b")["reason"], {"--memory"}));
  const Outcome tight = run("batch m.jsonl -o tight --memory 250M --jobs 4 --quiet");
  EXPECT_EQ(tight.status, 0) << "one after the other: " << tight.err;
}

TEST_F(Batch, NothingOfADeidentifiedCaseTellsItsSource) {
  write_file(scratch_ / "key", "a secret of more than sixteen bytes");
  fs::rename(scratch_ / "series", scratch_ / "Mustermann_Erika");
  ASSERT_EQ(
      batch(
          R"({"case": "p1", "input": "Mustermann_Erika", "field": "identity", "output": "dicom", "deidentify": "basic", "deidentify-key": "key"})",
          "-o out --quiet")
          .status,
      0);
  for (const auto& [name, bytes] : files_of("out")) {
    EXPECT_EQ(bytes.find("Mustermann"), std::string::npos) << name;
  }
  EXPECT_EQ(run("batch m.jsonl -o out --resume --quiet").status, 0);
  const std::string before = read_text(scratch_ / "out/p1/case.json");
  write_file(scratch_ / "key", "another secret of more than sixteen bytes");
  EXPECT_EQ(run("batch m.jsonl -o out --resume --quiet").status, 0);
  EXPECT_NE(read_text(scratch_ / "out/p1/case.json"), before) << "another key makes another case";
}

}  // namespace
