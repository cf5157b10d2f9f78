// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <glm/vec3.hpp>

namespace tetwarp {

/// A smooth random deformation: p' = p + A sum over control points i of B(t - i) r_i, t = (p - c) / h, with the cubic
/// B-spline B of each axis multiplied (Rueckert et al. 1999, Eq. 1) and r_i the random numbers below. No component of
/// the displacement exceeds A; its root mean square is about 0.19 A. Injective for A < h / 2.48 (Choi and Lee 2000).
///
/// r_i depends on the seed and the three indices of the control point alone, so a field is the same on every lattice
/// and machine: additions and multiplications only, no table, no state.
struct Elastic {
  double amplitude;  ///< A, mm
  double spacing;    ///< h of the control points, mm
  std::uint64_t seed;
  glm::dvec3 centre{0};
  glm::dvec3 operator()(const glm::dvec3& point) const;
};

/// One step of SplitMix64 (Steele, Lea and Flood 2014) from a state: a hash of 64 bits.
std::uint64_t split_mix(std::uint64_t state);

/// Three numbers in (-1, 1) of a control point, multiples of 2^-21: bits 0-20, 21-41 and 42-62 of a hash, m(m(m(m(seed)
/// + i) + j) + k), where m is `split_mix`.
glm::dvec3 random_control(std::uint64_t seed, const glm::i64vec3& index);

}  // namespace tetwarp
