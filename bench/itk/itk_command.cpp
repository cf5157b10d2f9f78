// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <cstdio>

#include "bench/harness/conclude.h"
#include "bench/harness/scratch_folder.h"
#include "bench/itk/itk_bench.h"
#include "bench/itk/itk_report.h"

namespace tetwarp::bench {

int run_itk(const ItkOptions& options) {
  require_writable(options.json);
  const ScratchFolder folder(options.folder);
  const ItkResults results = measure_itk(options, folder.path(), [&](const std::string& line) {
    if (options.verbose) std::fprintf(stderr, "%s\n", line.c_str());
  });
  return conclude(results, options.json, options.check);
}

}  // namespace tetwarp::bench
