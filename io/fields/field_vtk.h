// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. Displacements at the points of a VTK grid: StructuredGrid whose points form a regular lattice,
// ImageData, and RectilinearGrid of even steps; XML (.vts .vti .vtr) and legacy (.vtk) files.
#include "io/fields/field_format.h"

namespace tetwarp {

/// Options: displacement=NAME (of the point vectors; else the only ones, or those called displacement, Displacement, U
/// or u), frame=lps|ras (lps unless given or stated), units=mm|m (mm unless given).
extern const FieldFormat kFieldFormat_vtk;

}  // namespace tetwarp
