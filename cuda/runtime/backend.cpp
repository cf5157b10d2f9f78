// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "cuda/backend.h"

#include <thread>

#include "cuda/devices.h"

namespace tetwarp {

bool means_cuda(const std::string& wanted) { return wanted == "cuda" || (wanted == "auto" && cuda_device_count() > 0); }

Backend make_backend(const std::string& wanted, Direction direction, const Geometry& output, int device,
                     const Limits& limits) {
  const bool pull = direction == Direction::pull;
  if (means_cuda(wanted)) {
    return {"cuda",
            pull ? make_cuda_pull_resampler(output, device, limits) : make_cuda_resampler(output, device, limits)};
  }
  return {"cpu", pull ? make_cpu_pull_resampler(output, limits) : make_cpu_resampler(output, limits)};
}

NamedRenderer make_renderer(const std::string& wanted, int device, const Limits& limits) {
  if (means_cuda(wanted)) return {"cuda", make_cuda_renderer(device, limits)};
  return {"cpu", make_cpu_renderer(limits)};
}

std::vector<std::string> describe_backends() {
  std::vector<std::string> lines = {"cpu: usable, " + std::to_string(std::thread::hardware_concurrency()) + " threads"};
  if (!has_cuda()) lines.emplace_back("cuda: not in this build");
  if (has_cuda() && cuda_device_count() == 0) lines.emplace_back("cuda: built in, no device on this machine");
  for (int device = 0; device < cuda_device_count(); ++device) {
    lines.push_back("cuda: usable, device " + std::to_string(device) + " " + describe_cuda_device(device));
  }
  return lines;
}

}  // namespace tetwarp
