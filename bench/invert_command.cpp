// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <cstdio>

#include "bench/conclude.h"
#include "bench/invert_bench.h"
#include "bench/invert_report.h"
#include "bench/output_file.h"

namespace tetwarp::bench {

int run_invert(const InvertOptions& options) {
  require_writable(options.json);
  const InvertResults results = measure_invert(options, [&](const std::string& line) {
    if (options.verbose) std::fprintf(stderr, "%s\n", line.c_str());
  });
  return conclude(results, options.json, options.check);
}

}  // namespace tetwarp::bench
