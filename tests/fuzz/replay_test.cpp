// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// The kept corpus of one fuzz target, file by file and cut short, in a plain test program: what once crashed stays
// mended. A crash ends the program; the last file that it named is the one.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <ctime>
#include <iostream>
#include <iterator>
#include <vector>

#include "tests/fuzz/input_file.h"

namespace {

constexpr double kSeconds = 5;  // of processor time of all threads, for a file and the shorter files made from it
constexpr rlim_t kMemory = rlim_t{1} << 30;  // writable memory; a reader of such files must never need more

#if defined(__SANITIZE_ADDRESS__)
constexpr bool kSanitized = true;  // it limits allocations itself, and takes more memory for its own use
extern "C" const char* __asan_default_options() { return "max_allocation_size_mb=1024"; }
#else
constexpr bool kSanitized = false;
#endif

std::filesystem::path folder;  // of the corpus

std::vector<std::filesystem::path> corpus() {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) files.push_back(entry.path());
  std::ranges::sort(files);
  return files;
}

double cpu_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// Whole, and at 16 shorter lengths.
void replay(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  const std::vector<char> bytes{std::istreambuf_iterator<char>(stream), {}};
  std::vector<std::size_t> lengths = {bytes.size(), bytes.size() - std::min<std::size_t>(1, bytes.size())};
  for (std::size_t part = 0; part < 15; ++part) lengths.push_back(bytes.size() * part / 15);
  const double begin = cpu_seconds();
  const std::uint64_t taken = accepted_reads();
  for (const std::size_t length : lengths) {
    // A copy of this length alone: the sanitizer sees what is read past its end.
    const std::vector<std::uint8_t> copy(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(length));
    EXPECT_EQ(LLVMFuzzerTestOneInput(copy.data(), copy.size()), 0);
    const bool is_refused = accepted_reads() == taken, must_be = file.filename().string().starts_with("refused-");
    EXPECT_TRUE(is_refused || !must_be) << file;
  }
  EXPECT_LT(cpu_seconds() - begin, kSeconds) << file;
}

TEST(FuzzCorpus, EveryFileIsReadOrRefusedInTime) {
  if (!kSanitized) {
    const rlimit limit{kMemory, kMemory};
    ASSERT_EQ(setrlimit(RLIMIT_DATA, &limit), 0);
  }
  const auto files = corpus();
  for (const auto& file : files) {
    std::cout << file.filename().string() << std::endl;
    replay(file);
  }
  EXPECT_FALSE(files.empty());
  EXPECT_GE(accepted_reads(), 1U) << "no file of the corpus is read: it tests the refusals alone";
}

}  // namespace

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  if (argc != 2) {
    std::cerr << "usage: " << argv[0] << " CORPUS\n";
    return 2;
  }
  folder = argv[1];
  return RUN_ALL_TESTS();
}
