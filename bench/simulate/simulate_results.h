// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <optional>
#include <string>
#include <vector>

#include "bench/harness/results.h"
#include "deform/simulate/simulation.h"

namespace tetwarp::bench {

/// The first phase of a scenario in one go, from rest until it has settled.
struct SettleRun {
  std::string method, backend;
  double seconds = 0;  ///< of `advance` alone
  simulate::Settled settled;
};

/// The same way in many frames, each resampled.
struct FrameRun {
  std::string method, backend;
  int steps = 0;                              ///< allowed a frame
  Summary simulate_ms, resample_ms;           ///< of a frame; the second with set_field
  std::optional<Summary> render_ms, turn_ms;  ///< with what set_volume finds; of a volume that stands, from all around
  double frames_per_second = 0;
  simulate::Settled last;  ///< frame
};

/// Everything that one call of `tetwarp-bench simulate` found.
struct SimulateResults {
  SimulateOptions options;
  Machine machine;
  std::string scenario;
  glm::i64vec3 volume{0}, lattice{0};
  std::vector<SettleRun> settle;
  std::vector<FrameRun> frames;
};

}  // namespace tetwarp::bench
