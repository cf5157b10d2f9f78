// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "bench/itk/itk_floors.h"

namespace tetwarp::bench {

/// Every number, as one document.
nlohmann::json to_json(const ItkResults& results, const std::vector<Floor>& floors);

/// Tables, and the floors with what came of them, in Markdown.
std::string to_markdown(const ItkResults& results, const std::vector<Floor>& floors);

}  // namespace tetwarp::bench
