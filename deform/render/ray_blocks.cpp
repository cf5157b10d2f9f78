// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/render/ray_blocks.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>

#include "deform/cpu/tiles.h"

namespace tetwarp {

namespace {

/// Finds the ranges of the blocks of one row along i. It first compares whole rows of voxels, column by column.
template <class V>
void find_ranges(const V* voxels, const glm::ivec3& size, const glm::ivec3& block, BlockRange* row) {
  const auto width = static_cast<std::size_t>(size.x);
  constexpr float kHighest = std::numeric_limits<float>::infinity();
  std::vector<float> least(width, kHighest), most(width, -kHighest);
  const RayReach along_j(block.y, size.y), along_k(block.z, size.z);
  for (int k = along_k.begin; k < along_k.end; ++k) {
    for (int j = along_j.begin; j < along_j.end; ++j) {
      const V* const from =
          voxels +
          (static_cast<std::size_t>(k) * static_cast<std::size_t>(size.y) + static_cast<std::size_t>(j)) * width;
      for (std::size_t i = 0; i < width; ++i) {
        const float value = static_cast<float>(from[i]);
        least[i] = value < least[i] ? value : least[i];
        most[i] = value > most[i] ? value : most[i];
      }
    }
  }
  const int blocks = (size.x + kRayBlock - 1) / kRayBlock;
  for (int n = 0; n < blocks; ++n) {
    const RayReach along_i(n, size.x);
    row[n] = {*std::min_element(least.begin() + along_i.begin, least.begin() + along_i.end),
              *std::max_element(most.begin() + along_i.begin, most.begin() + along_i.end)};
  }
}

/// Replaces each number of a line of blocks by the least of max(|n - m|, number m) over all blocks m near n, for all
/// lines along one axis. Done for all axes, this gives distances.
void spread(std::vector<std::uint8_t>& distances, const glm::ivec3& blocks, int axis) {
  const int count = blocks[axis];
  const int across = axis == 0 ? 1 : 0, beyond = axis == 2 ? 1 : 2;
  const auto stride_of = [&](int other) {
    return other == 0   ? std::size_t{1}
           : other == 1 ? static_cast<std::size_t>(blocks.x)
                        : static_cast<std::size_t>(blocks.x) * static_cast<std::size_t>(blocks.y);
  };
  const std::size_t stride = stride_of(axis);
  tbb::parallel_for(0, blocks[beyond], [&](int b) {
    std::vector<int> line(static_cast<std::size_t>(count));
    for (int a = 0; a < blocks[across]; ++a) {
      std::uint8_t* const first = distances.data() + static_cast<std::size_t>(a) * stride_of(across) +
                                  static_cast<std::size_t>(b) * stride_of(beyond);
      for (int n = 0; n < count; ++n) line[static_cast<std::size_t>(n)] = first[static_cast<std::size_t>(n) * stride];
      for (int n = 0; n < count; ++n) {
        int nearest = line[static_cast<std::size_t>(n)];
        for (int apart = 1; apart < nearest; ++apart) {
          if (n >= apart) nearest = std::min(nearest, std::max(apart, line[static_cast<std::size_t>(n - apart)]));
          if (n + apart < count)
            nearest = std::min(nearest, std::max(apart, line[static_cast<std::size_t>(n + apart)]));
        }
        first[static_cast<std::size_t>(n) * stride] = static_cast<std::uint8_t>(nearest);
      }
    }
  });
}

/// The blocks along one axis that contain values of some voxels of it: they reach them (`RayReach`).
struct BlocksOf {
  /// @param from, to  the voxels, half-open  @param size  voxels on the axis
  BlocksOf(std::int64_t from, std::int64_t to, int size)
      // A block contains values of the nearest voxels around it, too, so the first may lie one block lower.
      : begin(std::max(static_cast<int>(from) / kRayBlock - 1, 0)),
        end(std::min((static_cast<int>(to) + kRayBlock) / kRayBlock, (size + kRayBlock - 1) / kRayBlock)) {
    while (begin < end && RayReach(begin, size).end <= from) ++begin;
    while (begin < end && RayReach(end - 1, size).begin >= to) --end;
  }
  int begin, end;
};

}  // namespace

glm::ivec3 ray_blocks(const Geometry& volume) { return (glm::ivec3(volume.size) + (kRayBlock - 1)) / kRayBlock; }

std::vector<int> block_rows_of(const Geometry& volume, std::span<const Region> regions) {
  const glm::ivec3 size(volume.size), blocks = ray_blocks(volume);
  std::vector<std::uint8_t> is_of(static_cast<std::size_t>(blocks.y) * static_cast<std::size_t>(blocks.z));
  for (const Region& region : regions) {
    if (is_empty(region)) continue;
    const BlocksOf y(region.begin.y, region.end.y, size.y), z(region.begin.z, region.end.z, size.z);
    for (int k = z.begin; k < z.end; ++k)
      std::fill_n(is_of.begin() + k * blocks.y + y.begin, y.end - y.begin, std::uint8_t{1});
  }
  std::vector<int> rows;
  for (std::size_t row = 0; row < is_of.size(); ++row) {
    if (is_of[row] != 0) rows.push_back(static_cast<int>(row));
  }
  return rows;
}

void mark_blocks_of(const Geometry& volume, std::span<const Region> regions, std::vector<std::uint8_t>& marked) {
  const glm::ivec3 size(volume.size), blocks = ray_blocks(volume);
  if (marked.empty())
    marked.resize(static_cast<std::size_t>(blocks.x) * static_cast<std::size_t>(blocks.y) *
                  static_cast<std::size_t>(blocks.z));
  for (const Region& region : regions) {
    if (is_empty(region)) continue;
    const BlocksOf x(region.begin.x, region.end.x, size.x), y(region.begin.y, region.end.y, size.y),
        z(region.begin.z, region.end.z, size.z);
    for (int k = z.begin; k < z.end; ++k) {
      for (int j = y.begin; j < y.end; ++j)
        std::fill_n(marked.begin() + (k * blocks.y + j) * blocks.x + x.begin, x.end - x.begin, std::uint8_t{1});
    }
  }
}

void find_block_ranges(const ConstVolumeView& volume, std::span<const int> rows, Limits limits,
                       std::vector<BlockRange>& ranges) {
  const glm::ivec3 size = volume.geometry->size, blocks = ray_blocks(*volume.geometry);
  const auto width = static_cast<std::size_t>(blocks.x);
  ranges.resize(width * static_cast<std::size_t>(blocks.y) * static_cast<std::size_t>(blocks.z));
  cpu::Arena arena(limits);
  dispatch(volume.type, [&](auto voxel) {
    const auto* const voxels = reinterpret_cast<const decltype(voxel)*>(volume.voxels);
    arena.execute([&] {
      tbb::parallel_for(std::size_t{0}, rows.size(), [&](std::size_t n) {
        const int row = rows[n];
        find_ranges(voxels, size, {0, row % blocks.y, row / blocks.y},
                    ranges.data() + static_cast<std::size_t>(row) * width);
      });
    });
  });
}

std::vector<int> opaque_before(const std::vector<TransferEntry>& table) {
  std::vector<int> before(table.size() + 1, 0);
  for (std::size_t n = 0; n < table.size(); ++n) before[n + 1] = before[n] + (table[n].opacity > 0 ? 1 : 0);
  return before;
}

std::vector<std::uint8_t> block_distances(const std::vector<BlockRange>& ranges, const glm::ivec3& blocks,
                                          const RayFrame& frame, const std::vector<TransferEntry>& table) {
  const std::vector<int> before = opaque_before(table);
  std::vector<std::uint8_t> distances(ranges.size());
  for (std::size_t n = 0; n < ranges.size(); ++n)
    distances[n] = is_empty(ranges[n], frame, before.data()) ? kFarthestBlock : 0;
  for (int axis = 0; axis < 3; ++axis) spread(distances, blocks, axis);
  return distances;
}

}  // namespace tetwarp
