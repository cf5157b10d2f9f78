// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

namespace tetwarp::bench {

/// A ratio within one run, or a count, and what it should be.
struct Floor {
  std::string ratio;  ///< "paper / resample", "written without a source"
  std::string where;  ///< "wave", "wave, cells of 4"
  double value = 0;
  bool at_least = true;  ///< otherwise at most
  std::optional<double> required = {}, aim = {};

  bool meets(double limit) const { return at_least ? value >= limit : value <= limit; }
};

/// Whether no floor is missed that is required; aims do not count.
bool all_met(const std::vector<Floor>& floors);

/// All floors with what came of them: a heading, a sentence and a table in Markdown.
std::string to_markdown(const std::vector<Floor>& floors);

/// An array, a floor each.
nlohmann::json to_json(const std::vector<Floor>& floors);

}  // namespace tetwarp::bench
