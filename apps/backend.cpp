#include "apps/backend.h"

#include <thread>

namespace tetwarp::apps {

Backend make_backend(const std::string& wanted, Direction direction, const Geometry& output, const Limits& limits) {
  if (wanted == "cuda")
    throw NotCompiled("--backend cuda: CUDA is not in this build; use --backend cpu, the bits are the same");
  return {"cpu",
          direction == Direction::pull ? make_cpu_pull_resampler(output, limits) : make_cpu_resampler(output, limits)};
}

std::vector<std::string> describe_backends() {
  return {"cpu: usable, " + std::to_string(std::thread::hardware_concurrency()) + " threads"};
}

}  // namespace tetwarp::apps
