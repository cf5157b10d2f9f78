// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/output/coarse_maps.cuh"
#include "cuda/owners/tile.cuh"
#include "deform/core/row_lines.h"

/// What tiles need of a tetrahedron of a coarse field, made once a field: its box, where its faces cross rows, and its
/// map. For tiles alone (interval_tile.cuh).
namespace tetwarp::cuda_detail {

namespace {

constexpr int kRecordQuads = 7;  ///< a box, four lines in three, a map in three
constexpr int kLineQuads = 3;

/// First and last voxel that a box may own on an axis; both depend on which way the tile is nudged only where a corner
/// lies on a voxel.
///
///     31                       17  16 15                        1   0
///     +--------------------------+---+--------------------------+---+
///     |  ceil of high, signed    | W |   ceil of low, signed    | W |    W: whether it is a whole number
///     +--------------------------+---+--------------------------+---+
struct VoxelRange {
  static constexpr int kMost = 16000;  ///< a voxel that can be told, either way from 0

  __device__ static int half(int steps) {
    steps = min(max(steps, -kMost * kStepsPerVoxel), kMost * kStepsPerVoxel);  // further away it is all the same
    return ((steps + kStepsPerVoxel - 1) >> kStepBits) * 2 + ((steps & (kStepsPerVoxel - 1)) == 0 ? 1 : 0);
  }
  __device__ static int of(int low, int high) { return (half(low) & 0xFFFF) | half(high) << 16; }
  __device__ static int low(int word) { return static_cast<short>(word); }
  __device__ static int high(int word) { return word >> 16; }
  /// The first voxel not below a corner. @param sign  of the nudge
  __device__ static int from(int half, int sign) { return (half >> 1) + ((sign < 0) & (half & 1)); }
  /// Where lines are counted from.
  __device__ static glm::ivec3 middle(const glm::ivec3& words) {
    const auto on_axis = [](int word) { return ((low(word) >> 1) + (high(word) >> 1)) >> 1; };
    return {on_axis(words.x), on_axis(words.y), on_axis(words.z)};
  }
};

/// How the lines of a record are to be taken.
///
///     14    11    10       9         8       7     4 3     0
///     +-------+----------+---------+---------+---------+---------+
///     | Level |  AtRest  | Usable  |  Steep  |  Upper  |  Lower  |
///     +-------+----------+---------+---------+---------+---------+
struct RecordFlags {
  using Lower = BitField<0, 4>;  ///< bits of faces, as `RowLines` has them
  using Upper = BitField<Lower::kEnd, 4>;
  using Steep = BitField<Upper::kEnd, 1>;
  using Usable = BitField<Steep::kEnd, 1>;   ///< whether the map is
  using AtRest = BitField<Usable::kEnd, 1>;  ///< whether no vertex moves
  using Level = BitField<AtRest::kEnd, 4>;   ///< bits of faces
};

/// Records of all tetrahedra, quad after quad, so that neighbouring threads write neighbouring places.
struct Records {
  int4* quads;
  std::int64_t count;  ///< tetrahedra

  /// Whether those of so many tetrahedra take no more memory than is worth it.
  static bool suit(std::int64_t count, std::int64_t voxels) {
    constexpr std::int64_t kMostBytes = 5;  // for each voxel
    return count * kRecordQuads * std::int64_t{sizeof(int4)} <= kMostBytes * voxels;
  }

  __device__ int4& box(std::int64_t n) const { return quads[n]; }
  __device__ int4& line(std::int64_t n, int quad) const { return quads[(1 + quad) * count + n]; }
  __device__ int4& map(std::int64_t n, int axis) const { return quads[(1 + kLineQuads + axis) * count + n]; }
};

/// Makes the record of a tetrahedron whose voxels `VoxelRange` can tell.
__device__ void put_record(const Records& records, std::int64_t n, const Tetrahedron& t) {
  const glm::i32vec3& d = t.d.deformed;
  const glm::i32vec3 a = t.a.deformed - d, b = t.b.deformed - d, c = t.c.deformed - d;
  const Box box = box_of(t);
  const glm::ivec3 ranges(VoxelRange::of(box.low.x, box.high.x), VoxelRange::of(box.low.y, box.high.y),
                          VoxelRange::of(box.low.z, box.high.z));
  RowLines rows;
  if (fits_int64(box)) rows = make_row_lines(a, b, c, d, VoxelRange::middle(ranges));
  const CoarseMap map(t);
  const bool usable = is_usable(map, t);
  bool rests = true;
  for (const Vertex* v : {&t.a, &t.b, &t.c, &t.d}) {
#pragma unroll
    for (int axis = 0; axis < 3; ++axis) rests &= v->u[axis] == 0;
  }
  const auto flag = [](bool is) { return is ? 1 : 0; };
  records.box(n) =
      make_int4(ranges.x, ranges.y, ranges.z,
                static_cast<int>(RecordFlags::Lower::put(rows.lower) | RecordFlags::Upper::put(rows.upper) |
                                 RecordFlags::Steep::put(flag(rows.is_steep)) | RecordFlags::Usable::put(flag(usable)) |
                                 RecordFlags::AtRest::put(flag(rests)) | RecordFlags::Level::put(rows.level)));
  const RowLine(&l)[4] = rows.lines;
  const auto quad = [](float x, float y, float z, float w) {
    return make_int4(__float_as_int(x), __float_as_int(y), __float_as_int(z), __float_as_int(w));
  };
  records.line(n, 0) = quad(l[0].at, l[0].along_y, l[0].along_z, l[1].at);
  records.line(n, 1) = quad(l[1].along_y, l[1].along_z, l[2].at, l[2].along_y);
  records.line(n, 2) = quad(l[2].along_z, l[3].at, l[3].along_y, l[3].along_z);
#pragma unroll
  for (int axis = 0; axis < 3; ++axis) records.map(n, axis) = map_axis(map, axis);
}

/// The lines of three quads.
__device__ inline void read_lines(const float4* quads, RowLine (&l)[4]) {
  const float4 x = quads[0], y = quads[1], z = quads[2];
  l[0] = {x.x, x.y, x.z};
  l[1] = {x.w, y.x, y.y};
  l[2] = {y.z, y.w, z.x};
  l[3] = {z.y, z.z, z.w};
}
/// The lines of a record, faces in their own order.
__device__ inline void read_lines(const Records& records, std::int64_t n, RowLine (&l)[4]) {
  float4 quads[kLineQuads];
#pragma unroll
  for (int i = 0; i < kLineQuads; ++i) {
    const int4 quad = records.line(n, i);
    quads[i] =
        make_float4(__int_as_float(quad.x), __int_as_float(quad.y), __int_as_float(quad.z), __int_as_float(quad.w));
  }
  read_lines(quads, l);
}

}  // namespace

}  // namespace tetwarp::cuda_detail
