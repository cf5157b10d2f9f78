// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <tbb/task_arena.h>

#include <fstream>
#include <limits>

#include "bench/harness/results.h"
#include "bench/paper/backend.h"

namespace tetwarp::bench {

namespace {

/// The first "model name" of /proc/cpuinfo; where there is none (not x86), its first "Model", or "unknown".
std::string cpu_name() {
  std::ifstream file("/proc/cpuinfo");
  std::string line, fallback = "unknown";
  while (std::getline(file, line)) {
    const std::size_t colon = line.find(':');
    if (colon == std::string::npos || colon + 2 > line.size()) continue;
    if (line.starts_with("model name")) return line.substr(colon + 2);
    if (line.starts_with("Model")) fallback = line.substr(colon + 2);
  }
  return fallback;
}

}  // namespace

Json describe_machine(int device, int threads) {
  Json machine{{"cpu", cpu_name()},       {"threads", threads > 0 ? threads : tbb::this_task_arena::max_concurrency()},
               {"gpu", nullptr},          {"driver", nullptr},
               {"cuda_runtime", nullptr}, {"compute_capability", nullptr}};
  if (device < 0) return machine;
  const CudaFacts facts = describe_cuda(device);
  machine["gpu"] = facts.name;
  machine["driver"] = facts.driver;
  machine["cuda_runtime"] = facts.runtime;
  machine["compute_capability"] = facts.compute_capability;
  return machine;
}

std::uint64_t available_bytes() {
  std::ifstream file("/proc/meminfo");
  std::string key;
  std::uint64_t kib = 0;
  while (file >> key) {
    if (key == "MemAvailable:" && file >> kib) return kib * 1024;
    file.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
  }
  return std::numeric_limits<std::uint64_t>::max();
}

}  // namespace tetwarp::bench
