// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/batch/manifest.h"
#include "apps/batch/resources.h"
#include "apps/cli/record.h"

namespace tetwarp::apps {

enum class CaseStatus { done, failed, refused };

/// What became of a case.
struct CaseOutcome {
  CaseStatus status = CaseStatus::done;
  Record line;    ///< line of results.jsonl; holds no time
  Record timing;  ///< line of timings.jsonl: seconds of each stage, and which device resampled
  // `reason` and `made_again` are for standard error alone, since they may name paths.
  std::string reason;                   ///< why the case gave no output
  std::vector<std::string> made_again;  ///< why the case was begun again, each time
};

/// Runs one case, from reading its headers to giving its folder the name. After a device failed it is not used any
/// more, and the case is made again on another device or on the CPU. Where the memory of a device is too small, the
/// case is made in slabs, then on the CPU. The outputs have the same bits.
/// @throws Cancelled; all other errors are in the outcome
CaseOutcome run_case(const BatchCase& of, const Resources& resources, const std::stop_token& stop);

}  // namespace tetwarp::apps
