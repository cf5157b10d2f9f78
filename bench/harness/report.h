// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "bench/harness/results.h"

namespace tetwarp::bench {

/// Every number, as one document.
nlohmann::json to_json(const Results& results);

nlohmann::json to_json(const Summary& ms);
/// null where there is none
nlohmann::json to_json(const std::optional<Summary>& ms);
nlohmann::json size_json(const glm::i64vec3& size);
nlohmann::json to_json(const Machine& machine);
/// "phantom" with its seed, or what else was read.
nlohmann::json input_json(const std::string& kind);

/// Every number, one line a run; the first line names the columns. Speed-ups compare medians; a method that was not
/// run leaves its column empty.
std::string to_csv(const Results& results);

/// How many times faster a run is than another method on the same field and lattice, from medians; Tetwarp with its
/// set_field. None where that method was not run.
std::optional<double> speed_up(const Results& results, const Run& run, Method than);

/// The run of a method with everything else as in `like`; null where it was not run.
const Run* find_run(const Results& results, const Run& like, Method method, FieldSource source);

}  // namespace tetwarp::bench
