// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string_view>

#include "deform/fields/point_map.h"

namespace tetwarp {

/// The test deformations. The paper's Eqs. 14-16 leave units and origin open; here c is `centre`,
/// d = p - c, all lengths mm, angles radians; axes 0, 1, 2 are L, P, S.

/// p' = p + A sin(2 pi d.along / L + phase) axis. Inverse: the same with -A.
struct Wave {
  double amplitude, wavelength, phase = 0;
  int axis = 0, along = 2;
  glm::dvec3 centre{0};
  glm::dvec3 operator()(const glm::dvec3& point) const;
};

/// Rotation by angle * (d.axis / half_length) about the axis through the centre; about S from L towards P for a
/// positive angle. Inverse: the same with -angle.
struct Twist {
  double angle, half_length;
  int axis = 2;
  glm::dvec3 centre{0};
  glm::dvec3 operator()(const glm::dvec3& point) const;
};

/// p' = c + (1 + a (1 - r/R)^2) d for r = |d| < R, identity outside. Injective for -1 < a < 3.
struct Bubble {
  double radius, strength;
  glm::dvec3 centre{0};
  glm::dvec3 operator()(const glm::dvec3& point) const;
};

/// Eq. 16 as printed: p' = c + (1 + s/|d|) d, and p' = c at d = 0. Opens a cavity of radius s (s > 0) or folds (s < 0).
struct PaperBubble {
  double shift;
  glm::dvec3 centre{0};
  glm::dvec3 operator()(const glm::dvec3& point) const;
};

/// The smallest half length along a patient axis that holds all corners: h of the twist.
double half_length(const Geometry& volume, int axis);

/// Twist of a volume about S through its centre, on a lattice with a vertex every `cell_size` voxels.
VertexField twist(const Geometry& volume, double angle, std::int64_t cell_size);

/// Whether the text names a formula (`wave`, `wave:...`), known or misspelled parameters aside.
bool is_formula(std::string_view text);

/// A formula of the command line (docs/guide/deform.md, "Fields"), for example `wave:amplitude=8,wavelength=64vox`.
/// Lengths are mm, or with the suffix `vox` the spacing of the grid axis nearest to the direction meant; angles
/// degrees.
/// @throws InputError naming the formula and the key: unknown, missing, given twice, not a number, out of range
PointMap parse_formula(std::string_view text, const Geometry& volume);

}  // namespace tetwarp
