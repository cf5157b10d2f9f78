// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <cstdio>

#include "bench/harness/conclude.h"
#include "bench/harness/output_file.h"
#include "bench/invert/invert_bench.h"
#include "bench/invert/invert_report.h"

namespace tetwarp::bench {

int run_invert(const InvertOptions& options) {
  require_writable(options.json);
  const InvertResults results = measure_invert(options, [&](const std::string& line) {
    if (options.verbose) std::fprintf(stderr, "%s\n", line.c_str());
  });
  return conclude(results, options.json, options.check);
}

}  // namespace tetwarp::bench
