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
  Record line;    ///< of results.jsonl: no clock
  Record timing;  ///< of timings.jsonl: seconds a stage, who resampled
  // For standard error alone, since they may name paths.
  std::string reason;                   ///< why it came to nothing
  std::vector<std::string> made_again;  ///< why it was begun anew
};

/// Runs one case, from its headers to its folder's name. A device that fails is given up, and the case made again on
/// another or on the processor; where its memory runs out, in slabs, then on the processor. The bits are the same.
/// @throws Cancelled; whatever else goes wrong is the outcome
CaseOutcome run_case(const BatchCase& of, const Resources& resources, const std::stop_token& stop);

}  // namespace tetwarp::apps
