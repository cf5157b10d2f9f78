// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/peers/vtk_threads.h"

#include <vtkSMPTools.h>

namespace tetwarp::bench {

void set_vtk_threads(int threads) { vtkSMPTools::Initialize(threads); }
const char* vtk_threads_backend() { return vtkSMPTools::GetBackend(); }

}  // namespace tetwarp::bench
