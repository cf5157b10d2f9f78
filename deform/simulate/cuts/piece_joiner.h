// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>

#include "deform/simulate/cuts/lattice_cut.h"
#include "deform/simulate/cuts/tetrahedron_splitter.h"
#include "deform/simulate/divided_lattice.h"

namespace tetwarp::simulate {

/// Finds out which tetrahedra and corners belong together when all cuts are made, and numbers the nodes.
/// @param grid       numbers of the vertices and cells of `lattice`
/// @param split      its cells near the cuts, after all cuts
/// @param divisions  the cuts
/// @return the divided lattice but for `DividedLattice::cuts`, the names
DividedLattice join_pieces(const Geometry& lattice, const LatticeNumbers& grid, const TetrahedronSplitter& split,
                           std::span<const LatticeCut> divisions);

}  // namespace tetwarp::simulate
