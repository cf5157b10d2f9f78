// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// `tetwarp bench` becomes the program tetwarp-bench beside it: found, arguments, exit status, signals.
#include <gtest/gtest.h>

#include <csignal>

#include "tests/support/program.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace {

namespace fs = std::filesystem;

/// A copy of tetwarp in a folder of its own, so that only what a test puts there lies beside it.
fs::path copy_tetwarp(const Scratch& scratch) {
  fs::create_directory(scratch / "bin");
  fs::copy_file(TETWARP_PROGRAM, scratch / "bin/tetwarp");
  return scratch / "bin/tetwarp";
}

void write_bench(const Scratch& scratch, const std::string& script) {
  write_file(scratch / "bin/tetwarp-bench", "#!/bin/sh\n" + script);
  fs::permissions(scratch / "bin/tetwarp-bench", fs::perms::owner_all);
}

Outcome run_program(const Scratch& scratch, const fs::path& program, const std::string& arguments) {
  const int status = std::system(
      ("cd '" + scratch.path().string() + "' && '" + program.string() + "' " + arguments + " > .stdout 2> .stderr")
          .c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), read_text(scratch / ".stdout"),
          read_text(scratch / ".stderr")};
}

constexpr const char* kShowArguments = "for word; do printf '[%s]' \"$word\"; done\nexit 7\n";

TEST(BenchCommand, FailsWithTheNameAndThePlaceWhereTheProgramIsMissing) {
  const Scratch scratch;
  const fs::path tetwarp = copy_tetwarp(scratch);
  for (const std::string arguments : {"bench", "bench paper --help"}) {
    const Outcome run = run_program(scratch, tetwarp, arguments);
    EXPECT_EQ(run.status, 1);
    EXPECT_EQ(run.err.rfind("tetwarp: error: ", 0), 0u) << run.err;
    EXPECT_TRUE(says(run.err, {"tetwarp-bench", fs::canonical(scratch / "bin").string(), "TETWARP_BUILD_BENCH=ON"}));
    EXPECT_EQ(run.out, "");
  }
}

TEST(BenchCommand, FailsWhereTheProgramCannotBeRun) {
  const Scratch scratch;
  const fs::path tetwarp = copy_tetwarp(scratch);
  write_file(scratch / "bin/tetwarp-bench", "neither a program nor executable");
  const Outcome run = run_program(scratch, tetwarp, "bench");
  EXPECT_EQ(run.status, 1);
  EXPECT_TRUE(says(run.err, {"tetwarp: error: ", "tetwarp-bench", "cannot be run"}));
}

TEST(BenchCommand, PassesArgumentsUnchangedAndTheExitStatusBack) {
  const Scratch scratch;
  const fs::path tetwarp = copy_tetwarp(scratch);
  write_bench(scratch, kShowArguments);
  const struct {
    const char *arguments, *received;
  } kCases[] = {
      {"", ""},
      {"--help", "[--help]"},
      {"paper 'a folder/x y' --frames=3 -v --size 1,2,3", "[paper][a folder/x y][--frames=3][-v][--size][1,2,3]"},
      {"-- --help", "[--][--help]"},
      {"paper -- -", "[paper][--][-]"},
      {"'' '  ' bench deform --version", "[][  ][bench][deform][--version]"}};
  for (const auto& test : kCases) {
    SCOPED_TRACE(test.arguments);
    const Outcome run = run_program(scratch, tetwarp, std::string("bench ") + test.arguments);
    EXPECT_EQ(run.out, test.received);
    EXPECT_EQ(run.status, 7);
    EXPECT_EQ(run.err, "");
  }
}

TEST(BenchCommand, IsFoundBesideTheTargetOfASymbolicLink) {
  const Scratch scratch;
  const fs::path tetwarp = copy_tetwarp(scratch);
  write_bench(scratch, kShowArguments);
  fs::create_symlink(tetwarp, scratch / "link");
  const Outcome run = run_program(scratch, scratch / "link", "bench cpu");
  EXPECT_EQ(run.out, "[cpu]") << run.err;
  EXPECT_EQ(run.status, 7);
}

TEST(BenchCommand, InterruptsAreNotBlockedInTheProgram) {
  const Scratch scratch;
  const fs::path tetwarp = copy_tetwarp(scratch);
  // Not a script: a shell clears its signal mask when it starts, and would hide a blocked signal.
  ASSERT_EQ(std::system(("ln -s \"$(command -v grep)\" '" + (scratch / "bin/tetwarp-bench").string() + "'").c_str()),
            0);
  const Outcome run = run_program(scratch, tetwarp, "bench SigBlk /proc/self/status");
  ASSERT_EQ(run.out.rfind("SigBlk:", 0), 0u) << run.out << run.err;
  const unsigned long long blocked = std::stoull(run.out.substr(7), nullptr, 16);
  EXPECT_EQ(blocked & (1ull << (SIGINT - 1) | 1ull << (SIGTERM - 1)), 0u) << run.out;
}

TEST(BenchCommand, IsListedInTheHelp) {
  const Scratch scratch;
  const Outcome run = run_tetwarp(scratch.path(), "--help");
  EXPECT_TRUE(says(run.out, {"\n  bench ", "tetwarp-bench"}));
}

}  // namespace
