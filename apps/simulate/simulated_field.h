// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/cli/options.h"
#include "apps/deform/deform_worker.h"
#include "deform/simulate/scenario.h"
#include "deform/vertex_field.h"

namespace tetwarp::apps {

/// The files that a simulated field is made of, other than INPUT, with their SHA-256.
struct SimulationSource {
  std::string scenario, scenario_sha256;  ///< path as it was given, and hash of the file
  std::string labels, labels_sha256;      ///< empty: there are no labels
  simulate::Method method;
  std::string backend;  ///< "cpu" or "cuda"
};

/// The field that `deform --scenario` makes: that of the end of the last phase, which `simulate` would write.
struct SimulatedField {
  VertexField field;
  SimulationSource source;
  std::vector<std::string> warnings;  ///< for people
};

/// Simulates a scenario.
/// @param options  names the file that `scenario` was read from, and its labels
/// @param ct       INPUT in HU, whole
/// @param worker   the device and stream to compute on
/// @param control  progress counts frames; stopping throws Cancelled
/// @throws InputError for a scenario that cannot be played on it, and whatever a simulation throws
SimulatedField simulate_field(const DeformOptions& options, const simulate::Scenario& scenario,
                              const ConstVolumeView& ct, const Worker& worker, const Control& control);

/// About how many bytes a simulation and its field take, beside INPUT. @param volume  grid of INPUT
/// @param labels  whether a volume of labels of the same size is read too
std::uint64_t simulation_bytes(const simulate::Scenario& scenario, const Geometry& volume, bool labels);

/// Refuses a format that cannot hold the field of a phase: only a mesh can hold open cuts. @param every_phase  whether
/// the field of every phase is written, not only the last
/// @throws InputError for a phase whose field has divided cells and is written to `output`
void require_fitting_format(const simulate::Scenario& scenario, const std::filesystem::path& output, bool every_phase);

}  // namespace tetwarp::apps
