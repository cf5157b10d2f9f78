// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <cstdint>

namespace tetwarp::test {

/// Makes code with vectors use one instruction set while it lives, and failures name it. With all that there are:
///
///     for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
///       const OnInstructionSet on(target);
class OnInstructionSet {
 public:
  explicit OnInstructionSet(std::int64_t target) : trace_(__FILE__, __LINE__, hwy::TargetName(target)) {
    hwy::SetSupportedTargetsForTest(target);
  }
  ~OnInstructionSet() { hwy::SetSupportedTargetsForTest(0); }
  OnInstructionSet(const OnInstructionSet&) = delete;
  OnInstructionSet& operator=(const OnInstructionSet&) = delete;

 private:
  testing::ScopedTrace trace_;
};

}  // namespace tetwarp::test
