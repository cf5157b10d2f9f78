// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. Reads displacements at the points of a VTK grid: StructuredGrid whose points form a regular lattice,
// ImageData, and RectilinearGrid of even steps; XML (.vts .vti .vtr) and legacy (.vtk) files.
#include "io/fields/field_format.h"

namespace tetwarp {

/// Options: displacement=NAME (which vectors at the points; by default the only ones, or those called displacement,
/// Displacement, U or u), frame=lps|ras (default: what the file states, else lps), units=mm|m (default mm).
extern const FieldFormat kFieldFormat_vtk;

}  // namespace tetwarp
