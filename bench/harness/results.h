// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bench/harness/options.h"
#include "bench/harness/statistics.h"
#include "bench/paper/appendix.h"
#include "bench/paper/compare.h"
#include "bench/paper/method.h"

namespace tetwarp::bench {

/// One method on one field of one volume.
struct Run {
  glm::i64vec3 size{0};
  std::string field, formula;
  std::int64_t cell_size = 1;
  Method method = Method::paper;
  FieldSource source = FieldSource::kernel;
  Summary kernel_ms;  ///< these as in FrameTimes
  std::optional<Summary> field_ms, total_ms, copy_in_ms, copy_out_ms, end_to_end_ms;
  Tally tally;
};

struct Machine {
  std::string cpu;
  int threads = 0;
  std::optional<std::string> gpu = {}, driver = {}, cuda_runtime = {}, compute_capability = {};
};

/// Everything that one call of `tetwarp-bench paper` found.
struct Results {
  PaperOptions options;
  std::string backend;     ///< cuda or cpu
  std::string input_kind;  ///< phantom, dicom, image or raw
  Machine machine;
  Appendix appendix;
  std::vector<Run> runs;
};

}  // namespace tetwarp::bench
