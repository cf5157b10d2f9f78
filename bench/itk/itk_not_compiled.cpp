// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/harness/options.h"

namespace tetwarp::bench {

int run_itk(const Options&) {
  throw NotCompiled("`tetwarp bench itk` compares with ITK, which this build does not have; build with it");
}

int run_itk_alone(const std::filesystem::path&) { return run_itk({}); }

}  // namespace tetwarp::bench
