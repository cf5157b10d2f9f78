// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/core/row_interval.h"

/// Tiles of the rasters: boxes of 32 x 8 x 16 voxels, a thread block each. All voxels of a tile are nudged alike, since
/// tiles begin where the nudge turns.
///
///              k                                     a row: 32 voxels along i
///              |    j                                row y, z of a tile has number z * 8 + y: 128 rows
///              |  /
///          15  +--------------------+                rows are marked by whichever thread has one to mark;
///             /|                   /|                columns are sampled: warp y, lane x goes through z = 0 to 15,
///        7  /  |                 /  |                so that the lanes of a warp write 32 neighbouring voxels
///          +--------------------+   |
///          |   |                |   |
///          |   +----------------|---+
///          | /                  | /
///       0  +--------------------+--- i
///          0                    31
namespace tetwarp::cuda_detail {

constexpr int kTileI = 32, kTileJ = 8, kTileK = 16;  ///< voxels of a tile
constexpr int kTileRows = kTileJ * kTileK;
constexpr int kTileThreads = 32 * kTileJ;  ///< a warp a column of rows
constexpr int kTileBlocks = 4;             ///< a multiprocessor
static_assert(kTileI <= kMostRowTile && kTileJ <= kMostRowTile && kTileK <= kMostRowTile);

/// A face as the shared memory of a tile has it.
__device__ inline float4 in_quad(const RowFace& face) {
  return make_float4(face.at, face.along_y, face.along_z, face.error);
}

/// Where the faces of a tetrahedron cross the rows of a tile.
/// @param quads  its four faces, as `in_quad` makes them
/// @param lower  of `RowFaces`
__device__ inline RowFaces faces_in_quads(const float4* quads, int lower) {
  RowFaces t;
#pragma unroll
  for (int n = 0; n < 4; ++n) {
    const float4 face = quads[n];
    t.faces[n] = {face.x, face.y, face.z, face.w};
  }
  t.lower = lower;
  return t;
}

}  // namespace tetwarp::cuda_detail
