#pragma once

#include <string>

namespace tetwarp::apps {

/// What computes: a backend by its wish (auto, cpu, cuda), and the device of CUDA.
struct Worker {
  std::string backend = "auto";
  int device = 0;
};

}  // namespace tetwarp::apps
