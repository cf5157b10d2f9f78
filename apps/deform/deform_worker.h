// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>

namespace tetwarp::apps {

/// What computes: a backend by its wish (auto, cpu, cuda), and the device of CUDA.
struct Worker {
  std::string backend = "auto";
  int device = 0;
  void* stream = nullptr;  ///< of the device, for all that is queued there; null: its default stream
};

}  // namespace tetwarp::apps
