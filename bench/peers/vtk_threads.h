// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Apart from peers_vtk.cpp, for vtkSMPTools.h of VTK 9.1 is not C++20.

namespace tetwarp::bench {

/// How many threads VTK may use from now on.
void set_vtk_threads(int threads);
/// What VTK makes threads with: "TBB", "STDThread", "OpenMP" or "Sequential".
const char* vtk_threads_backend();

}  // namespace tetwarp::bench
