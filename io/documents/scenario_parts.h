// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: places, regions and cuts of a scenario.
#include "deform/simulate/scenario.h"
#include "io/documents/json_entry.h"

namespace tetwarp {

inline constexpr NumberRange kCoordinateMm{-1e6, 1e6}, kBodyParts{-100, 100};

simulate::Place read_place(const JsonEntry& entry);
/// Of an object that has one of KEY_mm and KEY_body.
simulate::Length read_length(const JsonEntry& entry, const char* key_mm, const char* key_body);
simulate::Zone read_region(const JsonEntry& entry);
simulate::HuRange read_hu(const JsonEntry& entry);
std::vector<std::int64_t> read_labels(const JsonEntry& entry);
simulate::CutPlan read_cut(const JsonEntry& entry);

}  // namespace tetwarp
