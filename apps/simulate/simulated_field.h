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
  std::string scenario, scenario_sha256;
  std::string labels, labels_sha256;  ///< empty: none
  std::string method, backend;
};

/// A field that `deform --scenario` makes: at the end of the last phase, as `simulate` writes it.
struct SimulatedField {
  VertexField field;
  SimulationSource source;
  std::vector<std::string> warnings;  ///< for people
};

/// @param options  of which file `scenario` is, and its labels
/// @param ct  INPUT in HU. @throws InputError for a scenario that cannot be played on it, and what a simulation throws
SimulatedField simulate_field(const DeformOptions& options, const simulate::Scenario& scenario,
                              const ConstVolumeView& ct, const Worker& worker, const Control& control);

/// About what a simulation and its field hold, without INPUT.
std::uint64_t simulation_bytes(const simulate::Scenario& scenario, const Geometry& volume, bool labels);

/// Only a mesh holds open cuts. @param every_phase  whether the fields on the way are written too
/// @throws InputError for a phase whose field is written to `output`, and is divided
void require_fitting_format(const simulate::Scenario& scenario, const std::filesystem::path& output, bool every_phase);

}  // namespace tetwarp::apps
