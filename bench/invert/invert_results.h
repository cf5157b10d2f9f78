// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <optional>
#include <string>
#include <vector>

#include "bench/invert/invert_accuracy.h"
#include "bench/io/io_results.h"

namespace tetwarp::bench {

/// One program's inverse of one field; all of a field on the same threads, in turn.
struct InverseRun {
  std::string field, by;  ///< "wave", "tetwarp"
  Summary ms;
  Summary cpu_ms = {};  ///< of all threads
  Accuracy accuracy = {};
};

/// Everything that one call of `tetwarp-bench invert` found.
struct InvertResults {
  InvertOptions options;
  Machine machine;
  std::optional<std::string> itk;  ///< its version; none: not in this build
  std::vector<InverseRun> runs;    ///< of each field, Tetwarp's first
};

}  // namespace tetwarp::bench
