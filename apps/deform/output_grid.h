// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>

#include "apps/cli/options.h"
#include "deform/vertex_field.h"

namespace tetwarp::apps {

/// Checks a --grid as far as that is possible before anything is read. @throws UsageError
void check_grid(const std::string& wanted, bool pull);

/// Whether the output has the input's grid.
bool is_same_grid(const std::string& wanted);

/// Whether a --grid is the name of a volume, and what is read of it.
bool names_volume(const std::string& wanted);
InputOptions grid_volume(const std::string& wanted);

/// The output grid that option --grid names.
///
/// @param wanted  "same": the grid of the input; "fit": that grid, grown by whole voxels to hold every vertex where
///         `field` moves it; else a volume file or DICOM folder, whose grid it is. The result is always `straightened`.
/// @param field   used for "fit" only
/// @throws InputError for a file that is no volume, or a lattice that does not reach over the volume where `outside`
///         refuses that
Geometry output_grid(const std::string& wanted, const Geometry& input, const VertexField& field, Outside outside,
                     NiftiFrame frame);

}  // namespace tetwarp::apps
