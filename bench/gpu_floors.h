#pragma once

#include "bench/gpu_results.h"

namespace tetwarp::bench {

/// A ratio within one run, and what it should be.
struct Floor {
  std::string ratio;  ///< "paper / resample"
  std::string where;  ///< "wave", "wave, cells of 4"
  double value = 0;
  bool at_least = true;  ///< otherwise at most
  std::optional<double> required = {}, aim = {};

  bool meets(double limit) const { return at_least ? value >= limit : value <= limit; }
};

/// Every ratio whose runs are there, of medians. "New field" counts set_field, "resample" does not.
std::vector<Floor> find_floors(const GpuResults& results);

/// Whether no floor is missed that is required; aims do not count.
bool all_met(const std::vector<Floor>& floors);

}  // namespace tetwarp::bench
