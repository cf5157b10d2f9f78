// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// What stands in the place of the viewer in a build without it.
#include "deform/errors.h"
#include "python/src/module.h"

namespace tetwarp::python {

namespace nb = nanobind;

void add_view(nb::module_& core) {
  core.def("Viewer", [](const nb::args&, const nb::kwargs&) {
    throw NotCompiled("the viewer is not in this build; build with libturbojpeg0-dev and libboost-dev");
  });
}

}  // namespace tetwarp::python
