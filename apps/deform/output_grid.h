// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>

#include "apps/cli/options.h"
#include "deform/vertex_field.h"

namespace tetwarp::apps {

/// Checks a --grid as far as that is possible before anything is read. @throws UsageError
void check_grid(const std::string& wanted, bool pull);

// What a --grid says: "same", the grid of the input; "fit", that grid, grown; else a volume file or DICOM folder, whose
// grid it is. The output's grid is straight and even in any case.

/// Whether the output has the input's grid.
bool is_same_grid(const std::string& wanted);
/// Whether the output's grid is known only once the field is.
bool is_fitting_grid(const std::string& wanted);

/// Whether a --grid is the name of a volume, and what is read of it.
bool names_volume(const std::string& wanted);
InputOptions grid_volume(const std::string& wanted);
/// The grid of the volume that a --grid names. @throws InputError for a file that is no volume
Geometry grid_of_volume(const std::string& wanted, NiftiFrame frame);

/// The grid of an input, grown by whole voxels to hold every vertex where a field moves it.
/// @throws InputError for a lattice that does not reach over the volume where `outside` refuses that
Geometry fitting_grid(const Geometry& input, const VertexField& field, Outside outside);

}  // namespace tetwarp::apps
