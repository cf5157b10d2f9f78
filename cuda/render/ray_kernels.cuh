// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <limits>
#include <type_traits>

#include "deform/core/ray_pick.h"
#include "deform/render/ray_blocks.h"
#include "deform/render/ray_frame.h"

/// The kernels of the renderer. For renderer.cu alone.
namespace tetwarp::cuda_detail {

namespace {

constexpr int kRangeThreads = 128, kDistanceThreads = 256;
constexpr int kRangeBlocks = (kRangeThreads - kMostRayReach) / kRayBlock + 1;  ///< of voxels, that a thread block takes
constexpr int kPatchWidth = 8, kPatchHeight = 4;  ///< pixels of a warp: near rays read the same voxels
constexpr int kPatches = 4;                       ///< of a thread block
constexpr int kCopyWidth = 32, kCopyRows = 8;     ///< words and rows of a thread block

/// Copies rows of voxels to where they lie further apart. A thread block a row of blocks, a warp a row of voxels.
///
/// @param from        rows of `words` words, one after another  @param rows  of a slice  @param slices  of the volume
/// @param block_rows  z * blocks_y + y of each row of blocks that is wanted, gridDim.x of them; null: all
/// @param blocks_y    rows of blocks of a slice
/// @param to          written: rows are `pitch` words apart, and a slice has room for `slots` rows
template <class Word>
__global__ void __launch_bounds__(kCopyWidth* kCopyRows)
    copy_kernel(const Word* from, int words, int rows, int slices, const int* block_rows, int blocks_y, Word* to,
                int pitch, int slots) {
  const int block_row = block_rows ? block_rows[blockIdx.x] : static_cast<int>(blockIdx.x);
  const int y = block_row % blocks_y * kRayBlock, z = block_row / blocks_y * kRayBlock;
  for (int n = static_cast<int>(threadIdx.y); n < kRayBlock * kRayBlock; n += kCopyRows) {
    const int row = y + n % kRayBlock, slice = z + n / kRayBlock;
    if (row >= rows || slice >= slices) continue;
    const Word* const source = from + ray::wide_product(slice * rows + row, words);
    Word* const copy = to + ray::wide_product(slice * slots + row, pitch);
    for (int word = static_cast<int>(threadIdx.x); word < words; word += kCopyWidth) copy[word] = source[word];
  }
}

/// What voxels are compared as: whole numbers as they are.
template <class V>
struct Extremes {
  using Value = std::conditional_t<std::is_integral_v<V>, V, float>;
  static constexpr Value kHighest =
      std::is_integral_v<V> ? std::numeric_limits<Value>::max() : std::numeric_limits<Value>::infinity();
  static constexpr Value kLowest = std::is_integral_v<V> ? std::numeric_limits<Value>::lowest() : -kHighest;

  Value least = kHighest, most = kLowest;

  __device__ void add(Value low, Value high) {
    least = low < least ? low : least;
    most = high > most ? high : most;
  }
};

/// The least and largest value of blocks of voxels and what is around them (`RayReach`). A thread block looks at a row
/// of blocks along i: a thread at a column of voxels, across j and k, and then at a block.
///
///     thread       0 1 2 3 ...                            columns of voxels: one value each to shared memory
///     thread           0           1           2 ...      blocks: the columns that each one reaches
///
/// @param voxels  i fastest  @param size  voxels on each axis  @param blocks  of voxels on each axis
/// @param row         blocks that a thread block takes
/// @param block_rows  z * blocks.y + y of each row of blocks that is wanted, gridDim.y of them; null: all
/// @param ranges      of each block, i fastest: written
template <class V>
__global__ void __launch_bounds__(kRangeThreads) range_kernel(const V* voxels, glm::ivec3 size, glm::ivec3 blocks,
                                                              int row, const int* block_rows, BlockRange* ranges) {
  using Value = typename Extremes<V>::Value;
  const int block_row = block_rows ? block_rows[blockIdx.y] : static_cast<int>(blockIdx.y);
  const glm::ivec3 first(static_cast<int>(blockIdx.x) * row, block_row % blocks.y, block_row / blocks.y);
  const int count = min(row, blocks.x - first.x), thread = static_cast<int>(threadIdx.x);
  const int begin = RayReach(first.x, size.x).begin, end = RayReach(first.x + count - 1, size.x).end;
  const RayReach j(first.y, size.y), k(first.z, size.z);
  __shared__ Value all_least[kRangeThreads], all_most[kRangeThreads];
  if (begin + thread < end) {
    Extremes<V> found;
    for (int z = k.begin; z < k.end; ++z) {
      const V* const slice = voxels + ray::number_in(size, {begin + thread, 0, z});
#pragma unroll
      for (int n = 0; n < kMostRayReach; ++n) {  // the last row again where there are less
        const auto value = static_cast<Value>(slice[std::int64_t{min(j.begin + n, j.end - 1)} * size.x]);
        found.add(value, value);
      }
    }
    all_least[thread] = found.least;
    all_most[thread] = found.most;
  }
  __syncthreads();
  if (thread >= count) return;
  const RayReach i(first.x + thread, size.x);
  Extremes<V> found;
  for (int n = i.begin; n < i.end; ++n) found.add(all_least[n - begin], all_most[n - begin]);
  ranges[ray::number_in(blocks, {first.x + thread, first.y, first.z})] = {static_cast<float>(found.least),
                                                                          static_cast<float>(found.most)};
}

/// Which blocks rays may leap over: 0 where something is to be seen, the farthest distance where nothing is. A thread a
/// block.
///
/// @param ranges         of each block, from `range_kernel`  @param count  how many  @param frame  the style's limits
/// @param opaque_before  for each entry of the table, how many before it are not clear
/// @param distances      of each block: written
__global__ void empty_kernel(const BlockRange* ranges, int count, RayFrame frame, const int* opaque_before,
                             std::uint8_t* distances) {
  const int n = static_cast<int>(blockIdx.x) * kDistanceThreads + static_cast<int>(threadIdx.x);
  if (n < count) distances[n] = is_empty(ranges[n], frame, opaque_before) ? kFarthestBlock : 0;
}

/// Each number becomes the least of max(|n - m|, number m) along one axis, as `block_distances` has it. Three launches,
/// one for each axis, give the distance to the nearest block with something in it. A thread a block.
///
/// @param from  of each block, i fastest  @param to  another array: written
__global__ void spread_kernel(const std::uint8_t* from, glm::ivec3 blocks, int axis, std::uint8_t* to) {
  const int n = static_cast<int>(blockIdx.x) * kDistanceThreads + static_cast<int>(threadIdx.x);
  if (n >= blocks.x * blocks.y * blocks.z) return;
  const int stride = axis == 0 ? 1 : axis == 1 ? blocks.x : blocks.x * blocks.y;
  const int at = n / stride % blocks[axis];
  int nearest = from[n];
  for (int apart = 1; apart < nearest; ++apart) {
    if (at >= apart) nearest = min(nearest, max(apart, static_cast<int>(from[n - apart * stride])));
    if (at + apart < blocks[axis]) nearest = min(nearest, max(apart, static_cast<int>(from[n + apart * stride])));
  }
  to[n] = static_cast<std::uint8_t>(nearest);
}

/// Casts the rays of a picture: a thread a pixel, a warp 8 x 4 pixels, so that its rays read the same voxels.
///
/// @param scene    volume, tables and camera  @param width, height  pixels of the picture
/// @param patches  y * columns + x of each patch of 8 x 4 pixels that is wanted; null: all  @param count  how many
/// @param rgb      three bytes a pixel, row by row: written
template <class V>
__global__ void __launch_bounds__(kPatches * 32, 8)
    ray_kernel(RayScene<V> scene, int width, int height, const int* patches, int count, std::uint8_t* rgb) {
  const int lane = static_cast<int>(threadIdx.x) % 32,
            n = static_cast<int>(blockIdx.x) * kPatches + static_cast<int>(threadIdx.x) / 32;
  if (n >= count) return;
  const int patch = patches ? patches[n] : n, columns = (width + kPatchWidth - 1) / kPatchWidth;
  const int x = patch % columns * kPatchWidth + lane % kPatchWidth,
            y = patch / columns * kPatchHeight + lane / kPatchWidth;
  if (x >= width || y >= height) return;
  const RayColour colour = cast_ray(scene, x, y);
  std::uint8_t* const pixel = rgb + 3 * (static_cast<std::int64_t>(y) * width + x);
  pixel[0] = colour.red;
  pixel[1] = colour.green;
  pixel[2] = colour.blue;
}

/// Finds what one pixel shows, by one thread.
///
/// @param scene  see `ray_kernel`  @param index  three numbers, the continuous index of the place, and 1 if there is
/// one, else 0: written
template <class V>
__global__ void pick_kernel(RayScene<V> scene, int column, int row, float* index) {
  glm::vec3 place(0);
  index[3] = ray::pick(scene, column, row, place) ? 1.0f : 0.0f;
  for (int axis = 0; axis < 3; ++axis) index[axis] = place[axis];
}

}  // namespace

}  // namespace tetwarp::cuda_detail
