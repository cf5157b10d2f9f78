// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>
#include <string>
#include <vector>

#include "deform/render/renderer.h"

namespace tetwarp {

enum class Direction { forward, pull };

struct Backend {
  std::string name;  ///< the one that runs: never "auto"
  std::unique_ptr<Resampler> resampler;
};

/// Whether a wish (auto, cpu, cuda) means CUDA on this machine.
bool means_cuda(const std::string& wanted);

/// @param wanted  auto (CUDA where a device works, else the CPU), cpu or cuda
/// @throws NotCompiled for a backend that this build does not have, DeviceError for one that does not work here
Backend make_backend(const std::string& wanted, Direction direction, const Geometry& output, int device,
                     const Limits& limits);

struct NamedRenderer {
  std::string name;  ///< of the backend that runs: never "auto"
  std::unique_ptr<Renderer> renderer;
};
/// @throws as `make_backend`
NamedRenderer make_renderer(const std::string& wanted, int device, const Limits& limits);

/// One line a backend: its name, and whether it can be used on this machine.
std::vector<std::string> describe_backends();

}  // namespace tetwarp
