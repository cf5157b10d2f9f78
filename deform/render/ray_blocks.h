// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>
#include <vector>

#include "deform/core/ray_cast.h"
#include "deform/resampler.h"

namespace tetwarp {

/// The voxels along one axis whose values block `n` contains: see `BlockRange`. @param size  voxels on the axis
struct RayReach {
  TETWARP_HD RayReach(int n, int size)
      : begin(n * kRayBlock > 1 ? n * kRayBlock - 1 : 0),
        end((n + 1) * kRayBlock + 2 < size ? (n + 1) * kRayBlock + 2 : size) {}
  int begin, end;
};
constexpr int kMostRayReach = kRayBlock + 3;

/// How many blocks a volume has.
glm::ivec3 ray_blocks(const Geometry& volume);

/// The rows of blocks along i that contain values of some regions of a volume, as z * blocks.y + y, rising.
std::vector<int> block_rows_of(const Geometry& volume, std::span<const Region> regions);

/// Marks the blocks that contain values of some regions of a volume.
/// @param marked  1 for these, else as before, i fastest; if empty, it becomes one 0 for each block first
void mark_blocks_of(const Geometry& volume, std::span<const Region> regions, std::vector<std::uint8_t>& marked);

/// Finds the least and largest value around each block, i fastest. Values that are not numbers are left out.
/// @param volume  passed `require_renderable`; in host memory
/// @param rows    rows of blocks that are wanted, as `block_rows_of` has them  @param ranges  of all blocks: written
void find_block_ranges(const ConstVolumeView& volume, std::span<const int> rows, Limits limits,
                       std::vector<BlockRange>& ranges);

/// How many entries below each entry have opacity: kTransferEntries + 1 numbers, so that two of them tell whether any
/// entry between has it.
std::vector<int> opaque_before(const std::vector<TransferEntry>& table);

/// Whether nothing of a block can be seen: no value of it has opacity or, for Projection::maximum, none exceeds the
/// lowest value of the table.
TETWARP_INLINE_HD bool is_empty(const BlockRange& range, const RayFrame& frame, const int* opaque_before) {
  if (!(range.least <= range.most)) return true;  // no value of the block is a number
  if (frame.projection == Projection::maximum) return range.most <= frame.lowest;
  return opaque_before[transfer_entry(frame, range.most) + 1] == opaque_before[transfer_entry(frame, range.least)];
}

/// For each block, the distance in blocks to the nearest one that is not empty, the largest along an axis, at most
/// kFarthestBlock; 0 for blocks that are not empty (distance maps, Deakin and Knoll 2019).
std::vector<std::uint8_t> block_distances(const std::vector<BlockRange>& ranges, const glm::ivec3& blocks,
                                          const RayFrame& frame, const std::vector<TransferEntry>& table);

}  // namespace tetwarp
