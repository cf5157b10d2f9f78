// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "deform/residuals.h"

namespace tetwarp {

/// How a forward field stretches and folds what it moves.
/// All its tetrahedra are measured in double and in mm, from the displacements as given. (A resampler rounds vertices
/// to 2^-12 voxel first.)
struct FieldQuality {
  /// Limits of the bins in which Jacobian determinants are counted: the first bin lies below kEdges[0], bin n from
  /// kEdges[n - 1] up to but not including kEdges[n], the last from the last limit upwards.
  static constexpr std::array<double, 7> kEdges{0, 0.25, 0.5, 0.8, 1.25, 2, 4};

  /// Undeformed volume in each bin. For a lattice the unit is a sixth of a cell: a centre tetrahedron has two, each
  /// other tetrahedron has one. For a mesh the unit is 2^-40 of the whole volume.
  std::array<std::uint64_t, kEdges.size() + 1> parts{};
  /// Largest singular value of the gradient of the forward map: the largest ratio of a deformed to an undeformed
  /// length, over all tetrahedra and directions.
  double largest_stretch = 0;

  /// Share of the undeformed volume in each bin; all shares sum to 1.
  std::array<double, kEdges.size() + 1> shares() const;
};

/// Measures a field in one parallel pass. The result is the same for any number of threads. Tetrahedra of a mesh whose
/// undeformed volume is zero are left out.
/// @throws InputError for a field that has no cell
/// @throws Cancelled
FieldQuality measure_quality(const VertexField& field, const Limits& limits = {}, const Control& control = {});

/// Where a field is worst: the deformed middle of the tetrahedron with the least Jacobian determinant, the first of
/// several, LPS mm; empty for a field without tetrahedra.
/// @throws Cancelled
std::optional<glm::dvec3> worst_place(const VertexField& field, const Limits& limits = {}, const Control& control = {});

/// One sentence for a person that says whether the map can be trusted, and what stands against it.
/// Two things do: folds, and an inverse whose places, taken forward again, miss their voxel by more than (1 + largest
/// stretch) 2^-12 of the longest edge of a voxel. That much is what rounding of places before and after the deformation
/// explains.
std::string verdict(const Report& report, const FieldQuality& quality, const RoundTrip& trip);

}  // namespace tetwarp
