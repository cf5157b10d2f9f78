// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// `tetwarp batch`: processes that share a folder.
#include <fcntl.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <set>
#include <thread>

#include "tests/apps/batch/batch_case.h"

namespace {

using namespace tetwarp::test;
namespace fs = std::filesystem;
using namespace std::chrono_literals;

/// A `tetwarp batch` that goes on until it is killed.
class Running {
 public:
  Running(const fs::path& folder, const std::vector<std::string>& arguments) {
    std::vector<char*> argv = {const_cast<char*>(TETWARP_PROGRAM), const_cast<char*>("batch")};
    for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
    argv.push_back(nullptr);
    child_ = fork();
    if (child_ != 0) return;
    if (chdir(folder.c_str()) != 0) _exit(99);
    freopen("running.log", "w", stderr);
    execv(TETWARP_PROGRAM, argv.data());
    _exit(98);
  }
  ~Running() { end(); }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;

  bool is_there() { return child_ > 0 && waitpid(child_, nullptr, WNOHANG) == 0; }
  void end() {
    if (child_ <= 0) return;
    kill(child_, SIGKILL);
    waitpid(child_, nullptr, 0);
    child_ = -1;
  }

 private:
  pid_t child_ = -1;
};

/// Cases that take long enough to look at them while they are made.
class BatchLock : public BatchCase {
 protected:
  void SetUp() override {
    ASSERT_EQ(run("phantom --size 256,256,160 --spacing 1.5,1.5,2 --quiet -o large.nrrd").status, 0);
    write_file(
        scratch_ / "m.jsonl",
        R"({"case": "v", "input": "large.nrrd", "field": "elastic:amplitude=2..8,spacing=60..90", "seed": 3, "variants": 40, "inverse": "inverse.nii.gz"})");
  }
  std::vector<fs::path> unfinished() const {
    std::vector<fs::path> paths;
    if (!fs::exists(scratch_ / "out")) return paths;
    for (const auto& entry : fs::directory_iterator(scratch_ / "out"))
      if (entry.path().filename().string().starts_with(".tetwarp-partial-")) paths.push_back(entry.path());
    return paths;
  }
  /// Waits until so many cases are in work at once. Looked at a second time they may be finished.
  void wait_for_work(std::size_t cases = 1) const {
    std::size_t most = 0;
    for (int n = 0; n < 1200 && most < cases; ++n) {
      most = std::max(most, unfinished().size());
      if (most < cases) std::this_thread::sleep_for(50ms);
    }
    ASSERT_GE(most, cases) << read_text(scratch_ / "running.log");
  }
  /// Whether a second process is turned away with these words, and leaves the first one's work alone. One that is not
  /// would make all cases: it is ended, with status 137.
  void is_turned_away(const std::string& arguments, const std::vector<std::string>& words,
                      const std::string& manifest = "m.jsonl") const {
    const Outcome second = run_program(
        scratch_.path(), "/usr/bin/env",
        "timeout -s KILL 30 '" TETWARP_PROGRAM "' batch " + manifest + " -o out --quiet --resume " + arguments);
    EXPECT_EQ(second.status, 1) << arguments << second.err;
    EXPECT_TRUE(says(second.err, words)) << arguments;
  }
};

TEST_F(BatchLock, AnotherDivisionWaitsUntilAllOfOneHaveEnded) {
  {
    Running whole(scratch_.path(), {"m.jsonl", "-o", "out", "--quiet"});
    wait_for_work();
    is_turned_away("--shard 1/2", {"another process works on this batch undivided, not divided into 2 shards", "out;"});
    write_file(scratch_ / "out/results.1-of-2.jsonl", "");
    is_turned_away("--merge", {"another process works on this batch undivided"});
    fs::remove(scratch_ / "out/results.1-of-2.jsonl");
    is_turned_away("", {"another process works on this batch, out; wait until it has ended"});
    EXPECT_TRUE(whole.is_there());
  }
  for (const fs::path& path : unfinished()) fs::remove_all(path);
  {
    Running half(scratch_.path(), {"m.jsonl", "-o", "out", "--quiet", "--shard", "1/2"});
    wait_for_work();
    is_turned_away("", {"another process works on this batch divided into 2 shards, not undivided"});
    is_turned_away("--shard 1/3", {"divided into 2 shards, not divided into 3 shards"});
    std::string sorted = R"({"case": "before", "input": "large.nrrd", "field": "identity"})";
    write_file(scratch_ / "other.jsonl", sorted + "\n" + read_text(scratch_ / "m.jsonl"));
    is_turned_away("--shard 2/2", {"works here on other cases, or on these in another order"}, "other.jsonl");
    EXPECT_TRUE(half.is_there());
  }
}

TEST_F(BatchLock, ShardsOfOneDivisionRunSideBySide) {
  Running first(scratch_.path(), {"m.jsonl", "-o", "out", "--quiet", "--shard", "1/2", "--jobs", "1"});
  wait_for_work();
  Running second(scratch_.path(), {"m.jsonl", "-o", "out", "--quiet", "--shard", "2/2", "--jobs", "1"});
  wait_for_work(2);
  EXPECT_TRUE(first.is_there());
  EXPECT_TRUE(second.is_there());
}

TEST_F(BatchLock, AKillLeavesNoLockBehind) {
  write_file(scratch_ / "few.jsonl",
             R"({"case": "v", "input": "large.nrrd", "field": "identity", "variants": 2, "cell-size": 16})");
  for (const char* shard : {"1/1", "1/2", "2/3"}) {
    Running killed(scratch_.path(), {"m.jsonl", "-o", "out", "--quiet", "--resume", "--shard", shard});
    wait_for_work();
    killed.end();
    for (const fs::path& path : unfinished()) fs::remove_all(path);
  }
  const Outcome made = run("batch few.jsonl -o out --quiet --resume");
  EXPECT_EQ(made.status, 0) << made.err;
}

/// Who begins holds the lock alone for an instant, and one that begins at the same time finds it taken.
TEST_F(BatchLock, ALockThatIsFreeAMomentLaterIsWaitedFor) {
  fs::create_directory(scratch_ / "out");
  const int file = ::open((scratch_ / "out/batch.lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  ASSERT_EQ(::flock(file, LOCK_EX), 0);
  std::thread other([&] {
    std::this_thread::sleep_for(700ms);
    ::flock(file, LOCK_UN);
  });
  ASSERT_EQ(run("phantom --size 16,16,8 --spacing 20,20,25 --quiet -o ct.nrrd").status, 0);
  write_file(scratch_ / "few.jsonl", R"({"case": "v", "input": "ct.nrrd", "field": "identity"})");
  const Outcome made = run("batch few.jsonl -o out --quiet --shard 1/2");
  other.join();
  ::close(file);
  EXPECT_EQ(made.status, 0) << made.err;
}

TEST_F(BatchLock, AShardLeavesAloneWhatOthersHaveNotFinished) {
  ASSERT_EQ(run("phantom --size 16,16,8 --spacing 20,20,25 --quiet -o ct.nrrd").status, 0);
  write_file(scratch_ / "few.jsonl", R"({"case": "v", "input": "ct.nrrd", "field": "identity", "variants": 2})");
  for (const char* name : {".tetwarp-partial-1-v-1", ".tetwarp-partial-1-v-2", ".tetwarp-replaced-1-v-1",
                           ".tetwarp-dropped-1-v-2", ".tetwarp-partial-1-batch.2-of-2.json"})
    fs::create_directories(scratch_ / "out" / name);
  for (const char* name : {".tetwarp-partial-1-results.1-of-2.jsonl", ".tetwarp-partial-1-results.2-of-2.jsonl"})
    write_file(scratch_ / "out" / name, "{");
  const Outcome made = run("batch few.jsonl -o out --quiet --shard 1/2");
  EXPECT_EQ(made.status, 0) << made.err;
  std::set<std::string> left;
  for (const auto& entry : fs::directory_iterator(scratch_ / "out")) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with(".tetwarp")) left.insert(name);
  }
  EXPECT_EQ(left,
            (std::set<std::string>{".tetwarp-partial-1-v-2", ".tetwarp-dropped-1-v-2",
                                   ".tetwarp-partial-1-batch.2-of-2.json", ".tetwarp-partial-1-results.2-of-2.jsonl"}));
}

TEST_F(BatchLock, AFolderOfShardsIsContinuedUndivided) {
  write_file(scratch_ / "few.jsonl",
             R"({"case": "v", "input": "large.nrrd", "field": "identity", "variants": 2, "cell-size": 16})");
  ASSERT_EQ(run("batch few.jsonl -o out --quiet --shard 1/2").status, 0);
  EXPECT_TRUE(says(run("batch few.jsonl -o out --quiet").err, {"a batch was begun in out", "--resume"}));
  const Outcome whole = run("batch few.jsonl -o out --resume --log-json");
  EXPECT_EQ(whole.status, 0) << whole.err;
  EXPECT_TRUE(says(whole.err, {R"("cases":1,"event":"batch","finished_before":1)"}));
}

}  // namespace
