// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include "backend/backend.h"
#include "backend/devices.h"
#include "deform/errors.h"

namespace tetwarp {
namespace {

constexpr BackendChoice kAll[] = {BackendChoice::automatic, BackendChoice::cpu, BackendChoice::cuda};

TEST(BackendChoice, WordsAreReadBack) {
  EXPECT_EQ(backend_choice("auto"), BackendChoice::automatic);
  EXPECT_EQ(backend_choice("cpu"), BackendChoice::cpu);
  EXPECT_EQ(backend_choice("cuda"), BackendChoice::cuda);
  for (const BackendChoice choice : kAll) EXPECT_EQ(backend_choice(name_of(choice)), choice);
  EXPECT_EQ(backend_words().size(), std::size(kAll));
  for (const std::string& word : backend_words()) EXPECT_EQ(name_of(backend_choice(word)), word);
}

TEST(BackendChoice, OtherWordsAreRefusedAndNotTakenForTheCpu) {
  for (const char* word : {"", "gpu", "CPU", "Cuda", "cuda ", "auto,cpu"}) {
    try {
      backend_choice(word);
      ADD_FAILURE() << "took \"" << word << "\"";
    } catch (const InputError& error) {
      EXPECT_EQ(error.what(), "unknown backend \"" + std::string(word) + "\"; expected auto, cpu or cuda");
    }
  }
}

TEST(BackendChoice, MeansWhatThisMachineHas) {
  EXPECT_EQ(chosen(BackendChoice::cpu), BackendKind::cpu);
  EXPECT_EQ(chosen(BackendChoice::cuda), BackendKind::cuda);
  EXPECT_EQ(runs_on_device(chosen(BackendChoice::automatic)), device_count() > 0);
  EXPECT_STREQ(name_of(BackendKind::cpu), "cpu");
  EXPECT_STREQ(name_of(BackendKind::cuda), "cuda");
}

TEST(BackendChoice, LeavesOpenOrDemandsOrForbidsADevice) {
  for (const BackendChoice choice : kAll) {
    EXPECT_EQ(leaves_open(choice), choice == BackendChoice::automatic);
    EXPECT_EQ(demands_device(choice), choice == BackendChoice::cuda);
    EXPECT_EQ(may_use_device(choice), leaves_open(choice) || demands_device(choice));
  }
}

TEST(BackendChoice, EveryBackendIsDescribed) {
  const std::vector<std::string> lines = describe_backends();
  ASSERT_GE(lines.size(), 2U);
  EXPECT_EQ(lines[0].find("cpu: usable, "), 0U);
  EXPECT_EQ(lines[1].find("cuda: "), 0U);
  EXPECT_EQ(lines.size(), 1U + static_cast<std::size_t>(std::max(1, device_count())));
}

}  // namespace
}  // namespace tetwarp
