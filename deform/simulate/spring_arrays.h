// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <bit>
#include <cstdint>

#include "deform/simulate/rigid_motion.h"
#include "deform/simulate/spring_engine.h"
#include "deform/simulate/spring_step.h"

namespace tetwarp::simulate {

/// What a device reads of a node at once.
template <class T>
struct alignas(16) Quad {
  T x, y, z, w;
};

/// A vector for each node. In host memory the components are apart, for the CPU's vectors: x of node n at data[n], y at
/// data[stride + n], z at data[2 stride + n]. On a device they are the first of a Quad.
template <class T>
struct NodeVectors {
  T* data = nullptr;
  std::size_t stride = 0;

#ifdef TETWARP_ON_DEVICE
  TETWARP_HD glm::vec<3, T> operator[](std::size_t n) const {
    const Quad<T> v = reinterpret_cast<const Quad<T>*>(data)[n];
    return {v.x, v.y, v.z};
  }
  TETWARP_HD void set(std::size_t n, const glm::vec<3, T>& v) const {
    reinterpret_cast<Quad<T>*>(data)[n] = {v.x, v.y, v.z, 0};
  }
#else
  TETWARP_HD T* axis(std::size_t a) const { return data + a * stride; }
  TETWARP_HD glm::vec<3, T> operator[](std::size_t n) const {
    return {data[n], data[stride + n], data[2 * stride + n]};
  }
  TETWARP_HD void set(std::size_t n, const glm::vec<3, T>& v) const {
    data[n] = v.x, data[stride + n] = v.y, data[2 * stride + n] = v.z;
  }
#endif
};

/// A symmetric matrix for each node, the entries apart in the order of Symmetric.
struct NodeMatrices {
  static constexpr std::size_t kEntries = 6;
  float* data = nullptr;
  std::size_t stride = 0;

  TETWARP_HD float* entry(std::size_t e) const { return data + e * stride; }
  TETWARP_HD Symmetric<float> operator[](std::size_t n) const {
    return {entry(0)[n], entry(1)[n], entry(2)[n], entry(3)[n], entry(4)[n], entry(5)[n]};
  }
  TETWARP_HD void set(std::size_t n, const Symmetric<float>& s) const {
    entry(0)[n] = s.xx, entry(1)[n] = s.xy, entry(2)[n] = s.xz, entry(3)[n] = s.yy, entry(4)[n] = s.yz,
    entry(5)[n] = s.zz;
  }
};

/// The upper half of a float (bfloat16): its range, and 8 bits of precision. Rounds to the nearest, ties to even.
struct Bfloat16 {
  std::uint16_t bits = 0;

  Bfloat16() = default;
  TETWARP_HD explicit Bfloat16(double number) {
    const auto whole = std::bit_cast<std::uint32_t>(static_cast<float>(number));
    bits = static_cast<std::uint16_t>((whole + 0x7fff + (whole >> 16 & 1)) >> 16);
  }
  TETWARP_HD operator float() const { return std::bit_cast<float>(std::uint32_t{bits} << 16); }
};

/// The matrix of a link as it is kept. What a product with all matrices costs is reading them, and a direction that is
/// sought need not be exact.
struct alignas(8) KeptMatrix {
  static constexpr std::size_t kEntries = 4;
  Bfloat16 x, y, z, even;

  TETWARP_HD explicit KeptMatrix(const SpringMatrix<double>& m)
      : x(m.across.x), y(m.across.y), z(m.across.z), even(m.even) {}
  TETWARP_HD SpringMatrix<float> in_float() const { return {{x, y, z}, even}; }
};

/// The matrix of the link up from each node in each direction kUp + up. In host memory the entries of KeptMatrix are
/// apart.
struct LinkMatrices {
  Bfloat16* data = nullptr;
  std::size_t stride = 0;

#ifdef TETWARP_ON_DEVICE
  TETWARP_HD KeptMatrix& at(std::size_t up, std::size_t n) const {
    return reinterpret_cast<KeptMatrix*>(data)[up * stride + n];
  }
  TETWARP_HD SpringMatrix<float> get(std::size_t up, std::size_t n) const { return at(up, n).in_float(); }
  TETWARP_HD void set(std::size_t up, std::size_t n, const KeptMatrix& m) const { at(up, n) = m; }
#else
  TETWARP_HD Bfloat16* entry(std::size_t up, std::size_t e) const {
    return data + (KeptMatrix::kEntries * up + e) * stride;
  }
  TETWARP_HD SpringMatrix<float> get(std::size_t up, std::size_t n) const {
    return {{entry(up, 0)[n], entry(up, 1)[n], entry(up, 2)[n]}, entry(up, 3)[n]};
  }
  TETWARP_HD void set(std::size_t up, std::size_t n, const KeptMatrix& m) const {
    entry(up, 0)[n] = m.x, entry(up, 1)[n] = m.y, entry(up, 2)[n] = m.z, entry(up, 3)[n] = m.even;
  }
#endif
};

/// The state of conjugate gradients between sweeps, in the machine's memory.
struct GradientState {
  SolveEffort effort;
  double rz = 0, least = 0, gained = 0;
  float length = 0, share = 0;
  int iterations = 0;
  bool is_indefinite = false;
  bool descends = false;  ///< whether the last Bend found a way that Descend is to go
  bool is_done = false;   ///< after that way, if there is one
  Sums there = {};        ///< of StrainOf, at the displacement to which the direction leads
};

/// A system of springs that is to be solved, in one go or part by part.
struct SolveTask {
  Stiffness kind;
  /// Whether free nodes follow placed ones that go their way; otherwise they follow the net forces.
  bool follows = false;
  SolveEffort effort{};
  int times = 0;         ///< most iterations in this part
  bool resumes = false;  ///< whether an earlier part began
  bool ends = false;     ///< whether this is the last part even if it is not done
};

/// Of a node that has links to others than the next vertices of the lattice.
inline constexpr std::uint32_t kHasOddLinks = 1u << 31;

/// All arrays of a solver in the memory of its machine.
struct SpringArrays {
  std::size_t nodes;
  const std::int32_t* neighbour;  ///< see Model::neighbour
  const float* stiffness;
  const std::uint32_t* links;  ///< by node: bit d for a link to the next vertex in direction d, and kHasOddLinks
  const std::uint32_t* vertex;
  const SpringRole* role;
  RestLink<double> rest[kDirections];
  std::int32_t distance[kDirections];  ///< from a node to its neighbour in a direction where no cut is near
  RestPlace rest_place;
  /// Displacement, mm: now, at a trial step, and of placed nodes where they come from and go.
  NodeVectors<double> u, trial, start, goal;
  /// Force on free nodes, N: now, at the start, and at the goal.
  NodeVectors<double> load, load_from, load_to;
  NodeVectors<double> force, trial_force;  ///< net force on free nodes at u and at trial, N
  NodeVectors<float> x;                    ///< the direction that is sought
  NodeVectors<float> r, z, q, p, s;        ///< of conjugate gradients: q = A z, s = A p
  LinkMatrices matrix;
  NodeMatrices inverse;  ///< by free node: the inverse of its sum of matrices; 0 for other nodes
  glm::vec3* shown;
  GradientState* state;
  Sums* result;
  Ways* ways;

  TETWARP_HD bool is_free(std::size_t n) const { return role[n] == SpringRole::free; }
  TETWARP_HD std::int32_t other(int direction, std::size_t n) const {
    return neighbour[static_cast<std::size_t>(direction) * nodes + n];
  }
  TETWARP_HD float stiffness_of(int direction, std::size_t n) const {
    return stiffness[static_cast<std::size_t>(direction) * nodes + n];
  }
  TETWARP_HD double constant(int direction, std::size_t n) const { return double{stiffness_of(direction, n)}; }
  /// The matrix of the link to a neighbour. It is kept at the lower end of the link.
  TETWARP_HD SpringMatrix<float> of_link(int direction, std::size_t n, std::int32_t to) const {
    return direction >= kUp
               ? matrix.get(static_cast<std::size_t>(direction - kUp), n)
               : matrix.get(static_cast<std::size_t>(opposite(direction) - kUp), static_cast<std::size_t>(to));
  }

  /// The sum of `term(direction, neighbour)` over the links of a node: first of those whose neighbour is the next
  /// vertex of the lattice, then of the odd ones, each by rising direction. Where there is no link the term of the node
  /// itself is computed and left out: so all are read at once, and none waits for another.
  template <class T, class Term>
  TETWARP_HD T sum_links(std::size_t n, const Term& term) const {
    const std::uint32_t mask = links[n];
    const auto own = static_cast<std::int32_t>(n);
    T sum{};
#ifdef TETWARP_ON_DEVICE
#pragma unroll
#endif
    for (int d = 0; d < kDirections; ++d) {
      const bool is_link = (mask >> d & 1) != 0;
      const T more = sum + term(d, is_link ? own + distance[d] : own);
      sum = is_link ? more : sum;
    }
    if ((mask & kHasOddLinks) == 0) return sum;
    for (int d = 0; d < kDirections; ++d) {
      const std::int32_t to = other(d, n);
      if (to >= 0 && (mask >> d & 1) == 0) sum = sum + term(d, to);
    }
    return sum;
  }
};

}  // namespace tetwarp::simulate
