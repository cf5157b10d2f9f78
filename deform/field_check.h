// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>

#include "deform/core/lattice_vertex.h"
#include "deform/core/pull_frame.h"
#include "deform/core/step_lattice.h"
#include "deform/vertex_field.h"

namespace tetwarp {

/// Checks everything about a forward field but its displacements. Every backend begins `set_field` with it.
///
/// A lattice that ends up to 1/256 voxel short of the outermost voxel centres is drawn out to them, whatever becomes of
/// voxels outside it: its maker meant to reach over the volume, and headers are rounded. Its vertices rest where they
/// are drawn to.
/// @throws InputError for a lattice that is empty, too far, too fine, or does not reach over the output
/// (Outside::refuse)
LatticeFrame make_lattice_frame(const Geometry& output, const FieldView& field);
/// Whether a forward field is coarse over an output, so that places are computed in fixed point
/// (docs/design/definition.md, "Coarse fields"). @throws InputError as `make_lattice_frame` for any lattice
bool is_coarse(const Geometry& output, const FieldView& field);
/// Checks a lattice whose displacements lie elsewhere, as the other overload does.
/// @throws InputError as that
LatticeFrame make_lattice_frame(const Geometry& output, const Geometry& lattice, Outside outside);

/// The lattice of a frame as a gather reads it, without its vertices; cells are 0 where it is not along the grid's
/// axes, its vertices are not at whole steps, its cells are thin, or it or the grid is too large for that (4096 voxels
/// an axis, 2^31 vertices).
///
/// Rounding may still put a vertex a step beside its place: whoever snaps the vertices compares
/// (`StepLattice::vertex`).
StepLattice make_step_lattice(const LatticeFrame& frame, const Geometry& output);

/// Checks everything about a pull field but its displacements.
/// @throws InputError for a grid that is empty, too far away, or does not reach over the output (Outside::refuse)
PullFrame make_pull_frame(const Geometry& output, const PullFieldView& field);

/// The part of a source that a pull field's voxels of a region may be sampled from. The frame's samples are on the
/// host.
Region pull_source_region(const PullFrame& frame, const Geometry& grid, const Geometry& output, const Geometry& source,
                          Region region);

/// @throws InputError for the vertex that `LatticeFrame::snap_vertex` could not use
[[noreturn]] void refuse_vertex(const glm::i64vec3& vertex);
/// @throws InputError for the sample of a pull field whose vector is infinite or too long
[[noreturn]] void refuse_sample(const glm::i64vec3& sample);

}  // namespace tetwarp
