// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <tbb/global_control.h>

#include <chrono>

#include "bench/harness/options.h"
#include "bench/harness/turns.h"
#include "bench/itk/itk_work.h"

namespace tetwarp::bench {

int run_itk_alone(const std::filesystem::path& folder) {
  using Clock = std::chrono::steady_clock;
  const ItkFiles files{folder};
  const ItkRequest request = read_request(files);
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                  static_cast<std::size_t>(request.threads));
  const std::unique_ptr<ItkWork> work = make_itk_work(request, files);
  forget_peak();
  const std::uint64_t resident = resident_bytes();
  const double cpu_before = cpu_ms();
  const auto start = Clock::now();
  work->run();
  ItkAnswer answer{.ms = std::chrono::duration<double, std::milli>(Clock::now() - start).count(),
                   .cpu_ms = cpu_ms() - cpu_before,
                   .input_bytes = work->input_bytes(),
                   .output_bytes = work->output_bytes(),
                   .peak_bytes = peak_resident_bytes() - resident};
  if (request.is_compared) answer.deviation = work->deviation();
  write_answer(answer, files);
  return 0;
}

}  // namespace tetwarp::bench
