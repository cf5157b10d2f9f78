// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// What ends a run from outside, and what does not: signals, and readers that go away.
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <thread>

#include "tests/apps/batch/batch_case.h"

namespace {

using namespace tetwarp::test;
namespace fs = std::filesystem;

class Interrupt : public BatchCase {
 protected:
  std::vector<std::string> hidden() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::recursive_directory_iterator(scratch_.path())) {
      const std::string name = entry.path().filename().string();
      if (name.starts_with(".tetwarp")) names.push_back(name);
    }
    return names;
  }

  /// A run that has begun to write pictures.
  pid_t begun_turntable() {
    if (!fs::exists(scratch_ / "large.nrrd")) {
      EXPECT_EQ(run("phantom --size 200,200,200 --spacing 2,2,2 --quiet -o large.nrrd").status, 0);
    }
    const pid_t child = fork();
    if (child == 0) {
      if (chdir(scratch_.path().c_str()) != 0) _exit(99);
      for (const int one : {SIGHUP, SIGQUIT, SIGINT}) ::signal(one, SIG_DFL);
      freopen("log", "w", stderr);
      execl(TETWARP_PROGRAM, TETWARP_PROGRAM, "render", "large.nrrd", "-o", "turn.png", "--turntable", "400", "--quiet",
            nullptr);
      _exit(98);
    }
    const auto begun = std::chrono::steady_clock::now();
    while (hidden().empty() && std::chrono::steady_clock::now() - begun < std::chrono::seconds(60))
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    EXPECT_FALSE(hidden().empty()) << "it was ended before it began";
    return child;
  }

  /// -1: it was not the program that ended it.
  static int exit_status(pid_t child) {
    int status = 0;
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

  void expect_nothing_left(const std::string& of) const {
    EXPECT_EQ(hidden(), std::vector<std::string>()) << of;
    for (const auto& entry : fs::directory_iterator(scratch_.path()))
      EXPECT_FALSE(entry.path().filename().string().starts_with("turn")) << of << entry.path();
  }
};

TEST_F(Interrupt, WhateverEndsARunFromOutsideLeavesNoPartOfIt) {
  for (const int signal : {SIGHUP, SIGQUIT, SIGTERM, SIGINT, SIGXCPU, SIGUSR1, SIGUSR2, SIGALRM}) {
    const pid_t child = begun_turntable();
    kill(child, signal);
    EXPECT_EQ(exit_status(child), 130) << strsignal(signal) << read_text(scratch_ / "log");
    expect_nothing_left(strsignal(signal));
  }
}

TEST_F(Interrupt, ASecondSignalEndsARunAtOnceAndLeavesNoPartOfItEither) {
  for (const int microseconds : {0, 200, 1000, 3000, 10000}) {
    const pid_t child = begun_turntable();
    kill(child, SIGTERM);
    std::this_thread::sleep_for(std::chrono::microseconds(microseconds));
    kill(child, SIGINT);
    const int status = exit_status(child);
    EXPECT_TRUE(status == 130 || status == 128 + SIGTERM) << status;  // the first's, where it was quick enough
    expect_nothing_left(std::to_string(microseconds));
  }
}

TEST_F(Interrupt, AHangupThatNohupKeepsOffStopsNothing) {
  const Outcome made = run_program(
      scratch_.path(), "/bin/sh",
      "-c 'nohup " TETWARP_PROGRAM
      " render ct.nrrd -o turn.png --turntable 40 --size 64,64 --quiet & sleep 0.1; kill -HUP $!; wait $!'");
  EXPECT_EQ(made.status, 0) << made.err;
  EXPECT_TRUE(fs::exists(scratch_ / "turn.0040.png"));
}

/// The first files that a program opens get the numbers of streams that are closed, and what it says goes into them.
TEST_F(Interrupt, WhatIsSaidToAClosedStreamGoesIntoNoFile) {
  write_file(scratch_ / "m.jsonl",
             R"({"case": "v", "input": "ct.nrrd", "field": "identity", "cell-size": 8, "variants": 400})");
  write_file(scratch_ / "script", "'" TETWARP_PROGRAM
                                  "' batch m.jsonl -o out --jobs 1 --log-json <&- >&- 2>&- &\n"
                                  "until [ -s out/results.jsonl ]; do sleep 0.05; done\n"
                                  "sleep 0.2\nkill -KILL $!\nwait $!\n");
  const Outcome killed = run_program(scratch_.path(), "/bin/sh", "script");
  EXPECT_EQ(killed.status, 137) << killed.err << "it was to be killed in the middle";
  std::istringstream results(read_text(scratch_ / "out/results.jsonl"));
  std::size_t lines = 0;
  for (std::string line; std::getline(results, line); ++lines)
    EXPECT_TRUE(line.starts_with(R"({"case":"v-)") && line.find(R"("event")") == std::string::npos) << line;
  EXPECT_GE(lines, 1u);
  const Outcome silent = run_program(scratch_.path(), "/bin/sh", "-c '\"" TETWARP_PROGRAM "\" info ct.nrrd >&-'");
  EXPECT_EQ(silent.status, 1) << "standard output that is closed is an error, as ever";
}

TEST_F(Interrupt, AReaderThatGoesAwayEndsAListAsOfOtherProgramsAndNoWork) {
  const Outcome listed = run_program(scratch_.path(), "/bin/bash",
                                     "-c 'set -o pipefail; " TETWARP_PROGRAM
                                     " info series --json | true; "
                                     "echo ${PIPESTATUS[0]}'");
  EXPECT_TRUE(listed.out == "141\n" || listed.out == "0\n") << listed.out;  // 0: all of it fitted into the pipe before
  EXPECT_EQ(listed.err, "");
  const Outcome worked = run_program(scratch_.path(), "/bin/bash",
                                     "-c '" TETWARP_PROGRAM
                                     " deform series -f identity -o out.nii --verbose "
                                     "2> >(exec 0<&-) >&2; echo $?'");
  EXPECT_EQ(worked.out, "0\n");
  EXPECT_TRUE(fs::exists(scratch_ / "out.nii.json"));
  EXPECT_EQ(hidden(), std::vector<std::string>());
}

}  // namespace
