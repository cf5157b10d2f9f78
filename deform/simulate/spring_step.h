// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cmath>
#include <cstdint>

#include "deform/simulate/model.h"

namespace tetwarp::simulate {

inline constexpr int kUp = kDirections / 2;  ///< the first of the directions that lead to higher vertices

/// A link at rest: the vector from a node to its neighbour, mm.
template <class T>
struct RestLink {
  glm::vec<3, T> along;
  T length;
};

template <class T>
TETWARP_HD T dot3(const glm::vec<3, T>& a, const glm::vec<3, T>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

/// A spring at the present displacement.
template <class T>
struct Stretched {
  glm::vec<3, T> along;  ///< from the node to its neighbour, mm
  T length;              ///< mm: that of `along`, or a tiny one in its place
  T tension;             ///< elongation over length: below 1, and negative where the spring is compressed

  /// Length minus rest length, mm.
  TETWARP_HD T elongation() const { return tension * length; }
};

/// The spring of a link. @param apart  displacement of the neighbour minus that of the node, mm
///
/// With rest vector r and e = apart, |r + e| - |r| = (2 r.e + e.e) / (|r + e| + |r|): exactly 0 where e is 0, and
/// without the cancellation in the difference of two lengths. A spring without length pulls nowhere. The quotient is of
/// one, since devices compute quotients of zero, which those of springs at rest would be, in a slow way of their own.
template <class T>
TETWARP_HD Stretched<T> stretched(const RestLink<T>& rest, const glm::vec<3, T>& apart) {
  const T grown = 2 * dot3(rest.along, apart) + dot3(apart, apart);
  const T at_rest = rest.length * rest.length, square = at_rest + grown, least = T(1e-12) * at_rest;
  const T length = std::sqrt(square > least ? square : least);
  return {rest.along + apart, length, grown * (1 / (length * (length + rest.length)))};
}

/// What a spring does to the node at its end.
template <class T>
struct Pull {
  glm::vec<3, T> force{0};  ///< N
  T energy = 0;             ///< N mm: twice the energy of the spring

  Pull() = default;
  TETWARP_HD Pull(const Stretched<T>& spring, T stiffness) {
    const T share = stiffness * spring.tension, elongation = spring.elongation();
    force = share * spring.along;
    energy = stiffness * (elongation * elongation);
  }
  TETWARP_HD Pull operator+(const Pull& other) const {
    Pull sum = *this;
    sum.force += other.force;
    sum.energy += other.energy;
    return sum;
  }
};

/// Which matrix stands for the second derivative of the energy. Each spring with direction n and constant k adds k [(1
/// - t) n n^T + t I], with t as follows.
enum class Stiffness : std::uint8_t {
  /// t = 1: springs keep their directions. This is the global step of the local/global scheme, and never too soft.
  laplacian,
  /// t = tension, 0 where compressed: no spring gives way sideways, so the matrix is never indefinite.
  projected,
  full,  ///< t = tension: the exact second derivative, for Newton's method
};

template <class T>
TETWARP_HD T sideways(Stiffness stiffness, T tension) {
  if (stiffness == Stiffness::laplacian) return 1;
  return stiffness == Stiffness::full || tension > 0 ? tension : T(0);
}

/// Symmetric 3 x 3 matrix.
template <class T>
struct Symmetric {
  T xx, xy, xz, yy, yz, zz;

  TETWARP_HD glm::vec<3, T> operator*(const glm::vec<3, T>& v) const {
    return {xx * v.x + xy * v.y + xz * v.z, xy * v.x + yy * v.y + yz * v.z, xz * v.x + yz * v.y + zz * v.z};
  }
  TETWARP_HD Symmetric operator+(const Symmetric& o) const {
    return {xx + o.xx, xy + o.xy, xz + o.xz, yy + o.yy, yz + o.yz, zz + o.zz};
  }
};

/// The matrix k [(1 - t) n n^T + t I] of one spring, kept as across across^T + even I, for k and 1 - t are never
/// negative.
template <class T>
struct SpringMatrix {
  glm::vec<3, T> across;
  T even;

  TETWARP_HD glm::vec<3, T> operator*(const glm::vec<3, T>& v) const { return across * dot3(across, v) + even * v; }
  TETWARP_HD Symmetric<T> full() const {
    return {across.x * across.x + even, across.x * across.y, across.x * across.z,
            across.y * across.y + even, across.y * across.z, across.z * across.z + even};
  }
};

/// Second derivative of one spring's energy, computed in double.
TETWARP_HD inline SpringMatrix<double> spring_matrix(const Stretched<double>& spring, double stiffness,
                                                     Stiffness kind) {
  const double even = stiffness * sideways(kind, spring.tension), rest = stiffness - even;
  const double root = std::sqrt(rest > 0 ? rest : 0) / spring.length;
  return {root * spring.along, even};
}

/// Inverse of a node's sum of spring matrices, for the preconditioner. The sum is singular, or worse, where springs let
/// the node give way in some direction. So a little of the trace is added and, if that does not make it definite, the
/// trace alone is inverted.
template <class T>
TETWARP_HD Symmetric<T> inverse_block(Symmetric<T> s) {
  const T trace = s.xx + s.yy + s.zz, little = T(1e-4) * trace;
  if (!(trace > 0)) return {};
  s.xx += little, s.yy += little, s.zz += little;
  const T a = s.yy * s.zz - s.yz * s.yz, b = s.xz * s.yz - s.xy * s.zz, c = s.xy * s.yz - s.xz * s.yy;
  const T determinant = s.xx * a + s.xy * b + s.xz * c, minor = s.xx * s.yy - s.xy * s.xy;
  if (s.xx > 0 && minor > 0 && determinant > T(1e-12) * trace * trace * trace) {
    return {a / determinant,
            b / determinant,
            c / determinant,
            (s.xx * s.zz - s.xz * s.xz) / determinant,
            (s.xy * s.xz - s.xx * s.yz) / determinant,
            minor / determinant};
  }
  return {1 / trace, 0, 0, 1 / trace, 0, 1 / trace};
}

}  // namespace tetwarp::simulate
