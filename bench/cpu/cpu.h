// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "bench/harness/results.h"
#include "deform/vertex_field.h"

namespace tetwarp::bench {

/// What is measured beside Tetwarp, in turn with it.
struct Beside {
  bool second_volume = false, bytes = false, paper = false, itk_warp = false, itk_invert_and_warp = false,
       vtk_probe = false;
};

/// A field of `make_test_field` on a lattice.
struct FieldOnLattice {
  std::string name;
  std::int64_t cell_size = 1;
  std::optional<glm::i64vec3> like = {};  ///< size of the volume that it is the field of; the volume's own where none
};

/// A field on a volume of spacing 1 at origin 0. Where it is another volume's, its middle is laid on this one's
/// (elastic has none). ITK's inverter and VTK's probe run once, everything else `repeats` times, after one that is not
/// timed where memory is allocated in it.
///
/// | of the row | what it is |
/// | --- | --- |
/// | set_field_ms, resample_ms | Tetwarp; with the range of Jacobian determinants |
/// | new_field_ms | both |
/// | at_rest, covered | fraction of the vertices that do not move; voxels |
/// | resting | where slices rest and have resting neighbours: their share, and a new field of them alone |
/// | two_volumes_ms | resampling two volumes at once |
/// | bytes_ms | reading field and source once and writing the output once |
/// | paper | Algorithm 2, the field in memory, the output cleared first |
/// | itk_warp | given the inverse |
/// | itk_invert_and_warp, vtk_probe | peers that take minutes |
///
/// A peer has its times, and `differing`: the fraction of the voxels covered by Tetwarp whose values differ by more
/// than 1. What was not measured is null.
Json measure_run(const Volume<std::int16_t>& volume, const FieldOnLattice& field, const Beside& beside, int threads,
                 int repeats);

/// Tetwarp on one thread and on all, in turn. `efficiency`: how much of the work of all threads is left where each
/// could do what one alone does.
Json measure_scaling(const Volume<std::int16_t>& volume, const std::string& field, int threads, int repeats);

/// Reads every byte of source and field and writes every byte of the output, on the threads that oneTBB may use: what
/// a deformation cannot do without.
///
/// @return  depends on every vertex, so that no compiler leaves the reading out
std::uint32_t move_bytes(const Volume<std::int16_t>& source, const VertexField& field,
                         std::vector<std::int16_t>& output);

/// Every ratio whose runs are there, of medians. "New field" counts set_field, "resample" does not; "bytes" is moving
/// field, source and output once.
Floors find_cpu_floors(const Json& document);

}  // namespace tetwarp::bench
