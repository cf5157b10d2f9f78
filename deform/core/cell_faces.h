// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/core/gather.h"

namespace tetwarp {

/// The sixteen faces of the five tetrahedra of a cell, as seen from a nudged voxel q; in float.
///
/// A face (U, V, W) has the value det(U - q, V - q, W - q), whose sign says on which side of it q lies. A tetrahedron
/// owns the voxel where its four faces, each turned outwards the same way, have values of one sign. Every face has an
/// edge of the centre tetrahedron, so that six cross products serve all:
///
///               6-------(7)       in brackets the centre, here of an even cell: six edges 1-2, 1-4, 1-7, 2-4, 2-7, 4-7
///              /|       /|        the others: a corner tetrahedron each, with three faces of its own
///           (4)-------5  |        an odd cell is an even one in a mirror across i
///            | |      | |
///            |(2)-----|-3
///            |/       |/
///            0-------(1)
///
/// With R the largest sum norm of a corner seen from q, and units of 2^-24: a component of a cross product is off by at
/// most 2 units of its two products, a dot product by 3 more of its terms; so a value by 5 R^3 units. Corners within
/// 2^20 steps of q are exact, for q lies at sixteenths of a step; others may be off by 3 units, and values by 14 R^3.
class CellFaces {
 public:
  /// @param cell   of the lattice
  /// @param point  the voxel
  TETWARP_HD CellFaces(const StepLattice& lattice, const glm::ivec3& cell, const GatherPoint& point) {
    const int odd = (cell.x + cell.y + cell.z) & 1;
    const glm::vec3 base = glm::vec3(cell) * lattice.cell - point.steps;
    const int first = static_cast<int>(lattice.offset(cell));
    glm::vec3 at[8];
    float norm = 0;
    for (int c = 0; c < 8; ++c) {
      const int x = (c & 1) ^ odd, y = c >> 1 & 1, z = c >> 2;
      const glm::vec3 moved = lattice.moved(first + x + y * lattice.row + z * lattice.slice);
      const glm::vec3 corner(x != 0 ? lattice.cell.x : 0.0f, y != 0 ? lattice.cell.y : 0.0f,
                             z != 0 ? lattice.cell.z : 0.0f);
      at[c] = ((base + corner) + moved) - point.nudge;
      norm = std::fmax(norm, detail::norm1(at[c]));
    }
    const float units = norm < float{1 << 20} ? 6.0f : 16.0f;  // the next of second order
    const float error = units * detail::kUnit * (norm * norm * norm);
    const Normal n12(at[1], at[2]), n14(at[1], at[4]), n17(at[1], at[7]), n24(at[2], at[4]), n27(at[2], at[7]),
        n47(at[4], at[7]);
    const float f247 = n47.to(at[2]), f147 = n47.to(at[1]), f127 = n27.to(at[1]), f124 = n24.to(at[1]);
    look(0, error, f247, -f147, f127, -f124);
    look(1, error, n24.to(at[0]), -n14.to(at[0]), n12.to(at[0]), -f124);
    look(2, error, n17.to(at[3]), -n27.to(at[3]), -n12.to(at[3]), f127);
    look(3, error, -n17.to(at[5]), n14.to(at[5]), n47.to(at[5]), -f147);
    look(4, error, -n24.to(at[6]), n27.to(at[6]), -n47.to(at[6]), f247);
  }

  /// The lowest number of a tetrahedron of the cell that owns the voxel; kTetrahedraPerCell where none does.
  /// @param exactly  exactly(number) says whether a tetrahedron owns the voxel; asked where float is unsure
  template <class Exactly>
  TETWARP_HD int owner(Exactly&& exactly) const {
    for (int number = 0; (maybe_ >> number) != 0; ++number) {
      if ((maybe_ >> number & 1) != 0 && ((surely_ >> number & 1) != 0 || exactly(number))) return number;
    }
    return kTetrahedraPerCell;
  }

 private:
  struct Normal {
    float x, y, z;

    TETWARP_HD Normal(const glm::vec3& a, const glm::vec3& b)
        : x(minor(a.y, b.z, a.z, b.y)), y(minor(a.z, b.x, a.x, b.z)), z(minor(a.x, b.y, a.y, b.x)) {}
    TETWARP_HD static float minor(float a, float b, float c, float d) { return detail::multiply_add(a, b, -(c * d)); }
    TETWARP_HD float to(const glm::vec3& v) const {
      return detail::multiply_add(v.z, z, detail::multiply_add(v.y, y, v.x * x));
    }
  };
  /// Notes what the values of its four faces say of a tetrahedron.
  TETWARP_HD void look(int number, float error, float a, float b, float c, float d) {
    const float least = std::fmin(std::fmin(a, b), std::fmin(c, d)), most = std::fmax(std::fmax(a, b), std::fmax(c, d));
    if (!(least < -error && most > error)) maybe_ |= 1u << number;
    if (least > error || most < -error) surely_ |= 1u << number;
  }

  // A bit for each tetrahedron: whether it may own the voxel, and whether it certainly does.
  unsigned maybe_ = 0, surely_ = 0;
};

}  // namespace tetwarp
