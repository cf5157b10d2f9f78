// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "itkbridge/isolated/isolated_read.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <pthread.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <thread>

#include "deform/errors.h"
#include "tests/support/image_samples.h"
#include "tests/support/program.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"

namespace tetwarp {
namespace {

using Records = std::vector<ReadRecord>;

constexpr IsolatedLimits kLimits = {.memory_bytes = std::size_t{128} << 20, .cpu_seconds = 60, .seconds = 60};

/// Reads by the program of the tests (read_program_for_tests.cpp), whose readers misbehave.
class IsolatedRead : public testing::Test {
 protected:
  static Records read(const std::string& kind, const std::string& file = "FILE", const IsolatedLimits& limits = kLimits,
                      const std::stop_token& stop = {}) {
    return read_isolated(kind, file, 0, limits, "Library", stop);
  }
  static std::string why_not(const std::string& kind, const std::string& file = "FILE",
                             const IsolatedLimits& limits = kLimits) {
    return refusal([&] { read(kind, file, limits); });
  }

 private:
  Variable program_{"TETWARP_READ_PROGRAM", TETWARP_TEST_READ_PROGRAM};
};

/// Whether this process has no child, not even one that has ended and was not waited for.
bool has_no_child() { return ::waitpid(-1, nullptr, WNOHANG) == -1 && errno == ECHILD; }

TEST_F(IsolatedRead, ReturnsWhatWasReadWhateverItsSize) {
  const Records records = read("ramp", "1000000");
  ASSERT_EQ(records.size(), 2U);
  EXPECT_EQ(records[0].name, "CompositeTransform_double_3_3");
  EXPECT_TRUE(records[0].head.empty() && records[0].values.empty());
  EXPECT_EQ(records[1].name, "BSplineTransform_double_3_3");
  EXPECT_EQ(records[1].head, (std::vector<double>{1, 0, 3}));
  EXPECT_TRUE(std::signbit(records[1].head[1]));
  ASSERT_EQ(records[1].values.size(), 1'000'000U);
  for (std::size_t n = 0; n < 1'000'000; n += 999) EXPECT_EQ(records[1].values[n], static_cast<double>(n) + 0.5);
  EXPECT_TRUE(has_no_child());
}

TEST_F(IsolatedRead, ThePartThatIsAskedForIsRead) {
  for (const std::uint64_t part : {0U, 7U}) {
    const Records records = read_isolated("part", "FILE", part, kLimits, "Library");
    ASSERT_EQ(records.size(), 1U);
    EXPECT_EQ(records[0].head, std::vector<double>{static_cast<double>(part)});
  }
}

TEST_F(IsolatedRead, WordsOfARefusalArrive) {
  EXPECT_TRUE(says(why_not("refusal"), {"InputError", "7 values, FILE; expected 8"}));
  EXPECT_TRUE(has_no_child());
}

TEST_F(IsolatedRead, AnotherExceptionNamesLibraryAndFile) {
  EXPECT_TRUE(says(why_not("other-exception"), {"InputError", "Library cannot read FILE", "without a result"}));
}

TEST_F(IsolatedRead, CrashIsAnError) {
#ifdef __SANITIZE_ADDRESS__  // which would take the signals for itself
  const Variable untouched("ASAN_OPTIONS",
                           "handle_segv=0:handle_sigbus=0:handle_abort=0:handle_sigfpe=0:handle_sigill=0");
#endif
  for (const int signal : {SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL, SIGKILL}) {
    const std::string file = std::to_string(signal);
    EXPECT_TRUE(says(why_not("signalled", file),
                     {"InputError", "Library cannot read " + file + ": it crashes", ::strsignal(signal)}));
  }
  EXPECT_TRUE(has_no_child());
}

TEST_F(IsolatedRead, ExitIsAnError) {
  EXPECT_TRUE(says(why_not("leaves"), {"InputError", "Library cannot read FILE", "without a result"}));
}

TEST_F(IsolatedRead, EndlessLoopIsAnError) {
  IsolatedLimits limits = kLimits;
  limits.cpu_seconds = 1;
  EXPECT_TRUE(says(why_not("busy", "FILE", limits), {"InputError", "Library cannot read FILE", "1 s of CPU time"}));
  limits.seconds = 1;
  EXPECT_TRUE(says(why_not("idle", "FILE", limits), {"InputError", "Library cannot read FILE", "more than 1 s"}));
  EXPECT_TRUE(has_no_child());
}

TEST_F(IsolatedRead, MemoryBeyondTheLimitIsAnError) {
  EXPECT_EQ(why_not("ramp", std::to_string(kLimits.memory_bytes / 32)), "");
  const std::string why = why_not("ramp", std::to_string(kLimits.memory_bytes / 4));
  EXPECT_TRUE(says(why, {"InputError", "Library cannot read"}));
#ifndef __SANITIZE_ADDRESS__  // which ends the process
  EXPECT_TRUE(says(why, {"more than 128 MiB"}));
#endif
}

TEST_F(IsolatedRead, WorksFromManyThreadsAtOnce) {
  std::vector<std::size_t> counts(8);
  std::vector<std::thread> threads;
  for (std::size_t n = 0; n < counts.size(); ++n) {
    threads.emplace_back([&counts, n] {
      for (int turn = 0; turn < 4; ++turn) counts[n] += read("ramp", std::to_string(n * 1000))[1].values.size();
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (std::size_t n = 0; n < counts.size(); ++n) EXPECT_EQ(counts[n], 4 * n * 1000);
  EXPECT_TRUE(has_no_child());
}

TEST_F(IsolatedRead, ProgramsThatLetTheirChildrenGoReadAsWell) {
  const auto before = ::signal(SIGCHLD, SIG_IGN);
  EXPECT_EQ(read("ramp", "3").size(), 2U);
  EXPECT_TRUE(says(why_not("signalled", std::to_string(SIGSEGV)), {"Library cannot read"}));
  ::signal(SIGCHLD, before);
}

TEST_F(IsolatedRead, WhatIsPrintedIsLost) {
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  EXPECT_TRUE(read("noise").empty());
  EXPECT_EQ(::testing::internal::GetCapturedStderr() + ::testing::internal::GetCapturedStdout(), "");
}

int forks = 0;

TEST_F(IsolatedRead, ThisProcessIsNotCopied) {
  // What fork() calls first; a copy would hold locks of threads that it does not have.
  ASSERT_EQ(::pthread_atfork([] { ++forks; }, nullptr, nullptr), 0);
  const int before = forks;
  read("nothing");
  EXPECT_EQ(forks, before);
}

TEST_F(IsolatedRead, NoFileOfThisProcessIsInherited) {
  // Closed by no exec, and above the numbers that the reader is given: what lies there is replaced, not inherited.
  const int first = ::open("/etc/hostname", O_RDONLY), open = ::fcntl(first, F_DUPFD, 20);
  ASSERT_GE(open, 20);
  const Records records = read("descriptors");
  ::close(open);
  ::close(first);
  ASSERT_EQ(records.size(), 4U);
  for (int n = 0; n < 3; ++n) EXPECT_EQ(records[n].name, "/dev/null");
  EXPECT_TRUE(says(records[3].name, {"pipe:"}));
  EXPECT_EQ(records[3].head, std::vector<double>{3});
}

TEST_F(IsolatedRead, ReadsWhereDescriptorsOfTheStandardStreamsAreFree) {
  int kept[3];
  for (int n = 0; n < 3; ++n) {
    kept[n] = ::fcntl(n, F_DUPFD_CLOEXEC, 10);
    ::close(n);
  }
  const Records records = read("descriptors");
  for (int n = 0; n < 3; ++n) {
    ::dup2(kept[n], n);
    ::close(kept[n]);
  }
  ASSERT_EQ(records.size(), 4U);
  EXPECT_TRUE(says(records[3].name, {"pipe:"}));
}

TEST_F(IsolatedRead, SignalsOfThisProcessAreNotInherited) {
  sigset_t blocked, before;
  sigfillset(&blocked);
  ::pthread_sigmask(SIG_SETMASK, &blocked, &before);
  const auto handler = ::signal(SIGXFSZ, SIG_IGN);
  const Records records = read("signals");
  ::signal(SIGXFSZ, handler);
  ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
  ASSERT_EQ(records.size(), 2U);
  for (const ReadRecord& record : records) EXPECT_EQ(record.head, std::vector<double>{0}) << record.name;
}

TEST_F(IsolatedRead, AStopEndsItAtOnce) {
  std::stop_source source;
  const auto begin = std::chrono::steady_clock::now();
  std::thread later([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    source.request_stop();
  });
  EXPECT_THROW(read("idle", "FILE", kLimits, source.get_token()), Cancelled);
  later.join();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(5));
  EXPECT_THROW(read("ramp", "1000000", kLimits, source.get_token()), Cancelled) << "asked for before it began";
  EXPECT_TRUE(has_no_child());
}

/// Lets `tetwarp info` read a file for which the reader waits for ever, and sends it a signal when it does.
/// The status of tetwarp goes to the file `status`; the script fails if the reader then lives on.
Outcome interrupt_info(const Scratch& scratch, const std::string& signal) {
  std::ofstream(scratch / "x.h5") << "\x89HDF\r\n\x1a\n";
  std::ofstream(scratch / "script") << R"("$2" info x.h5 &
for n in $(seq 400); do
  [ -s process ] && break
  sleep 0.05
done
if [ ! -s process ]; then
  echo "the reader does not begin: is $2 built?" >&2
  exit 1
fi
kill -$1 $!
wait $!
echo $? > status
for n in $(seq 50); do
  [ -e /proc/$(cat process) ] || exit 0
  grep -q '^State:.Z' /proc/$(cat process)/status && exit 0
  sleep 0.1
done
exit 1
)";
  const Variable process("TETWARP_TEST_READ_PROCESS", (scratch / "process").string());
  return run_program(scratch.path(), "/bin/sh", "script " + signal + " '" TETWARP_PROGRAM "'");
}

TEST_F(IsolatedRead, EndsWithTheProgramThatIsKilled) {
  const Scratch scratch;
  const Outcome run = interrupt_info(scratch, "KILL");
  EXPECT_EQ(run.status, 0) << "the reader still runs, " << run.err;
  EXPECT_EQ(read_text(scratch / "status"), "137\n");
}

TEST_F(IsolatedRead, EndsWithTheProgramThatIsInterrupted) {
  for (const std::string signal : {"INT", "TERM"}) {
    const Scratch scratch;
    const Outcome run = interrupt_info(scratch, signal);
    EXPECT_EQ(run.status, 0) << "the reader still runs, " << run.err;
    EXPECT_EQ(read_text(scratch / "status"), "130\n") << run.err;
    EXPECT_TRUE(says(run.err, {"interrupted"}));
  }
}

TEST(IsolatedReadProgram, MissingIsAnErrorThatNamesIt) {
  const Variable none("TETWARP_READ_PROGRAM", "/none/tetwarp-read");
  const std::string why = refusal([] { read_isolated("nothing", "FILE", 0, kLimits, "Library"); });
  EXPECT_TRUE(says(why, {"tetwarp-read", "FILE", "TETWARP_READ_PROGRAM names /none/tetwarp-read"}));
  EXPECT_EQ(why.find("InputError"), std::string::npos) << "the file is not to blame: " << why;
}

TEST(IsolatedReadProgram, OneThatCannotBeginIsNoFaultOfTheFile) {
  for (const auto& [program, word] :
       {std::pair<std::string, std::string>{"/bin/false", "status 1"}, {"/bin/true", "does not answer"}}) {
    const Variable named("TETWARP_READ_PROGRAM", program);
    const std::string why = refusal([] { read_isolated("nothing", "FILE", 0, kLimits, "Library"); });
    EXPECT_TRUE(says(why, {program, "FILE", word, "before it begins"}));
    EXPECT_EQ(why.find("InputError"), std::string::npos) << why;
  }
  const Scratch scratch;
  std::ofstream(scratch / "text") << "no program";
  std::filesystem::permissions(scratch / "text", std::filesystem::perms::owner_all);
  const Variable named("TETWARP_READ_PROGRAM", (scratch / "text").string());
  EXPECT_TRUE(says(refusal([] { read_isolated("nothing", "FILE", 0, kLimits, "Library"); }),
                   {(scratch / "text").string(), "cannot be started"}));
  EXPECT_TRUE(has_no_child());
}

TEST(IsolatedReadProgram, OneThatSaysSomethingElseIsNotBelieved) {
  const auto why_of = [](const std::string& said) {
    const Scratch scratch;
    std::ofstream(scratch / "says") << "#!/bin/sh\nprintf '" + said + "' >&3\n";
    std::filesystem::permissions(scratch / "says", std::filesystem::perms::owner_all);
    const Variable named("TETWARP_READ_PROGRAM", (scratch / "says").string());
    return refusal([] { read_isolated("nothing", "FILE", 0, kLimits, "Library"); });
  };
  const std::string older = why_of("tetwarp-read 0\\n\\002\\000\\000\\000");
  EXPECT_TRUE(says(older, {"FILE", "does not answer as this version expects"}));
  EXPECT_EQ(older.find("InputError"), std::string::npos) << older;
  // A refusal of so many letters that no memory holds them.
  EXPECT_TRUE(says(why_of("tetwarp-read 2\\n\\001\\377\\377\\377\\377\\377\\377\\377\\177"),
                   {"InputError", "Library cannot read FILE", "without a result"}));
}

}  // namespace
}  // namespace tetwarp
