// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/cpu/intervals/lattice_raster.h"

#include <algorithm>

namespace tetwarp::cpu {

/// Calls `visit(number, tetrahedron)` for the tetrahedra that may reach a tile, block after block, until it returns
/// false.
template <class Visit>
void LatticeRaster::for_each(const LatticeIndex& lattice, const Region& box, const IntervalTile& tile, Visit&& visit) {
  const glm::i64vec3& cells = lattice.cells();
  bool goes_on = true;
  lattice.find_blocks(box, [&](std::size_t number) {
    if (!goes_on) return;
    lattice.load(number, block_);
    for (int z = 0; z < block_.cells.z; ++z) {
      for (int y = 0; y < block_.cells.y; ++y) {
        for (int x = 0; x < block_.cells.x; ++x) {
          const glm::i64vec3 at = block_.first_cell + glm::i64vec3(x, y, z);
          const Cell cell = block_.cell({x, y, z});
          const Box around = box_of(cell);
          if (!tile.may_reach(around.low, around.high)) continue;
          const auto first =
              static_cast<std::uint64_t>(kTetrahedraPerCell * ((at.z * cells.y + at.y) * cells.x + at.x));
          for (int t = 0; t < kTetrahedraPerCell; ++t)
            goes_on = visit(first + static_cast<std::uint64_t>(t), tetrahedron_of(cell, t, block_.is_odd({x, y, z}))) &&
                      goes_on;
        }
      }
    }
  });
}

void LatticeRaster::find(const LatticeIndex& lattice, const Region& box, bool counts, IntervalTile& tile,
                         IntervalSink* sink) {
  const Nudge& nudge = lattice.frame().nudge;
  tile.begin(box, nudge, counts, sink);
  for_each(lattice, box, tile, [&](std::uint64_t number, const Tetrahedron& t) {
    tile.enter(number, t);
    return !tile.is_shared();
  });
  tile.end();
  if (!tile.is_shared()) return;
  // Some voxel has several owners, and the lowest number is to win: once more, in the order of the numbers.
  listed_.clear();
  for_each(lattice, box, tile, [&](std::uint64_t number, const Tetrahedron& t) {
    listed_.push_back({number, t});
    return true;
  });
  std::sort(listed_.begin(), listed_.end(), [](const Numbered& a, const Numbered& b) { return a.number < b.number; });
  tile.begin(box, nudge, counts, sink);
  for (const Numbered& of : listed_) tile.enter(of.number, of.tetrahedron);
  tile.end();
}

}  // namespace tetwarp::cpu
