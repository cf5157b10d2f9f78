// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <bit>

#include "deform/core/row_interval.h"

namespace tetwarp {

/// Where a face crosses rows: row (y, z) at `at` + y `along_y` + z `along_z` voxels.
struct RowLine {
  float at, along_y, along_z;
};

/// The faces of a tetrahedron as lines over rows, made once a field; `shift_lines` sees them from a tile then, and a
/// row of the tile takes one multiply-add a face. `RowFaces` (row_interval.h) says more exactly where faces cross, but
/// is made for each tile.
///
/// A face that has a whole row on one side, and all of them along y or z as well, has no line: the box of the
/// tetrahedron says what it does.
struct RowLines {
  RowLine lines[4]{};  ///< of the faces opposite A, B, C and D
  /// Bits of the faces through which rows enter, and through which they leave; where both are 0 nothing is known.
  int lower = 0, upper = 0;
  int level = 0;  ///< bits of the faces whose slopes are 0, 1 or -1: they cross all rows equally far from a voxel
  bool is_steep = true;  ///< whether only bounds of the error of each line tell enough
};

namespace detail {

/// Crossings of a tile are told in numbers of 2^-17 voxel, since a float from 64 to 128 has them: with 65 added, those
/// of the 32 voxels of a row lie there.
constexpr int kLineBits = 17;
constexpr float kLineLift = 65;
constexpr int kLiftedWhole = (0x42820000 >> kLineBits) - 1;  ///< bits of 65.0f; minus one, for `ceil`
static_assert(kLiftedWhole % 32 == 0 && kMostRowTile == 32);
/// Greatest number of `zone` for which a row of one voxel may still be told.
constexpr int kMostZone = 12;

TETWARP_HD inline int count_bits(int bits) {
#ifdef TETWARP_ON_DEVICE
  return __popc(bits);
#else
  return std::popcount(static_cast<unsigned>(bits));
#endif
}
TETWARP_HD inline int bits_of_float(float value) {
#ifdef TETWARP_ON_DEVICE
  return __float_as_int(value);
#else
  return std::bit_cast<int>(value);
#endif
}
TETWARP_HD inline float two_to(int exponent) {
#ifdef TETWARP_ON_DEVICE
  return __int_as_float((127 + exponent) << 23);
#else
  return std::bit_cast<float>((127 + exponent) << 23);
#endif
}

}  // namespace detail

/// Makes the lines of a tetrahedron whose box `fits_int64`.
///
/// Edges are whole numbers below 2^18, so in double the normals are exact, and so is q relative to the origin. The
/// plane of a face through q with normal n crosses row (y, z) at q.x + (ny (q.y - y) + nz (q.z - z)) / nx. Unless nx is
/// a thousand times smaller than the others, slopes are below 2^10, the terms of `at` below 2^17 voxels, and the
/// roundings of doubles below 2^-33 voxel: nothing beside the rounding to float. Otherwise the tetrahedron `is_steep`.
/// Slopes then end at 2^24 voxels: `steep_faces` says what that leaves unknown.
///
/// @param a, b, c  edges from D, 2^-12 voxel
/// @param d        D, 2^-12 voxel
/// @param origin   voxel near its middle, from which the lines are to be counted
TETWARP_HD inline RowLines make_row_lines(const glm::i32vec3& a, const glm::i32vec3& b, const glm::i32vec3& c,
                                          const glm::i32vec3& d, const glm::ivec3& origin) {
  using detail::DoubleVector;
  constexpr double kSteep = 0x1p-10, kSteepest = 0x1p-24, kWrong = 16 * 0x1p-53;
  RowLines of;
  const auto in_double = [](const glm::i32vec3& v) {
    return DoubleVector{detail::whole_in_double(v.x), detail::whole_in_double(v.y), detail::whole_in_double(v.z)};
  };
  const auto norm1 = [](const DoubleVector& v) { return (std::fabs(v.x) + std::fabs(v.y)) + std::fabs(v.z); };
  const DoubleVector da = in_double(a), db = in_double(b), dc = in_double(c),
                     q = in_double(d - origin * kStepsPerVoxel);
  const DoubleVector bc = detail::exact_cross(db, dc), ca = detail::exact_cross(dc, da),
                     ab = detail::exact_cross(da, db);
  const double volume = detail::dot(da, bc), out = volume > 0 ? 1.0 : -1.0;
  // Twelve roundings at most: nothing says that it is not zero, and so on which side the tetrahedron lies.
  if (std::fabs(volume) <= kWrong * (norm1(bc) * norm1(da))) return of;
  of.is_steep = false;
  const auto add = [&](int face, const DoubleVector& n, const DoubleVector& at, double to) {
    const double largest = std::fmax(std::fabs(n.y), std::fabs(n.z));
    if (n.x == 0 && (n.y == 0 || n.z == 0)) return;
    double x = n.x;
    if (std::fabs(x) < kSteep * largest) {
      of.is_steep = true;
      x = std::copysign(std::fmax(std::fabs(x), kSteepest * largest), x);
    }
    const double inverse = 1.0 / x, y = -n.y * inverse, z = -n.z * inverse;
    of.lines[face] = {static_cast<float>(((at.x - y * at.y) - z * at.z) * (1.0 / kStepsPerVoxel)),
                      static_cast<float>(y), static_cast<float>(z)};
    (to * x < 0 ? of.lower : of.upper) |= 1 << face;
    const auto is_whole = [&](double of_axis) { return of_axis == 0 || std::fabs(of_axis) == std::fabs(n.x); };
    if (is_whole(n.y) && is_whole(n.z)) of.level |= 1 << face;
  };
  add(0, bc, q, -out);  // through D, away from A
  add(1, ca, q, -out);
  add(2, ab, q, -out);
  add(3, {(bc.x + ca.x) + ab.x, (bc.y + ca.y) + ab.y, (bc.z + ca.z) + ab.z}, {q.x + da.x, q.y + da.y, q.z + da.z}, out);
  return of;
}

/// The place of a face's line where those through which rows enter come first, and those through which they leave
/// last: 0 to 3. @param lower  of `RowLines`  @param upper  the same
TETWARP_HD inline int place_of_line(int lower, int upper, int face) {
  const int before = (1 << face) - 1;
  return (lower >> face & 1) != 0 ? detail::count_bits(lower & before) : 3 - detail::count_bits(upper & before);
}

/// Puts the lines that there are in that order. @param lines  of `RowLines`, or moved  @param ordered  four
TETWARP_HD inline void order_lines(const RowLine (&lines)[4], int lower, int upper, RowLine* ordered) {
  for (int face = 0; face < 4; ++face)
    if (((lower | upper) >> face & 1) != 0) ordered[place_of_line(lower, upper, face)] = lines[face];
}

/// The rows of a tile that a tetrahedron may reach, seen from where its lines begin.
struct RowReach {
  glm::ivec3 from;     ///< from the origin of the lines to the first voxel of the tile, less than 256 voxels on an axis
  glm::ivec3 first;    ///< row of the tile, x unused
  glm::ivec3 last;     ///< the same; included
  glm::i32vec3 signs;  ///< nudge of the tile

  /// How far the lines are moved.
  TETWARP_HD glm::vec3 moved() const {
    constexpr float kPerVoxel = 1.0f / (kStepsPerVoxel * kNudgeSteps);
    return glm::vec3(from) + glm::vec3(nudge_steps(signs)) * kPerVoxel;  // exact: 8 bits and 16
  }
  /// The largest distance of a row from the origin, and a nudge.
  TETWARP_HD float farthest(int axis) const {
    const float low = detail::magnitude(static_cast<float>(from[axis] + first[axis])),
                high = detail::magnitude(static_cast<float>(from[axis] + last[axis]));
    return std::fmax(low, high) + 0x1p-10f;
  }
};

namespace detail {

/// How wrong a crossing may be of a line that was moved, in units of 2^-24 of a voxel:
/// - |at| + |along_y| Y + |along_z| Z, since the three were rounded; Y and Z are the largest distances of rows,
/// - |s1| + |s2| + |s3|, for the three sums of the move,
/// - 2 |v|, where v = s3 + y `along_y` is rounded, and rounded again when something is added to it,
/// - and the products themselves, where multiply-add rounds them.
/// What comes on top of v is not counted.
TETWARP_HD inline float line_error(float at, float along_y, float along_z, const RowReach& reach, float s1, float s2,
                                   float s3) {
  const float y = magnitude(along_y), z = magnitude(along_z), rows = static_cast<float>(reach.last.y);
  float error = ((magnitude(at) + y * reach.farthest(1)) + z * reach.farthest(2)) +
                ((magnitude(s1) + magnitude(s2)) + (3 * magnitude(s3) + 2 * y * rows));
#ifndef TETWARP_ON_DEVICE
  const glm::vec3 to = reach.moved();
  error += y * (magnitude(to.y) + rows) + z * (magnitude(to.z) + static_cast<float>(reach.last.z));
#endif
  return error;
}

}  // namespace detail

/// Lets lines begin at the nudged first voxel of a tile, where they began at their origin.
///
/// A level face that goes through voxels crosses all rows at one nudge from them. Beside a steep face, whose error is
/// larger than that, each of these rows would be left to exact integers. But wherever between two voxels a row is
/// crossed, the voxels are the same: so a level face is put half way between two.
///
/// @param level  of `RowLines`
/// @return the zone: crossings are wrong by less than 2^(zone - 17) voxel, or lie half way between voxels as they
///         should; more than `kMostZone` where that is too much
TETWARP_HD inline int shift_lines(RowLine (&lines)[4], int level, const RowReach& reach) {
  const glm::vec3 to = reach.moved();
  float most = 0;
  for (int face = 0; face < 4; ++face) {
    RowLine& line = lines[face];
    const float s1 = detail::multiply_add(line.along_y, to.y, line.at),
                s2 = detail::multiply_add(line.along_z, to.z, s1), s3 = s2 - to.x,
                error = detail::line_error(line.at, line.along_y, line.along_z, reach, s1, s2, s3);
    most = std::fmax(most, error);
    line.at = s3;
    if ((level >> face & 1) == 0) continue;
    const auto next = static_cast<float>(detail::ceil_to_int(s3));
    if (std::fmin(next - s3, s3 - (next - 1)) > 0x1.1p-24f * error) line.at = next - 0.5f;
  }
  // In numbers of 2^-17 voxel, of which 2^-24 is 2^-7. On top of v comes the lift, 66 and rounded, and then z
  // `along_z`, which gives less than 128, rounded. What is left out, 2^-24 of all that, is less than what 1/126 has too
  // much.
  const float wrong = 1.25f + most * (1.0f / 126);
  return (detail::bits_of_float(wrong) >> 23) - 126;  // 2^zone > wrong
}

/// The faces of a tetrahedron of steep lines, with a bound of the error of each.
///
/// The lines were moved by `shift_lines`, of which only s3 is left: |s2| is at most |s3| + |to.x|, |s1| at most that +
/// |along_z to.z|, and so on. `RowsAlongZ` rounds twice more, v and with it the error. Where a slope may have been cut
/// off, its face moves over the row by less than 256 voxels (the tetrahedron and the row are less than 96 voxels
/// apart): where it crosses further away, the row is on the same side of both.
///
/// @param lines  as `place_of_line` orders them, from the first voxel of the tile on  @param lower, upper  how many
TETWARP_HD inline RowFaces steep_faces(const RowLine (&lines)[4], int lower, int upper, const RowReach& reach) {
  constexpr float kFar = 1e6f, kMayBeCut = 0x1p23f, kMoved = 256;
  RowFaces of{};
  of.lower = lower;
  const glm::vec3 to = reach.moved();
  for (int n = 0; n < 4; ++n) {
    const RowLine& line = lines[n];
    const float y = detail::magnitude(line.along_y), z = detail::magnitude(line.along_z),
                s3 = detail::magnitude(line.at), s2 = s3 + detail::magnitude(to.x),
                s1 = s2 + z * detail::magnitude(to.z), at = s1 + y * detail::magnitude(to.y);
    const float wrong = detail::line_error(at, y, z, reach, s1, s2, s3) +
                        3 * ((s3 + y * static_cast<float>(reach.last.y)) + z * static_cast<float>(reach.last.z));
    float error = 0x1.1p-24f * wrong;
    if (y >= kMayBeCut || z >= kMayBeCut) error += kMoved;
    of.faces[n] = {line.at, line.along_y, line.along_z, error};
    if (n >= lower && n < 4 - upper) of.faces[n] = {kFar, 0, 0, 0};  // a face that has no line bounds nothing
  }
  return of;
}

/// The interval of a row that lines left in doubt.
/// @param before, behind  whether the tetrahedron owns the voxel before the core, and the one behind it: exactly where
///                        they are in doubt, else false
TETWARP_HD inline RowInterval settled(const RowInterval& core, bool before, bool behind) {
  return {core.begin - (before ? 1 : 0), core.end + (behind ? 1 : 0)};
}

/// The rows of a tile that have the same y, by lines that begin at its first voxel.
class LinesAlongZ {
 public:
  /// @param lines         as `place_of_line` orders them
  /// @param lower, upper  how many rows enter through, and leave
  /// @param zone          of `shift_lines`, at most kMostZone  @param count  voxels of a row
  TETWARP_HD LinesAlongZ(const RowLine (&lines)[4], int lower, int upper, int zone, int y, int count)
      : least_(detail::kLineLift - 0.5f),
        most_(detail::kLineLift - 0.5f + static_cast<float>(count)),
        keep_((1 << detail::kLineBits) - (2 << zone)),
        apart_(4 << zone) {
    constexpr float kBefore = 0, kBehind = 1000;
    const float lift = detail::kLineLift + detail::two_to(zone - detail::kLineBits);
    float at[4];  // once each, not within the choices below
    for (int n = 0; n < 4; ++n) {
      const RowLine& line = lines[n];
      at[n] = detail::multiply_add(line.along_y, static_cast<float>(y), line.at) + lift;
    }
    const auto set = [&](Line& line, int n, bool any, float otherwise) {
      line.at = any ? at[n] : otherwise;
      line.along_z = any ? lines[n].along_z : 0.0f;
    };
    for (int n = 0; n < 3; ++n) {
      set(lower_[n], n, n < lower, kBefore);
      set(upper_[n], 3 - n, n < upper, kBehind);
    }
  }

  /// Where a row begins and ends, as the bits of lifted crossings: they compare as the crossings do.
  struct Ends {
    int first, last;
    bool is_certain;  ///< whether exact integers need not decide

    /// Voxels, plus `kLiftedWhole`: a certain row is empty unless begin() < end().
    TETWARP_HD int begin() const { return first >> detail::kLineBits; }
    TETWARP_HD int end() const { return last >> detail::kLineBits; }
  };
  TETWARP_HD Ends ends(int z) const {
    const auto row = static_cast<float>(z);
    const auto at = [&](const Line& line) { return detail::multiply_add(line.along_z, row, line.at); };
    const float first = std::fmax(std::fmax(std::fmax(at(lower_[0]), at(lower_[1])), at(lower_[2])), least_),
                last = std::fmin(std::fmin(std::fmin(at(upper_[0]), at(upper_[1])), at(upper_[2])), most_);
    const int begin = detail::bits_of_float(first), end = detail::bits_of_float(last);
    return {begin, end, (!is_open(begin) && !is_open(end)) || end <= begin - apart_};
  }
  /// A certain row as an interval.
  TETWARP_HD static RowInterval interval(const Ends& of) {
    if (of.begin() >= of.end()) return {0, 0};
    return {of.begin() - detail::kLiftedWhole, of.end() - detail::kLiftedWhole};
  }
  /// Of a row that is not certain: the voxels that are owned for certain, and whether those before and behind may be
  /// too.
  struct Doubt {
    RowInterval core;  ///< perhaps empty; it may end one voxel before it begins
    bool before, behind;
  };
  TETWARP_HD Doubt doubt(const Ends& of) const {
    const bool before = is_open(of.first), behind = is_open(of.last);
    return {{of.begin() - detail::kLiftedWhole, of.end() - detail::kLiftedWhole - (behind ? 1 : 0)}, before, behind};
  }

 private:
  struct Line {
    float at, along_z;
  };
  /// Whether a crossing lies in the zone around a voxel.
  TETWARP_HD bool is_open(int bits) const { return (bits & keep_) == 0; }

  Line lower_[3], upper_[3];
  float least_, most_;
  int keep_;   ///< bits that say that a crossing does not lie in the zone around a voxel
  int apart_;  ///< crossings that are further apart the wrong way leave nothing
};

}  // namespace tetwarp
