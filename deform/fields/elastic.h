// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>

namespace tetwarp {

/// A smooth random deformation: p' = p + A sum over control points i of B((p - c) / h - i) r_i, where B is the product
/// of a cubic B-spline of each axis (Rueckert et al. 1999, Eq. 1) and r_i are random numbers.
///
/// No component of the displacement exceeds A; its root mean square is about 0.19 A. The map is injective for A < h /
/// 2.48 (Choi and Lee 2000). r_i depends on the seed and the three indices of the control point alone, so a field is
/// the same on every lattice and machine.
struct Elastic {
  double amplitude;      ///< A, mm
  double spacing;        ///< distance h of control points, mm
  std::uint64_t seed;    ///< decides the random numbers
  glm::dvec3 centre{0};  ///< place c of control point (0, 0, 0), LPS mm
  /// Displacement p' - p, LPS mm, of a point p, LPS mm.
  glm::dvec3 operator()(const glm::dvec3& point) const;
  /// Displacements of some points: neighbours share random numbers, and sums over axes along which they do not differ.
  void of_row(std::span<const glm::dvec3> points, glm::dvec3* displacement) const;
};

/// One step of the random generator SplitMix64 (Steele, Lea and Flood 2014) from a state: a hash of 64 bits.
std::uint64_t split_mix(std::uint64_t state);

/// The three numbers r of a control point, each in (-1, 1) and a multiple of 2^-21. They are bits 0-20, 21-41 and 42-62
/// of the hash m(m(m(m(seed) + i) + j) + k), where m is `split_mix`.
glm::dvec3 random_control(std::uint64_t seed, const glm::i64vec3& index);

}  // namespace tetwarp
