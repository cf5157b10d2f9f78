// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>

#include "deform/simulate/scenario.h"

namespace tetwarp {

/// Reads a scenario (docs/reference/scenario.md, docs/scenario.schema.json).
///
/// What is refused, and why, is said with line and key: "FILE:14: move[1].handle.radius_mm is -3; a number above 0, to
/// 100000 is expected".
///
/// @throws InputError for what is no file of at most 1 MiB, no JSON, or no scenario
simulate::Scenario read_scenario(const std::filesystem::path& path);

}  // namespace tetwarp
