#pragma once

#include <cmath>

#include "deform/simulate/model.h"

namespace tetwarp::simulate {

/// A link at rest: from a node to its neighbour, mm.
template <class T>
struct RestLink {
  glm::vec<3, T> along;
  T length;
};

template <class T>
TETWARP_HD T dot3(const glm::vec<3, T>& a, const glm::vec<3, T>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

/// A spring as it is now.
template <class T>
struct Stretched {
  glm::vec<3, T> unit;  ///< from the node to its neighbour
  T elongation;         ///< mm, length minus rest length
  T tension;            ///< elongation over length: below 1, and below 0 where compressed
};

/// @param apart  displacement of the neighbour minus that of the node, mm
///
/// With rest vector r and e apart, |r + e| - |r| = (2 r.e + e.e) / (|r + e| + |r|): exactly 0 where e is 0, and without
/// the cancellation of the difference of two lengths. A spring without length pulls nowhere.
template <class T>
TETWARP_HD Stretched<T> stretched(const RestLink<T>& rest, const glm::vec<3, T>& apart) {
  const T grown = 2 * dot3(rest.along, apart) + dot3(apart, apart);
  const T square = rest.length * rest.length + grown, least = T(1e-12) * rest.length * rest.length;
  const T length = std::sqrt(square > least ? square : least);
  const T elongation = grown / (length + rest.length);
  return {(rest.along + apart) / length, elongation, elongation / length};
}

/// What is taken for the second derivative of the energy, k [(1 - t) n n^T + t I] of each spring with direction n.
enum class Stiffness : std::uint8_t {
  laplacian,  ///< t = 1: springs that keep their directions, the global step of the local/global scheme; never too soft
  projected,  ///< t = tension, 0 where compressed: no spring gives way sideways, so never indefinite
  full,       ///< t = tension: Newton's
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
  TETWARP_HD void add(const Symmetric& o) { xx += o.xx, xy += o.xy, xz += o.xz, yy += o.yy, yz += o.yz, zz += o.zz; }
};

/// Second derivative of one spring's energy.
template <class T>
TETWARP_HD Symmetric<T> spring_block(const Stretched<T>& spring, T stiffness, Stiffness kind) {
  const T t = sideways(kind, spring.tension), along = stiffness * (1 - t), all = stiffness * t;
  const glm::vec<3, T>& n = spring.unit;
  return {along * n.x * n.x + all, along * n.x * n.y, along * n.x * n.z,
          along * n.y * n.y + all, along * n.y * n.z, along * n.z * n.z + all};
}

/// Inverse of a node's sum of blocks, for the preconditioner. Where springs leave the node a way to give, or more than
/// that (a full block), it is made definite: first a little of the trace is added, then only the diagonal is taken.
template <class T>
TETWARP_HD Symmetric<T> inverse_block(Symmetric<T> s, T sum_of_stiffness) {
  const T little = T(1e-4) * sum_of_stiffness;
  s.xx += little, s.yy += little, s.zz += little;
  const T a = s.yy * s.zz - s.yz * s.yz, b = s.xz * s.yz - s.xy * s.zz, c = s.xy * s.yz - s.xz * s.yy;
  const T determinant = s.xx * a + s.xy * b + s.xz * c, minor = s.xx * s.yy - s.xy * s.xy;
  if (s.xx > 0 && minor > 0 && determinant > T(1e-12) * sum_of_stiffness * sum_of_stiffness * sum_of_stiffness) {
    return {a / determinant,
            b / determinant,
            c / determinant,
            (s.xx * s.zz - s.xz * s.xz) / determinant,
            (s.xy * s.xz - s.xx * s.yz) / determinant,
            minor / determinant};
  }
  const T one = sum_of_stiffness > 0 ? 1 / sum_of_stiffness : T(0);
  return {one, 0, 0, one, 0, one};
}

}  // namespace tetwarp::simulate
