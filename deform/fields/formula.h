// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "deform/fields/point_map.h"

namespace tetwarp {

// Deformations for tests, in LPS mm. The paper's Eqs. 14 to 16 leave units and origin open; here they turn around
// `centre`.

/// A plane wave of shear: p' = p + A sin(2 pi d.along / L + phase) axis (the paper's Eq. 14). d is p minus the centre;
/// axes 0, 1, 2 are L, P, S. The inverse is the wave with -A.
struct Wave {
  double amplitude,      ///< A, mm
      wavelength,        ///< L, mm
      phase = 0;         ///< radians
  int axis = 0,          ///< axis of the displacement
      along = 2;         ///< axis along which the wave runs
  glm::dvec3 centre{0};  ///< LPS mm
  /// Displacement p' - p, LPS mm, of a point p, LPS mm.
  glm::dvec3 operator()(const glm::dvec3& point) const;
  /// Displacements of some points: those on one front of the wave share a sine.
  void of_row(std::span<const glm::dvec3> points, glm::dvec3* displacement) const;
};

/// A rotation by angle * d.axis / half_length about an axis through the centre (the paper's Eq. 15), where d is p minus
/// the centre. With a positive angle it turns about S from L towards P. The inverse is the twist with -angle.
struct Twist {
  double angle,          ///< radians at the distance `half_length`
      half_length;       ///< mm
  int axis = 2;          ///< axis of rotation: 0, 1, 2 are L, P, S
  glm::dvec3 centre{0};  ///< LPS mm
  /// Displacement p' - p, LPS mm, of a point p, LPS mm.
  glm::dvec3 operator()(const glm::dvec3& point) const;
  /// Displacements of some points: those on one plane across the axis share the sine and cosine.
  void of_row(std::span<const glm::dvec3> points, glm::dvec3* displacement) const;
};

/// A local inflation around the centre c: p' = c + (1 + a (1 - r/R)^2) d for r = |d| < R, where d = p - c. Outside that
/// ball nothing moves. The map is injective for -1 < a < 3.
struct Bubble {
  double radius,         ///< R, mm
      strength;          ///< a
  glm::dvec3 centre{0};  ///< c, LPS mm
  /// Displacement p' - p, LPS mm, of a point p, LPS mm.
  glm::dvec3 operator()(const glm::dvec3& point) const;
};

/// The paper's Eq. 16 as printed: p' = c + (1 + s/|d|) d, where d = p - c; the centre c stays. It opens a cavity of
/// radius s for s > 0, and folds for s < 0.
struct PaperBubble {
  double shift;          ///< s, mm
  glm::dvec3 centre{0};  ///< c, LPS mm
  /// Displacement p' - p, LPS mm, of a point p, LPS mm.
  glm::dvec3 operator()(const glm::dvec3& point) const;
};

/// Largest distance, along a patient axis (0, 1, 2: L, P, S), of a corner voxel centre from the centre of the volume,
/// mm. It is the length over which a twist reaches its angle.
double half_length(const Geometry& volume, int axis);

/// A twist of a volume about S through its centre, sampled on a lattice with a vertex every `cell_size` voxels.
/// @param volume     grid of the volume
/// @param angle      radians at the largest distance from the centre
/// @param cell_size  voxels
VertexField twist(const Geometry& volume, double angle, std::int64_t cell_size);

/// Names of all formulas.
std::vector<std::string> formula_names();

/// Whether a text begins with the name of a formula (`wave`, `wave:...`); its parameters are not looked at.
bool is_formula(std::string_view text);

/// Parses a formula as the command line takes it (docs/guide/deform.md, "Fields"), such as
/// `wave:amplitude=8,wavelength=64vox`.
/// Lengths are mm; with the suffix `vox` their unit is the spacing of the grid axis nearest to the direction of the
/// length. Angles are degrees.
/// @param text    the formula
/// @param volume  grid that gives the centre and the unit `vox`
/// @throws InputError for an unknown formula; or a key that is unknown, missing, given twice, not a number or out of
///         range
PointMap parse_formula(std::string_view text, const Geometry& volume);

}  // namespace tetwarp
