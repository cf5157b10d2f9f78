// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <cstdio>

#include "backend/devices.h"
#include "bench/gpu/gpu_bench.h"
#include "bench/gpu/gpu_report.h"
#include "bench/harness/conclude.h"
#include "bench/harness/input.h"
#include "bench/harness/machine.h"
#include "bench/harness/output_file.h"

namespace tetwarp::bench {

namespace {

/// Before a phantom is made. @throws DeviceError, NotCompiled
void require_device(int device) {
  if (!has_cuda())
    throw NotCompiled("CUDA is not in this build; `tetwarp bench cpu` and `paper --backend cpu` need none");
  const int count = device_count();
  if (device < count) return;
  throw DeviceError("no CUDA device " + std::to_string(device) + ", " + std::to_string(count) +
                    " found; see tetwarp --version, or use tetwarp bench paper --backend cpu");
}

}  // namespace

int run_gpu(const GpuOptions& options) {
  require_writable(options.json, {options.input.path, options.input.raw});
  require_device(options.device);
  GpuResults results = measure_gpu(options, [&](const std::string& line) {
    if (options.verbose) std::fprintf(stderr, "%s\n", line.c_str());
  });
  results.input_kind = input_kind(options.input);
  results.machine = describe_machine(options.device, 0);
  return conclude(results, options.json, options.check);
}

}  // namespace tetwarp::bench
