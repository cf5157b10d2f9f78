// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/harness/options.h"

namespace tetwarp::bench {

int run_io(const Options&) {
  throw NotCompiled(
      "`tetwarp bench io` compares with ITK and DCMTK, and this build lacks one of them; build with both");
}

}  // namespace tetwarp::bench
