// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>

#include "deform/simulate/scenario_run.h"

namespace tetwarp::apps {

struct SimulationBackend {
  std::string name;  ///< the backend that runs: never "auto"
  simulate::MakeSimulation make;
};

/// Chooses the backend of a simulation. That it cannot be used shows when a simulation is made, which throws
/// NotCompiled or DeviceError.
/// @param wanted  auto (CUDA where a device works, else the CPU), cpu or cuda
SimulationBackend make_simulation_backend(simulate::Method method, const std::string& wanted, int device,
                                          const Limits& limits);

}  // namespace tetwarp::apps
