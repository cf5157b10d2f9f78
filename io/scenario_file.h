// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <string>

#include "deform/simulate/scenario.h"

namespace tetwarp {

/// Most bytes of a scenario file: recordings of a hand are long.
inline constexpr std::size_t kMostScenarioBytes = std::size_t{8} << 20;

/// Reads a scenario from a JSON file; docs/reference/scenario.md and docs/scenario.schema.json describe the keys.
///
/// @throws InputError for a file that is larger than 8 MiB, no JSON, or no scenario. The message names line and key:
///         "FILE:14: move[1].handle.radius_mm is -3; a number above 0, to 100000 is expected".
simulate::Scenario read_scenario(const std::filesystem::path& path);

/// The text of a scenario file that is read as this scenario again, to the last bit of every number: a phase a line.
/// What a file may leave out is there, and "$schema" is not. Directions should be as `scaled_direction` gives them.
/// @throws InputError for a scenario without phases
std::string scenario_text(const simulate::Scenario& scenario);

}  // namespace tetwarp
