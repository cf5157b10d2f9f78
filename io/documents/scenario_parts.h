// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: reads points, volumes and cuts of a scenario.
#include "deform/simulate/scenario.h"
#include "io/documents/json_entry.h"

namespace tetwarp {

inline constexpr NumberRange kCoordinateMm{-1e6, 1e6}, kBodyParts{-100, 100};

simulate::ScenarioPoint read_point(const JsonEntry& entry);
/// Reads a length from an object that has one of two keys. @param key_mm  its value is in mm
/// @param key_body  its value is a part of the body's size
simulate::Length read_length(const JsonEntry& entry, const char* key_mm, const char* key_body);
simulate::Zone read_zone(const JsonEntry& entry);
simulate::HuRange read_hu(const JsonEntry& entry);
std::vector<std::int64_t> read_labels(const JsonEntry& entry);
simulate::CutPlan read_cut(const JsonEntry& entry);

}  // namespace tetwarp
