#include "tests/support/backends.h"

namespace tetwarp::test {

const std::vector<Backend>& backends() {
  static const std::vector<Backend> all = {
      {.name = "cpu", .cannot_run = "", .make = make_cpu_resampler, .make_pull = make_cpu_pull_resampler},
  };
  return all;
}

}  // namespace tetwarp::test
