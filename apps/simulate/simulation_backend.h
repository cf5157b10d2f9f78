// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>

#include "deform/simulate/scenario_run.h"

namespace tetwarp::apps {

struct SimulationBackend {
  std::string name;  ///< the one that runs: never "auto"
  simulate::MakeSimulation make;
};

/// @param wanted  auto (CUDA where a device works, else the CPU), cpu or cuda
/// Whether a wish can be met is known when a simulation is made: that throws NotCompiled or DeviceError.
SimulationBackend make_simulation_backend(simulate::Method method, const std::string& wanted, int device,
                                          const Limits& limits);

}  // namespace tetwarp::apps
