// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "bench/harness/results.h"

namespace tetwarp::bench {

/// The paper's Tables 1 to 4 and what it counts, cell by cell, with ours beside them, in Markdown.
std::string published_tables(const Results& results);

/// The same as JSON.
nlohmann::json published_json(const Results& results);

/// Columns of the table of runs: the paper's times of the same size, field and method, and how many times ours they
/// are.
std::string published_csv_columns();
std::string published_csv_cells(const Results& results, const Run& run);

}  // namespace tetwarp::bench
