// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>

#include "deform/core/row_interval.h"

namespace tetwarp::cpu {

/// What a tetrahedron owns of some rows of a box, as far as float proves it. Row y, z has number y + kMostRowTile z,
/// counted from the first of the box.
struct RowScan {
  static constexpr int kMost = kMostRowTile * kMostRowTile, kRoomBehind = 16;

  int found = 0, unsure = 0;                       ///< how many rows there are of both kinds
  std::uint16_t found_rows[kMost + kRoomBehind];   ///< rows of which it owns a part
  std::uint32_t found_bits[kMost + kRoomBehind];   ///< of each, a bit for each voxel that it owns
  std::uint16_t unsure_rows[kMost + kRoomBehind];  ///< rows for which exact integers must decide
};

/// Scans the rows of a range of y and z with the widest vectors that the processor has (Highway).
/// @param faces  counted from the first voxel of the box  @param width  voxels of a row, up to 32
void scan_rows(const RowFaces& faces, int y_begin, int y_end, int z_begin, int z_end, int width, RowScan& scan);

/// Lists the voxels of some rows, one after the other, as long as there is room.
/// @param rows, bits  as in RowScan  @param count  of the rows
/// @param numbers     gets kMostRowTile times the row plus the voxel in it; up to 16 more are written behind the last
/// @param listed      how many are there; grows  @param room  the most there may be
/// @return how many rows are done
int list_voxels(const std::uint16_t* rows, const std::uint32_t* bits, int count, std::uint16_t* numbers, int& listed,
                int room);

}  // namespace tetwarp::cpu
