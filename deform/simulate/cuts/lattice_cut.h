// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "deform/simulate/cut.h"
#include "deform/simulate/cuts/lattice_numbers.h"

namespace tetwarp::simulate {

/// One cut through the lattice: the side on which each vertex lies, and the cells that the cut goes through.
struct LatticeCut {
  std::vector<double> side;          ///< by lattice vertex: mm, signed
  std::vector<std::uint64_t> cells;  ///< rising
  double nearest = 0;                ///< mm: the least distance of the cut from a vertex

  bool is_through(std::uint64_t cell) const { return std::binary_search(cells.begin(), cells.end(), cell); }
};

/// Finds out where a cut goes through a lattice.
/// @param grid  numbers of the vertices and cells of `lattice`
/// @throws InputError as `CutSurface`
LatticeCut divide_by(const Geometry& lattice, const LatticeNumbers& grid, const Cut& cut);

/// Numbers, rising, of the cells that cuts go through and of all cells around them.
std::vector<std::uint64_t> with_neighbours(const LatticeNumbers& grid, const std::vector<LatticeCut>& divisions);

}  // namespace tetwarp::simulate
