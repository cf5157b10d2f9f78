// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <cstdio>

#include "bench/cpu/cpu_bench.h"
#include "bench/cpu/cpu_report.h"
#include "bench/harness/conclude.h"
#include "bench/harness/output_file.h"

namespace tetwarp::bench {

int run_cpu(const CpuOptions& options) {
  require_writable(options.json);
  const CpuResults results = measure_cpu(options, [&](const std::string& line) {
    if (options.verbose) std::fprintf(stderr, "%s\n", line.c_str());
  });
  return conclude(results, options.json, options.check);
}

}  // namespace tetwarp::bench
