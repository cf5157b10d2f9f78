// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// A tetwarp-read whose readers do what a library may do that reads a damaged file. The file's name says how much, or
// which signal.
#include <unistd.h>

#include <bit>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <string>

#include "deform/errors.h"
#include "itkbridge/isolated/read_child.h"

namespace {

using tetwarp::InputError;
using Records = std::vector<tetwarp::ReadRecord>;
using Path = std::filesystem::path;

Records nothing(const Path&, std::uint64_t) { return {}; }

Records ramp(const Path& count, std::uint64_t) {
  tetwarp::ReadRecord record{"BSplineTransform_double_3_3", {1, -0.0, 3}, std::vector<double>(std::stoul(count))};
  std::iota(record.values.begin(), record.values.end(), 0.5);
  return {{"CompositeTransform_double_3_3", {}, {}}, record};
}

/// The part that is asked for.
Records part(const Path&, std::uint64_t number) { return {{"part", {static_cast<double>(number)}, {}}}; }

Records refusal(const Path& file, std::uint64_t) { throw InputError("7 values, " + file.string() + "; expected 8"); }
Records other_exception(const Path&, std::uint64_t) { throw 3; }
Records leaves(const Path&, std::uint64_t) { ::_exit(0); }

Records signalled(const Path& signal, std::uint64_t) {
  ::raise(std::stoi(signal));
  return {};
}

Records busy(const Path&, std::uint64_t) {
  for (volatile bool forever = true; forever;) continue;
  return {};
}

/// Says which process it is, to whoever wants to know, and waits for ever.
Records idle(const Path&, std::uint64_t) {
  if (const char* file = std::getenv("TETWARP_TEST_READ_PROCESS")) std::ofstream(file) << ::getpid();
  for (;;) ::pause();
}

Records noise(const Path&, std::uint64_t) {
  std::fprintf(stderr, "noise\n");
  std::printf("noise\n");
  std::fflush(stdout);
  return {};
}

/// The descriptors that are open, each with what it is.
Records descriptors(const Path&, std::uint64_t) {
  Records records;
  for (int number = 0; number < 1024; ++number) {
    std::error_code closed;
    const Path link = "/proc/self/fd/" + std::to_string(number);
    const std::string what = std::filesystem::read_symlink(link, closed).string();
    if (!closed) records.push_back({what, {static_cast<double>(number)}, {}});
  }
  return records;
}

/// How many signals are blocked, and how many are ignored. 32 and 33 are the C library's own, which it ignores in every
/// program that it starts.
Records signals(const Path&, std::uint64_t) {
  Records records;
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (!line.starts_with("SigBlk:") && !line.starts_with("SigIgn:")) continue;
    const std::uint64_t own = std::uint64_t{3} << 31, found = std::stoull(line.substr(7), nullptr, 16) & ~own;
    records.push_back({line, {static_cast<double>(std::popcount(found))}, {}});
  }
  return records;
}

}  // namespace

int main(int argc, char** argv) {
  constexpr tetwarp::ChildReader kReaders[] = {{"nothing", nothing},    {"ramp", ramp},
                                               {"refusal", refusal},    {"other-exception", other_exception},
                                               {"leaves", leaves},      {"signalled", signalled},
                                               {"busy", busy},          {"idle", idle},
                                               {"noise", noise},        {"descriptors", descriptors},
                                               {"signals", signals},    {"part", part},
                                               {"transform-hdf5", idle}};
  return tetwarp::answer_read(argc, argv, kReaders);
}
