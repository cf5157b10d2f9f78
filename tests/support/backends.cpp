// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/support/backends.h"

#include "backend/devices.h"
#include "backend/factories.h"

namespace tetwarp::test {

const std::vector<Backend>& backends() {
  const auto on_cuda = [](const Geometry& output, Limits limits) {
    return make_forward_resampler(BackendKind::cuda, output, 0, limits);
  };
  const auto pull_on_cuda = [](const Geometry& output, Limits limits) {
    return make_pull_resampler(BackendKind::cuda, output, 0, limits);
  };
  const std::string no_cuda =
      !has_cuda() ? "CUDA is not in this build" : (device_count() == 0 ? "no CUDA device on this machine" : "");
  static const std::vector<Backend> all = {
      {.name = "cpu",
       .cannot_run = "",
       .make = make_cpu_resampler,
       .make_pull = make_cpu_pull_resampler,
       .make_renderer = [](Limits limits) { return make_cpu_renderer(limits); },
       .make_adjoint = make_cpu_adjoint},
      {.name = "cuda",
       .cannot_run = no_cuda,
       .make = on_cuda,
       .make_pull = pull_on_cuda,
       .make_renderer = [](Limits limits) { return make_renderer(BackendKind::cuda, 0, limits); },
       .make_adjoint = [](const Geometry& output,
                          Limits limits) { return make_adjoint(BackendKind::cuda, output, 0, limits); }},
  };
  return all;
}

}  // namespace tetwarp::test
