// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>
#include <vector>

#include "deform/cpu/lattice_index.h"
#include "deform/update/updated_target.h"

namespace tetwarp::cpu {

/// What an update of whole targets leaves for the next one, tile by tile: the field by which it was made, and what was
/// reported of each tile.
///
/// A tile depends on the tetrahedra that may reach it. Where none of them has a vertex that moved, neither where they
/// were nor where they are, it has the same voxels as before.
class KeptTiles {
 public:
  explicit KeptTiles(const Geometry& output);

  /// Nothing is kept any more.
  void forget() { targets_.clear(); }
  /// Finds out which tiles have to be made for a field, in parallel in the calling task arena: all, unless these
  /// targets are kept. From then on nothing is kept, until `keep`.
  void compare(const LatticeIndex& field, std::span<const Target> targets);
  /// The targets hold what the field gives.
  void keep(const LatticeIndex& field, std::span<const Target> targets);

  bool is_changed(const Region& tile) const { return changed_[number(tile)] != 0; }
  /// Of a tile, when it was made last.
  Report& report(const Region& tile) { return reports_[number(tile)]; }
  /// The voxels of tiles that have to be made.
  std::vector<Region> changed() const;

 private:
  std::size_t number(const Region& tile) const;
  void mark(const LatticeIndex& field);
  void mark_cell(const LatticeIndex& field, const glm::i64vec3& cell);
  void mark_reached(const Box& box);

  Region all_;  ///< of the output
  glm::i64vec3 tiles_;
  std::vector<std::uint8_t> changed_;
  std::vector<Report> reports_;
  std::vector<UpdatedTarget> targets_;  ///< that are kept; empty: none
  Geometry lattice_;
  Outside outside_ = Outside::refuse;
  std::vector<glm::vec3> displacement_;
  std::vector<std::uint8_t> moved_;  ///< of each vertex, since
};

}  // namespace tetwarp::cpu
