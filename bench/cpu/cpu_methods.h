// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "bench/cpu/cpu_results.h"

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
CpuRun measure_run(const Volume<std::int16_t>& volume, const FieldOnLattice& field, const Beside& beside, int threads,
                   int repeats);

/// Tetwarp on one thread and on all, in turn.
Scaling measure_scaling(const Volume<std::int16_t>& volume, const std::string& field, int threads, int repeats);

/// Reads every byte of source and field and writes every byte of the output, on the threads that oneTBB may use: what
/// a deformation cannot do without.
///
/// @return  depends on every vertex, so that no compiler leaves the reading out
std::uint32_t move_bytes(const Volume<std::int16_t>& source, const VertexField& field,
                         std::vector<std::int16_t>& output);

}  // namespace tetwarp::bench
