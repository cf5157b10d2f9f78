// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <cstdio>
#include <nlohmann/json.hpp>

#include "bench/harness/conclude.h"
#include "bench/simulate/simulate_bench.h"

namespace tetwarp::bench {

int run_simulate(const SimulateOptions& options) {
  require_writable(options.json, {options.scenario});
  const SimulateResults results = measure_simulate(options, [&](const std::string& line) {
    if (options.verbose) std::fprintf(stderr, "%s\n", line.c_str());
  });
  return conclude(results, options.json, options.check);
}

}  // namespace tetwarp::bench
