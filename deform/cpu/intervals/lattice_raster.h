// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <vector>

#include "deform/cpu/intervals/interval_tile.h"
#include "deform/cpu/lattice_index.h"

namespace tetwarp::cpu {

/// Finds who owns voxels of a lattice, tetrahedron after tetrahedron, as `MeshRaster` does of a mesh. It is working
/// memory, one for each thread.
class LatticeRaster {
 public:
  /// Finds the owners in a part of the output of up to kTile voxels on an axis.
  /// @param counts  whether voxels are to be counted out among several owners
  /// @param sink    gets what tetrahedra own, unless null
  void find(const LatticeIndex& lattice, const Region& box, bool counts, IntervalTile& tile, IntervalSink* sink);

 private:
  struct Numbered {
    std::uint64_t number;
    Tetrahedron tetrahedron;
  };

  template <class Visit>
  void for_each(const LatticeIndex& lattice, const Region& box, const IntervalTile& tile, Visit&& visit);

  LatticeBlock block_;
  std::vector<Numbered> listed_;
};

}  // namespace tetwarp::cpu
