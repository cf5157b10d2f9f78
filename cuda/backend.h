// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>
#include <string>
#include <vector>

#include "deform/render/renderer.h"

namespace tetwarp {

/// Which way the fields of a resampler map.
enum class Direction {
  forward,  ///< undeformed to deformed points (VertexField)
  pull      ///< output to input points (PullField)
};

/// A resampler, and where it runs.
struct Backend {
  std::string name;                      ///< "cpu" or "cuda", never "auto"
  std::unique_ptr<Resampler> resampler;  ///< the resampler
};

/// Whether a choice of backend means CUDA on this machine: "cuda" always, "auto" where there is a device, any other
/// word never.
bool means_cuda(const std::string& wanted);

/// Makes a resampler on a chosen backend.
/// @param wanted     "auto" (CUDA where a device works, else the CPU), "cpu" or "cuda"
/// @param direction  of the fields that it will take
/// @param output     output grid
/// @param device     number of the CUDA device
/// @param limits     threads and device memory
/// @throws NotCompiled for a backend that this build does not contain
/// @throws DeviceError for a backend that does not work on this machine
Backend make_backend(const std::string& wanted, Direction direction, const Geometry& output, int device,
                     const Limits& limits);

/// A renderer, and where it runs.
struct NamedRenderer {
  std::string name;                    ///< "cpu" or "cuda", never "auto"
  std::unique_ptr<Renderer> renderer;  ///< the renderer
};
/// Makes a renderer on a chosen backend.
/// @param wanted  "auto" (CUDA where a device works, else the CPU), "cpu" or "cuda"
/// @param device  number of the CUDA device
/// @param limits  threads and device memory
/// @throws NotCompiled for a backend that this build does not contain
/// @throws DeviceError for a backend that does not work on this machine
NamedRenderer make_renderer(const std::string& wanted, int device, const Limits& limits);

/// For each backend one line: its name, and whether this machine can use it.
std::vector<std::string> describe_backends();

}  // namespace tetwarp
