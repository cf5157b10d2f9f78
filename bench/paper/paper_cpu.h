// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>

#include "deform/vertex_field.h"

namespace tetwarp::bench {

/// The paper's Algorithm 2 in straightforward C++, the field in memory, on the threads that oneTBB may use. Voxels that
/// no tetrahedron contains keep what `output` holds.
///
/// @param volume  spacing 1, origin 0
/// @param field   a vertex every `cell_size` voxels of the volume
/// @param output  as many voxels as the volume
void run_paper_loop(const Volume<std::int16_t>& volume, const VertexField& field, std::int64_t cell_size,
                    std::int16_t* output);

}  // namespace tetwarp::bench
