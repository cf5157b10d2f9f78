// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/core/gather.h"

namespace tetwarp {

/// Half-open range of voxels of a row, counted from the first voxel of its tile. The voxels of a row that a tetrahedron
/// owns are such an interval, for the tetrahedron is convex.
///
/// The functions here work on tiles whose voxels are all nudged in the same direction. Float arithmetic with a bound of
/// its error finds where a face crosses a row. Where a voxel lies within that bound exact integers decide, so intervals
/// are always exact.
struct RowInterval {
  int begin, end;

  TETWARP_HD bool is_empty() const { return begin >= end; }
};

/// Longest side of a tile, in voxels, for which the error bounds here hold.
constexpr int kMostRowTile = 32;

/// The interval of one row by exact integers.
/// @param first  first voxel of the tile
/// @param y, z   the row, counted from `first`
/// @param count  voxels of a row
template <class Int>
TETWARP_HD RowInterval exact_row(const Tetrahedron& t, const glm::ivec3& first, const glm::i32vec3& signs, int y, int z,
                                 int count) {
  Face<Int> faces[4];
  if (!detail::make_faces<Int>(t, first * kStepsPerVoxel, faces)) return {0, 0};
  std::int64_t begin = 0, end = count;
  detail::clip_row<Int>(faces, y, z, signs, &begin, &end);
  return {static_cast<int>(begin), static_cast<int>(end)};
}

/// Whether 64 bits hold the faces of a tetrahedron that reaches a tile, and their values there: edges below 2^18 and
/// distances below 2^19 steps give less than 2^62.
TETWARP_HD inline bool has_int64_rows(const Tetrahedron& t) { return fits_int64(box_of(t)); }

TETWARP_HD inline RowInterval exact_row(const Tetrahedron& t, const glm::ivec3& first, const glm::i32vec3& signs, int y,
                                        int z, int count) {
  if (has_int64_rows(t)) return exact_row<std::int64_t>(t, first, signs, y, z, count);
  return exact_row<Wide>(t, first, signs, y, z, count);
}

/// Where a face crosses the rows of a tile: at `at` + y `along_y` + z `along_z` voxels, with an error below `error`.
struct RowFace {
  float at, along_y, along_z, error;
};

namespace detail {

/// Computes where a face crosses rows. The outward normal of the face is (x, y, z), 2^-24 voxel^2; its value at the
/// nudged first voxel of the tile is `constant`, 2^-36 voxel^3. All four are rounded from doubles.
///
/// The value C - 4096 (x Nx + y Ny + z Nz) of a face is zero at x = (C / 4096 - y Ny - z Nz) / Nx. The normal is exact
/// before it is rounded to float, so with u = 2^-24 each of the three terms has an error of 4 u of itself (two
/// roundings, the reciprocal and the product), and the first also the error of C. Adding them, and computing the bound,
/// costs 3 u of their sum. Where Nx is zero a row lies on one side as a whole: the crossing is put far away on that
/// side.
///
/// @param wrong  bound of the error of `constant`
/// @param size   voxels of the tile
TETWARP_HD inline RowFace row_face(float x, float y, float z, float constant, float wrong, const glm::vec3& size) {
  constexpr float kFar = 0x1p40f, kVoxel = kStepsPerVoxel;
  const float along_x = x * kVoxel, along_y = y * kVoxel, along_z = z * kVoxel;
  const float largest = (magnitude(constant) + magnitude(along_y) * size.y) + magnitude(along_z) * size.z + kVoxel;
  const float factor = x != 0 ? reciprocal(along_x) : -kFar * reciprocal(largest);
  RowFace crossing{constant * factor, -along_y * factor, -along_z * factor, 0};
  crossing.error =
      8 * kUnit *
          ((magnitude(crossing.at) + magnitude(crossing.along_y) * size.y) + magnitude(crossing.along_z) * size.z) +
      2 * wrong * magnitude(factor);
  return crossing;
}

struct DoubleVector {
  double x, y, z;
};
/// Cross product, exact for whole numbers up to 2^26.
TETWARP_HD inline DoubleVector exact_cross(const DoubleVector& a, const DoubleVector& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
TETWARP_HD inline double dot(const DoubleVector& a, const DoubleVector& b) {
  return (a.x * b.x + a.y * b.y) + a.z * b.z;
}
TETWARP_HD inline float norm1(const DoubleVector& v) {
  return norm1(glm::vec3(static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)));
}

/// The smallest whole number that is not below x. For x beyond the range of int it is some number as far out.
TETWARP_HD inline int ceil_to_int(float x) {
#ifdef TETWARP_ON_DEVICE
  return __float2int_ru(x);
#else
  return -floor_to_int(-x);
#endif
}

}  // namespace detail

/// How a tetrahedron crosses the rows of a tile: first `lower` faces through which rows enter, then those through which
/// they leave.
struct RowFaces {
  RowFace faces[4];
  int lower;  ///< 1 to 3
};

/// Computes how a tetrahedron with `has_int64_rows` crosses the rows of a tile.
///
/// It works in double. Edges are whole numbers of at most 2^18, so normals are exact. Values at the first voxel are
/// sums of at most 12 terms, so their error is below 16 units (2^-53) of the sum of the normals' sizes, times the
/// largest distance.
///
/// @param a, b, c  edges from D, 2^-12 voxel
/// @param d        D relative to the first voxel of the tile, 2^-12 voxel
/// @param signs    nudge of the tile
/// @param size     voxels of the tile
/// @param put      called four times as put(n, face), where n is the index of the face in `RowFaces`
/// @return `RowFaces::lower`; 0 where the tetrahedron may have no volume, and nothing is put
template <class Put>
TETWARP_HD int make_row_faces(const glm::i32vec3& a, const glm::i32vec3& b, const glm::i32vec3& c,
                              const glm::i32vec3& d, const glm::i32vec3& signs, const glm::ivec3& size, Put&& put) {
  using detail::DoubleVector;
  constexpr float kWrong = 16 * 0x1p-53f;
  const auto in_double = [](const glm::i32vec3& v) {
    return DoubleVector{static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)};
  };
  const auto largest = [](const glm::i32vec3& v) {
    return std::fmax(std::fmax(detail::magnitude(static_cast<float>(v.x)), detail::magnitude(static_cast<float>(v.y))),
                     detail::magnitude(static_cast<float>(v.z)));
  };
  const DoubleVector da = in_double(a), db = in_double(b), dc = in_double(c);
  const DoubleVector bc = detail::exact_cross(db, dc), ca = detail::exact_cross(dc, da),
                     ab = detail::exact_cross(da, db);
  const double volume = detail::dot(da, bc);
  const float sizes = (detail::norm1(bc) + detail::norm1(ca)) + detail::norm1(ab), edge = largest(a),
              wrong = kWrong * sizes * (largest(d) + edge + 1.0f);
  if (detail::magnitude(static_cast<float>(volume)) <= kWrong * sizes * edge) return 0;
  constexpr double kNudge = 1.0 / kNudgeSteps;
  const glm::i32vec3 nudged = nudge_steps(signs);
  const DoubleVector q{d.x - nudged.x * kNudge, d.y - nudged.y * kNudge, d.z - nudged.z * kNudge};
  const auto rows = glm::vec3(size);
  const float out = volume > 0 ? 1.0f : -1.0f;
  int lower = 0, upper = 4;
  const auto add = [&](const DoubleVector& normal, double value, float to) {
    const float x = to * static_cast<float>(normal.x);
    const RowFace face = detail::row_face(x, to * static_cast<float>(normal.y), to * static_cast<float>(normal.z),
                                          to * static_cast<float>(value), wrong, rows);
    put(x <= 0 ? lower++ : --upper, face);
  };
  const double at_bc = detail::dot(bc, q), at_ca = detail::dot(ca, q), at_ab = detail::dot(ab, q);
  add(bc, at_bc, -out);  // through D, away from A
  add(ca, at_ca, -out);
  add(ab, at_ab, -out);
  add({(bc.x + ca.x) + ab.x, (bc.y + ca.y) + ab.y, (bc.z + ca.z) + ab.z}, ((at_bc + at_ca) + at_ab) + volume, out);
  return lower;
}

/// Computes how any tetrahedron crosses the rows of a tile.
///
/// Where 64 bits are too few, faces are exact in Wide. Rounding them to double (2^-52 of each) is negligible beside the
/// error that `row_face` allows for rounding to float.
/// @param first  first voxel of the tile
/// @return false where the tetrahedron may have no volume; then `exact_row` must decide
TETWARP_HD inline bool make_row_faces(const Tetrahedron& t, const glm::ivec3& first, const glm::i32vec3& signs,
                                      const glm::ivec3& size, RowFaces& rows) {
  const auto put = [&rows](int n, const RowFace& face) { rows.faces[n] = face; };
  const glm::i32vec3& d = t.d.deformed;
  if (has_int64_rows(t)) {
    rows.lower = make_row_faces(t.a.deformed - d, t.b.deformed - d, t.c.deformed - d, d - first * kStepsPerVoxel, signs,
                                size, put);
    return rows.lower != 0;
  }
  Face<Wide> faces[4];
  if (!detail::make_faces<Wide>(t, first * kStepsPerVoxel, faces)) return false;
  const glm::i32vec3 nudged = nudge_steps(signs);
  rows.lower = 0;
  int upper = 4;
  for (const Face<Wide>& face : faces) {
    const Wide value =
        face.constant - face.normal[0] * nudged.x - face.normal[1] * nudged.y - face.normal[2] * nudged.z;
    const auto in_float = [](Wide x) { return static_cast<float>(to_double(x)); };
    const float constant = in_float(value) * (1.0f / kNudgeSteps), x = in_float(face.normal[0]);
    put(x <= 0 ? rows.lower++ : --upper,
        detail::row_face(x, in_float(face.normal[1]), in_float(face.normal[2]), constant,
                         0x1p-50f * detail::magnitude(constant), glm::vec3(size)));
  }
  return true;
}

/// The rows of a tile that have the same y.
class RowsAlongZ {
 public:
  TETWARP_HD RowsAlongZ(const RowFaces& t, int y) {
    const auto line = [&](const RowFace& face) {
      const float at = detail::multiply_add(face.along_y, static_cast<float>(y), face.at);
      return Line{at - face.error, at + face.error, face.along_z};
    };
    const Line first = line(t.faces[0]), second = line(t.faces[1]), third = line(t.faces[2]), last = line(t.faces[3]);
    const bool second_is_lower = t.lower > 1, third_is_lower = t.lower > 2;
    lower_[0] = first;  // where there are fewer than three, one stands twice
    lower_[1] = second_is_lower ? second : first;
    lower_[2] = third_is_lower ? third : first;
    upper_[0] = last;
    upper_[1] = second_is_lower ? last : second;
    upper_[2] = third_is_lower ? last : third;
  }

  /// The interval of row z among `count` voxels.
  /// @param is_certain  set to whether the interval is proved; otherwise exact integers must decide
  TETWARP_HD RowInterval interval(int z, int count, bool& is_certain) const {
    const auto row = static_cast<float>(z);
    const auto low = [&](const Line& line) { return detail::multiply_add(line.along_z, row, line.low); };
    const auto high = [&](const Line& line) { return detail::multiply_add(line.along_z, row, line.high); };
    const auto clamped = [&](float x) { return detail::clamp_to(detail::ceil_to_int(x), count); };
    const int begin = clamped(std::fmax(std::fmax(low(lower_[0]), low(lower_[1])), low(lower_[2]))),
              late_begin = clamped(std::fmax(std::fmax(high(lower_[0]), high(lower_[1])), high(lower_[2]))),
              early_end = clamped(std::fmin(std::fmin(low(upper_[0]), low(upper_[1])), low(upper_[2]))),
              end = clamped(std::fmin(std::fmin(high(upper_[0]), high(upper_[1])), high(upper_[2])));
    is_certain = begin >= end || (begin == late_begin && early_end == end);
    return {begin, end};
  }

 private:
  /// Least and largest crossing of row 0, and by how much both change from row to row.
  struct Line {
    float low, high, along_z;
  };

  Line lower_[3], upper_[3];
};

}  // namespace tetwarp
