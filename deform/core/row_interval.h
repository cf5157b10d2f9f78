#pragma once

#include "deform/core/gather.h"

namespace tetwarp {

/// Which voxels of a row a tetrahedron owns: an interval, for the tetrahedron is convex.
///
/// For tiles of voxels that are all nudged alike. Where a face crosses a row is found in float, with a bound of its
/// error; where a voxel lies within that bound exact integers decide, so the intervals are always exact.

/// Voxels of a row, half open, from the first of its tile.
struct RowInterval {
  int begin, end;

  TETWARP_HD bool is_empty() const { return begin >= end; }
};

/// The longest tile that the bounds below hold for, voxels.
constexpr int kMostRowTile = 32;

/// Exactly. @param first  voxel of the tile  @param y, z  the row, from there  @param count  voxels of a row
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

/// Where a face crosses the rows of a tile: at `at` + y `along_y` + z `along_z` voxels, wrong by less than `error`.
struct RowFace {
  float at, along_y, along_z, error;
};

namespace detail {

/// A face as `make_faces` gives it, from the first voxel of a tile.
///
/// The value C - x Nx - y Ny - z Nz of a face is zero at x = (C - y Ny - z Nz) / Nx. C and N are exact before they are
/// rounded to float, so with u = 2^-24 each of the three terms is wrong by 4 u of itself (two roundings, the reciprocal
/// and the product); adding them, and the bound, costs 3 u of their sum.
/// Where Nx is zero, a row lies on one side as a whole: the crossing is put far away on that side.
///
/// @param signs, size  of the tile  @param is_lower  whether the voxels beyond the crossing are inside, else those
/// before it
TETWARP_HD inline RowFace row_face(const Face<std::int64_t>& face, const glm::i32vec3& signs, const glm::ivec3& size,
                                   bool& is_lower) {
  constexpr float kFar = 0x1p40f, kVoxel = kStepsPerVoxel * kNudgeSteps;
  const glm::i32vec3 nudged = nudge_steps(signs);
  const auto constant = static_cast<float>(face.constant - face.normal[0] * nudged.x - face.normal[1] * nudged.y -
                                           face.normal[2] * nudged.z);
  const float x = static_cast<float>(face.normal[0]) * kVoxel, y = static_cast<float>(face.normal[1]) * kVoxel,
              z = static_cast<float>(face.normal[2]) * kVoxel;
  const auto rows = glm::vec3(size - 1);
  is_lower = face.normal[0] <= 0;
  const float reciprocal =
      face.normal[0] != 0 ? 1.0f / x
                          : -kFar / ((magnitude(constant) + magnitude(y) * rows.y) + magnitude(z) * rows.z + kVoxel);
  RowFace crossing{constant * reciprocal, -y * reciprocal, -z * reciprocal, 0};
  crossing.error =
      8 * kUnit *
      ((magnitude(crossing.at) + magnitude(crossing.along_y) * rows.y) + magnitude(crossing.along_z) * rows.z);
  return crossing;
}

/// The smallest whole number not below x; too large or small ones are any large or small ones.
TETWARP_HD inline int ceil_to_int(float x) {
#ifdef __CUDA_ARCH__
  return __float2int_ru(x);
#else
  return -floor_to_int(-x);
#endif
}

}  // namespace detail

/// How a tetrahedron crosses the rows of a tile: `lower` faces, which rows enter through, then the others.
struct RowFaces {
  RowFace faces[4];
  int lower;  ///< 1 to 3
};

/// The face of a tetrahedron through p, q and r, inside where s lies. For tetrahedra with `has_int64_rows`.
/// @param p, q, r, s  from the first voxel of the tile, 2^-12 voxel  @return false where s lies on it
TETWARP_HD inline bool make_face_towards(const glm::i32vec3& p, const glm::i32vec3& q, const glm::i32vec3& r,
                                         const glm::i32vec3& s, Face<std::int64_t>& face) {
  face = make_face<std::int64_t>(p, q, r, 1);
  const std::int64_t volume =
      face.normal[0] * (p.x - s.x) + face.normal[1] * (p.y - s.y) + face.normal[2] * (p.z - s.z);
  if (volume < 0) face = {{-face.normal[0], -face.normal[1], -face.normal[2]}, -face.constant};
  return volume != 0;
}

/// The rows of a tile with the same y.
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

  /// The interval of row z among `count` voxels. @param is_certain  whether it is right, else exact integers must say
  TETWARP_HD RowInterval interval(int z, int count, bool& is_certain) const {
    const auto row = static_cast<float>(z);
    const auto low = [&](const Line& line) { return detail::multiply_add(line.along_z, row, line.low); };
    const auto high = [&](const Line& line) { return detail::multiply_add(line.along_z, row, line.high); };
    const auto clamped = [&](float x) {
      const int n = detail::ceil_to_int(x);
      return n < 0 ? 0 : (n > count ? count : n);
    };
    const int begin = clamped(std::fmax(std::fmax(low(lower_[0]), low(lower_[1])), low(lower_[2]))),
              late_begin = clamped(std::fmax(std::fmax(high(lower_[0]), high(lower_[1])), high(lower_[2]))),
              early_end = clamped(std::fmin(std::fmin(low(upper_[0]), low(upper_[1])), low(upper_[2]))),
              end = clamped(std::fmin(std::fmin(high(upper_[0]), high(upper_[1])), high(upper_[2])));
    is_certain = begin >= end || (begin == late_begin && early_end == end);
    return {begin, end};
  }

 private:
  /// Least and largest crossing of row 0, and how both change from row to row.
  struct Line {
    float low, high, along_z;
  };

  Line lower_[3], upper_[3];
};

}  // namespace tetwarp
