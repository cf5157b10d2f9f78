// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "deform/residuals.h"

namespace tetwarp {

/// How a forward field stretches and folds what it moves: all its tetrahedra, in double, in mm, from the displacements
/// as they are given (a resampler snaps them to 2^-12 voxel).
struct FieldQuality {
  /// Between these, and below the first and from the last on, Jacobian determinants are counted.
  static constexpr std::array<double, 7> kEdges{0, 0.25, 0.5, 0.8, 1.25, 2, 4};

  /// Undeformed volume in each bin: sixths of a lattice's cells, of which a centre tetrahedron has two and the others
  /// one; of a mesh, parts that are rounded to 2^-40 of all.
  std::array<std::uint64_t, kEdges.size() + 1> parts{};
  double largest_stretch = 0;  ///< largest singular value of the forward gradient: a length in any direction, over the
                               ///< same at rest

  /// Share of the undeformed volume in each bin of determinants.
  std::array<double, kEdges.size() + 1> shares() const;
};

/// One pass over the field, in parallel; the same result for any number of threads.
/// Tetrahedra of a mesh without undeformed volume are left out.
/// @throws InputError for a field that has no cell, Cancelled
FieldQuality measure_quality(const VertexField& field, const Limits& limits = {}, const Control& control = {});

/// One sentence for a person: whether the map that a call reported on can be trusted, and what stands against it:
/// folds; or an inverse that leads further beside a voxel than (1 + largest stretch) 2^-12 of the longest edge of a
/// voxel, which is what rounding places before and after takes.
std::string verdict(const Report& report, const FieldQuality& quality, const RoundTrip& trip);

}  // namespace tetwarp
