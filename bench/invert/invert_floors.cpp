// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/invert/invert_floors.h"

namespace tetwarp::bench {

namespace {

constexpr double kTimesFaster = 50;

bool is_own(const InverseRun& run) { return run.by == kTetwarp; }

const InverseRun* find_own(const InvertResults& results, const std::string& field) {
  for (const InverseRun& run : results.runs) {
    if (is_own(run) && run.field == field) return &run;
  }
  return nullptr;
}

/// Where a field folds, no inverse is known, and Tetwarp takes another path: there the time is told and not held
/// against anything.
void add_peer(const InverseRun& peer, const InverseRun& own, std::vector<Floor>& floors) {
  const std::string where = peer.field + ", " + peer.by;
  const bool known = peer.accuracy.is_compared();
  floors.push_back({"time / tetwarp's",
                    where,
                    peer.ms.median / own.ms.median,
                    true,
                    known ? std::optional(kTimesFaster) : std::nullopt,
                    {}});
  if (!known) return;
  const Accuracy &theirs = peer.accuracy, &ours = own.accuracy;
  floors.push_back({"mean error / tetwarp's", where, theirs.mean / ours.mean, true, 1, {}});
  floors.push_back({"largest error / tetwarp's", where, theirs.largest / ours.largest, true, 1, {}});
}

void add_own(const InverseRun& own, std::vector<Floor>& floors) {
  const Accuracy& found = own.accuracy;
  floors.push_back({"written without a source", own.field, static_cast<double>(found.written), false, 0, {}});
  floors.push_back({"left out with a source", own.field, static_cast<double>(found.left_out), false, 0, {}});
}

}  // namespace

std::vector<Floor> find_floors(const InvertResults& results) {
  std::vector<Floor> floors;
  for (const InverseRun& run : results.runs) {
    const InverseRun* own = find_own(results, run.field);
    if (is_own(run))
      add_own(run, floors);
    else if (own)
      add_peer(run, *own, floors);
  }
  return floors;
}

}  // namespace tetwarp::bench
