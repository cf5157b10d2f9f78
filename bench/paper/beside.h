// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <optional>
#include <string>
#include <vector>

#include "bench/harness/results.h"
#include "bench/paper/fields.h"
#include "bench/paper/published.h"

namespace tetwarp::bench {

/// One cell of the paper's Tables 2 to 4, and one way in which it is measured here: a field as the paper writes it,
/// with an amplitude of ours, and the method as compiled or with the inverse for every candidate voxel.
struct Beside {
  const PublishedTime* paper = nullptr;
  FieldAsWritten field;
  Method method{};
  const Run* ours = nullptr;  ///< null where it was not run with the paper's size and settings
};

/// Every cell in every way, in the order of the paper's tables.
std::vector<Beside> beside_the_paper(const Results& results);
/// The same of one of its tables.
std::vector<Beside> beside_table(const Results& results, int table);

/// The paper's time over ours; none where ours was not run so.
std::optional<double> ratio(const Beside& beside);

/// The paper's time that stands beside a run: same size, formula and method, on a GPU, cells of one voxel, the field
/// evaluated in the kernel. Null for any other run.
const PublishedTime* published_beside(const Results& results, const Run& run, PublishedGpu gpu);

/// The run that the paper's settings ask for; null where there is none.
const Run* run_as_published(const Results& results, const std::string& field, std::int64_t slices, Method method);

/// Why cells of the paper stand alone, each one a phrase; empty where all have ours beside them.
std::vector<std::string> why_apart(const Results& results);

}  // namespace tetwarp::bench
