// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "bench/harness/floors.h"
#include "bench/simulate/simulate_results.h"
#include "deform/resampler.h"

namespace tetwarp::bench {

/// Source and output of a frame loop, where its backend works.
class FrameVolumes {
 public:
  virtual ~FrameVolumes() = default;
  virtual Target target() = 0;
};
/// On a CUDA device. @throws NotCompiled, DeviceError
std::unique_ptr<FrameVolumes> make_device_volumes(const Volume<std::int16_t>& volume, double background);

/// @param say  told of every step @throws InputError for a scenario that cannot be played on the phantom
SimulateResults measure_simulate(const SimulateOptions& options, const std::function<void(const std::string&)>& say);

std::vector<Floor> find_floors(const SimulateResults& results);
std::string to_markdown(const SimulateResults& results, const std::vector<Floor>& floors);
nlohmann::json to_json(const SimulateResults& results, const std::vector<Floor>& floors);

}  // namespace tetwarp::bench
