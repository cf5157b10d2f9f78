// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <nanobind/nanobind.h>

namespace tetwarp::python {

// Each adds its part to the module `tetwarp._core`.

void add_adjoint(nanobind::module_& core);
void add_errors(nanobind::module_& core);
void add_geometry(nanobind::module_& core);
void add_fields(nanobind::module_& core);
void add_resampler(nanobind::module_& core);
void add_files(nanobind::module_& core);
void add_simulation(nanobind::module_& core);
void add_render(nanobind::module_& core);
void add_view(nanobind::module_& core);

}  // namespace tetwarp::python
