// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "bench/harness/results.h"
#include "bench/itk/itk_accuracy.h"
#include "bench/itk/itk_tasks.h"

namespace tetwarp::bench {

/// One contender on one field; all of a task in turn, each time in a process of its own.
struct ItkRun {
  std::string task;   ///< key of an ItkTask
  std::string field;  ///< "elastic"
  std::int64_t cell_size = 1;
  ItkContender by;
  Summary ms, cpu_ms = {};
  std::uint64_t input_bytes = 0, output_bytes = 0;
  std::uint64_t peak_bytes = 0;  ///< beyond the inputs, the output included; median
  std::optional<Deviation> deviation = {};
};

/// A stream in so many pieces; the file against the one that was written whole.
struct ItkStream {
  ItkContender by;
  int divisions = 1;
  Summary ms, cpu_ms = {};
  std::uint64_t peak_bytes = 0;       ///< beyond the field
  std::uint64_t differing_bytes = 0;  ///< of the files, in all repeats
};

/// Everything that one call of `tetwarp-bench itk` found.
struct ItkResults {
  ItkOptions options;
  Machine machine;
  std::string itk;                                    ///< its version
  std::array<double, 2> load_before{}, load_after{};  ///< averages of 1 and 15 minutes; own processes count after
  std::vector<ItkRun> runs = {};                      ///< by task, field and cell size, ours first
  std::vector<ItkStream> streams = {};                ///< by contender and divisions
};

}  // namespace tetwarp::bench
