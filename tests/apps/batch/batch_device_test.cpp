// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// `tetwarp batch`: what becomes of cases whose CUDA device fails, or has too little memory. Faults are injected at
// calls of CUDA (cuda/runtime/fault.h).
#include <cstdlib>

#include "backend/devices.h"
#include "tests/apps/batch/batch_case.h"

namespace {

using namespace tetwarp::test;
using nlohmann::json;

class BatchOnDevice : public BatchCase {
 protected:
  void SetUp() override {
    if (tetwarp::device_count() == 0) GTEST_SKIP() << "cuda: no device";
    BatchCase::SetUp();
  }
  void TearDown() override { unsetenv("TETWARP_CUDA_FAULT"); }

  /// The volumes of a batch, and why cases were made again.
  struct Made {
    int status = 0;
    std::map<std::string, std::string> volumes;
    std::vector<std::string> reasons;
    std::map<std::string, int> workers;
  };
  Made make(const std::string& name, const std::string& fault, const std::string& more) {
    setenv("TETWARP_CUDA_FAULT", fault.c_str(), 1);
    const Outcome outcome = batch(kSixCases, "-o " + name + " --quiet " + more);
    Made made{outcome.status, {}, {}, {}};
    for (const auto& [file, bytes] : files_of(name)) {
      const bool is_volume = file.ends_with(".nii.gz") || file.ends_with(".nrrd") || file.ends_with(".mha");
      if (is_volume) made.volumes[file] = bytes;
    }
    for (const auto& [id, timing] : lines_of(name + "/timings.jsonl")) {
      for (const json& reason : timing.value("made_again", json::array())) made.reasons.push_back(reason);
      if (timing.contains("worker")) ++made.workers[timing["worker"].get<std::string>()];
    }
    return made;
  }
};

TEST_F(BatchOnDevice, CasesThatShareADeviceHaveTheBytesOfTheProcessor) {
  const Made processor = make("cpu", "", "--backend cpu"), device = make("cuda", "", "--backend cuda --jobs 6"),
             alone = make("one", "", "--backend cuda --jobs 1");
  EXPECT_EQ(processor.status, 0);
  EXPECT_GE(processor.volumes.size(), 9u);
  EXPECT_EQ(device.workers, (std::map<std::string, int>{{"cuda", 6}}));
  EXPECT_EQ(device.volumes, processor.volumes);
  EXPECT_EQ(alone.volumes, processor.volumes);
}

TEST_F(BatchOnDevice, MemoryThatIsMissingOnceCostsNothing) {
  const Made whole = make("whole", "", "--backend cuda");
  for (const char* at : {"3", "20", "60"}) {
    SCOPED_TRACE(at);
    const Made made = make(std::string("once") + at, std::string("memory@") + at, "--backend cuda");
    EXPECT_EQ(made.status, 0);
    EXPECT_EQ(made.reasons.size(), 1u);
    EXPECT_EQ(made.volumes, whole.volumes);
    EXPECT_EQ(made.workers, (std::map<std::string, int>{{"cuda", 6}}));
  }
}

TEST_F(BatchOnDevice, WithoutMemoryTheProcessorTakesOverWhereItMay) {
  const Made whole = make("whole", "", "--backend cuda");
  const Made made = make("never", "no-memory@1", "--backend auto");
  EXPECT_EQ(made.status, 0);
  EXPECT_EQ(made.volumes, whole.volumes);
  EXPECT_EQ(made.reasons.size(), 18u) << "alone, in slabs, on the processor";
  EXPECT_EQ(made.workers, (std::map<std::string, int>{{"cpu", 6}}));
  const Made refused = make("refused", "no-memory@1", "--backend cuda");
  EXPECT_EQ(refused.status, 3);
  EXPECT_TRUE(refused.volumes.empty());
}

TEST_F(BatchOnDevice, ALostDeviceIsGivenUp) {
  const Made whole = make("whole", "", "--backend cuda");
  for (const char* at : {"2", "40"}) {
    SCOPED_TRACE(at);
    const Made made = make(std::string("lost") + at, std::string("lost@") + at, "--backend auto --jobs 6");
    EXPECT_EQ(made.status, 0);
    EXPECT_EQ(made.volumes, whole.volumes);
    EXPECT_FALSE(made.reasons.empty());
  }
  if (tetwarp::device_count() > 1) GTEST_SKIP() << "another device takes over";
  const Made refused = make("refused", "lost@2", "--backend cuda");
  EXPECT_EQ(refused.status, 3);
  EXPECT_TRUE(refused.volumes.empty());
}

}  // namespace
