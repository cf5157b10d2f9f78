#include "itkbridge/isolated_read.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <numeric>
#include <thread>

#include "deform/errors.h"
#include "tests/support/image_samples.h"
#include "tests/support/says.h"

namespace tetwarp {
namespace {

using Records = std::vector<TransformRecord>;

constexpr IsolatedLimits kLimits = {.memory_bytes = std::size_t{128} << 20, .cpu_seconds = 60, .seconds = 60};

std::string why_not(const std::function<Records()>& read, const IsolatedLimits& limits = kLimits) {
  return refusal([&] { read_isolated(read, limits, "Library", "FILE"); });
}

/// This process has no child, not even one that ended and was not asked for.
bool has_no_child() { return ::waitpid(-1, nullptr, WNOHANG) == -1 && errno == ECHILD; }

TEST(IsolatedRead, ReturnsWhatWasReadWhateverItsSize) {
  TransformRecord large{"BSplineTransform_double_3_3", {1, -0.0, 3}, std::vector<double>(1'000'000)};
  std::iota(large.parameters.begin(), large.parameters.end(), 0.5);
  const Records expected = {{"CompositeTransform_double_3_3", {}, {}}, large};
  const Records actual = read_isolated([&] { return expected; }, kLimits, "Library", "FILE");
  ASSERT_EQ(actual.size(), 2U);
  EXPECT_EQ(actual[0].type, "CompositeTransform_double_3_3");
  EXPECT_TRUE(actual[0].fixed.empty() && actual[0].parameters.empty());
  EXPECT_EQ(actual[1].type, large.type);
  EXPECT_EQ(actual[1].fixed, large.fixed);
  EXPECT_EQ(actual[1].parameters, large.parameters);
  EXPECT_TRUE(has_no_child());
}

TEST(IsolatedRead, WordsOfARefusalArrive) {
  EXPECT_TRUE(says(why_not([]() -> Records { throw InputError("7 values, FILE; expected 8"); }),
                   {"InputError", "7 values, FILE; expected 8"}));
  EXPECT_TRUE(has_no_child());
}

TEST(IsolatedRead, AnotherExceptionNamesLibraryAndFile) {
  EXPECT_TRUE(
      says(why_not([]() -> Records { throw 3; }), {"InputError", "Library cannot read FILE", "without a result"}));
}

TEST(IsolatedRead, CrashIsAnError) {
  for (const int signal : {SIGSEGV, SIGBUS, SIGABRT, SIGFPE, SIGILL}) {
    const std::string why = why_not([&]() -> Records {
      ::raise(signal);
      return {};
    });
    EXPECT_TRUE(says(why, {"InputError", "Library cannot read FILE", ::strsignal(signal)}));
  }
  EXPECT_TRUE(has_no_child());
}

TEST(IsolatedRead, ExitIsAnError) {
  EXPECT_TRUE(
      says(why_not([]() -> Records { ::_exit(0); }), {"InputError", "Library cannot read FILE", "without a result"}));
}

TEST(IsolatedRead, EndlessLoopIsAnError) {
  IsolatedLimits limits = kLimits;
  limits.cpu_seconds = 1;
  const std::string busy = why_not(
      []() -> Records {
        for (volatile bool forever = true; forever;) continue;
        return {};
      },
      limits);
  EXPECT_TRUE(says(busy, {"InputError", "Library cannot read FILE", "1 s of CPU time"}));
  limits.seconds = 1;
  const std::string idle = why_not(
      []() -> Records {
        for (;;) ::pause();
      },
      limits);
  EXPECT_TRUE(says(idle, {"InputError", "Library cannot read FILE", "more than 1 s"}));
  EXPECT_TRUE(has_no_child());
}

TEST(IsolatedRead, MemoryBeyondTheLimitIsAnError) {
  const auto read = [](std::size_t values) {
    return why_not([values] { return Records{{"", {}, std::vector<double>(values, 1.0)}}; });
  };
  EXPECT_EQ(read(kLimits.memory_bytes / 16), "");
  const std::string why = read(kLimits.memory_bytes / 4);
  EXPECT_TRUE(says(why, {"InputError", "Library cannot read FILE"}));
#ifndef __SANITIZE_ADDRESS__  // which ends the process
  EXPECT_TRUE(says(why, {"more than 128 MiB"}));
#endif
}

TEST(IsolatedRead, WorksFromManyThreadsAtOnce) {
  std::vector<std::size_t> counts(8);
  std::vector<std::thread> threads;
  for (std::size_t n = 0; n < counts.size(); ++n) {
    threads.emplace_back([&counts, n] {
      for (int turn = 0; turn < 4; ++turn) {
        const auto read = [n] { return Records{{"", {}, std::vector<double>(n * 1000)}}; };
        counts[n] += read_isolated(read, kLimits, "Library", "FILE")[0].parameters.size();
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (std::size_t n = 0; n < counts.size(); ++n) EXPECT_EQ(counts[n], 4 * n * 1000);
  EXPECT_TRUE(has_no_child());
}

TEST(IsolatedRead, ProgramsThatLetTheirChildrenGoReadAsWell) {
  const auto before = ::signal(SIGCHLD, SIG_IGN);
  const auto read = [] { return Records{{"a", {1}, {2}}}; };
  EXPECT_EQ(read_isolated(read, kLimits, "Library", "FILE").size(), 1U);
  EXPECT_TRUE(says(why_not([]() -> Records {
                     ::raise(SIGSEGV);
                     return {};
                   }),
                   {"Library cannot read FILE"}));
  ::signal(SIGCHLD, before);
}

TEST(IsolatedRead, WhatIsPrintedIsLost) {
  ::testing::internal::CaptureStderr();
  read_isolated(
      [] {
        std::fprintf(stderr, "noise\n");
        return Records{};
      },
      kLimits, "Library", "FILE");
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

}  // namespace
}  // namespace tetwarp
