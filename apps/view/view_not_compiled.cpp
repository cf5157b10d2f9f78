// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// What stands in the place of the viewer in a build without it.
#include "apps/cli/options.h"

namespace tetwarp::apps {

int run_view(const ViewOptions&) {
  throw NotCompiled("the viewer is not in this build; build with libturbojpeg0-dev and libboost-dev");
}

}  // namespace tetwarp::apps
