// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <tbb/global_control.h>

#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>

#include "backend/devices.h"
#include "bench/harness/input.h"
#include "bench/harness/machine.h"
#include "bench/harness/output_file.h"
#include "bench/harness/report.h"
#include "bench/paper/paper_bench.h"
#include "bench/paper/tables.h"

namespace tetwarp::bench {

namespace {

bool use_cuda(const PaperOptions& options) {
  if (options.backend != "auto") return options.backend == "cuda";
  if (device_count() > 0) return true;
  std::fprintf(stderr, "no CUDA device: the CPU does it, for minutes to hours unless --width and --slices are small\n");
  return false;
}

}  // namespace

int run_paper(const PaperOptions& options) {
  for (const auto& output : {options.json, options.csv})
    require_writable(output, {options.input.path, options.input.raw});
  std::optional<tbb::global_control> limit;
  if (options.threads > 0) {
    limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(options.threads));
  }
  const bool cuda = use_cuda(options);
  const std::unique_ptr<Backend> backend = cuda ? make_cuda_backend(options.device) : make_cpu_backend(options.threads);
  Results results{.options = options,
                  .backend = cuda ? "cuda" : "cpu",
                  .input_kind = input_kind(options.input),
                  .machine = describe_machine(cuda ? options.device : -1, options.threads),
                  .appendix = measure_appendix(),
                  .runs = {}};
  results.runs = run_all(options, *backend, [&](const std::string& line) {
    if (options.verbose) std::fprintf(stderr, "%s\n", line.c_str());
  });
  std::cout << to_markdown(results);
  write_text(options.json, to_json(results).dump(1) + "\n");
  write_text(options.csv, to_csv(results));
  return 0;
}

}  // namespace tetwarp::bench
