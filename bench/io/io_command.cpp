// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <tbb/global_control.h>
#include <tbb/info.h>

#include <cstdio>
#include <optional>

#include "bench/harness/conclude.h"
#include "bench/harness/machine.h"
#include "bench/harness/output_file.h"
#include "bench/harness/scratch_folder.h"
#include "bench/io/io_bench.h"
#include "bench/io/io_report.h"

namespace tetwarp::bench {

int run_io(const IoOptions& options) {
  require_writable(options.json);
  const ScratchFolder folder(options.folder);
  std::optional<tbb::global_control> limit;
  if (options.threads > 0)
    limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(options.threads));
  IoResults results = measure_io(options, folder.path(), [&](const std::string& line) {
    if (options.verbose) std::fprintf(stderr, "%s\n", line.c_str());
  });
  results.machine = describe_machine(-1, options.threads > 0 ? options.threads : tbb::info::default_concurrency());
  return conclude(results, options.json, options.check);
}

}  // namespace tetwarp::bench
