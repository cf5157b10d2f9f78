// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/lattice/slab.cuh"

namespace tetwarp::cuda_detail {

/// One axis of `place_at`: carries to the next voxel where the fraction was rounded up to 1.
__device__ inline void carry_on_axis(int& base, float& rest) {
  if (rest < 1.0f) return;
  ++base;
  rest = 0;
}

/// One axis of `clamp_to_grid`.
/// @return false if the place lies further out
__device__ inline bool clamp_on_axis(int last, int& base, float& fraction) {
  if (static_cast<unsigned>(base) < static_cast<unsigned>(last)) return true;
  const bool low = base == -1 && fraction >= 0.5f, high = base == last && fraction <= 0.5f;
  base = low ? 0 : base;
  fraction = 0;
  return low || high;
}

/// Linear interpolation along x, then y, then z.
template <Lerp kRounding>
__device__ float interpolate(const float (&v)[8], const glm::vec3& t) {
  const auto along_x = [&](int from) { return lerp(kRounding, t.x, v[from], v[from + 1]); };
  const auto along_y = [&](int from) { return lerp(kRounding, t.y, along_x(from), along_x(from + 2)); };
  return lerp(kRounding, t.z, along_y(0), along_y(4));
}

/// The eight voxels from one on, as words.
template <class V>
__device__ void read_corners(const V* v, int dx, int dy, int dz, int (&corners)[8]) {
#pragma unroll
  for (int n = 0; n < 8; ++n)
    corners[n] = v[((n & 1) != 0 ? dx : 0) + ((n & 2) != 0 ? dy : 0) + ((n & 4) != 0 ? dz : 0)];
}

/// A number to add to a float: it rounds the float to a whole number, which the lowest bits of the sum contain.
constexpr float kToWhole = 3.0f * (1 << 22);

template <class V, Lerp kRounding>
__device__ V interpolated(const int (&corners)[8], const glm::vec3& t) {
  float v[8];
#pragma unroll
  for (int n = 0; n < 8; ++n) v[n] = static_cast<float>(corners[n]);
  return static_cast<V>(
      __float_as_int(interpolate<kRounding>(v, t) + kToWhole));  // between the corners: never saturates
}

/// The whole voxels of minus `moved`, rounded down, as bits of a float that is raised by `kToWhole`; and the fraction.
__device__ inline int whole_bits(float moved, float& fraction) {
  const float whole = __fmaf_rd(moved, -kVoxelsPerStep, kToWhole);
  fraction = fmaf(moved, -kVoxelsPerStep, kToWhole - whole);
  return __float_as_int(whole);
}

__device__ inline unsigned SinkLayout::column(const glm::ivec3& voxel) const {
  const auto by_row = static_cast<unsigned>(row), by_slice = static_cast<unsigned>(slice);
  const glm::uvec3 at = glm::uvec3(voxel) - static_cast<unsigned>(__float_as_int(kToWhole));
  return at.z * by_slice + at.y * by_row + at.x;
}

template <bool kInside>
__device__ bool SinkLayout::locate(const glm::ivec3& voxel, unsigned column, const glm::vec3& moved,
                                   Origin& origin) const {
  const auto x = static_cast<unsigned>(whole_bits(moved.x, origin.fraction.x)),
             y = static_cast<unsigned>(whole_bits(moved.y, origin.fraction.y)),
             z = static_cast<unsigned>(whole_bits(moved.z, origin.fraction.z));
  origin.base = static_cast<int>(z * static_cast<unsigned>(slice) + (y * static_cast<unsigned>(row) + (x + column)));
  // A negative u that is small gives a fraction that is rounded to 1. Along x, between whole numbers, a + 1 (b - a) is
  // b; along y and z it need not be, so that the place must be carried to the next voxel.
  const bool is_whole = fmaxf(origin.fraction.y, origin.fraction.z) < 1.0f;
  if constexpr (kInside) return is_whole;
  const auto is_below = [](int voxel, unsigned bits, int end) {
    return static_cast<unsigned>(voxel) + (bits - static_cast<unsigned>(__float_as_int(kToWhole))) <
           static_cast<unsigned>(end);
  };
  return is_whole & is_below(voxel.x, x, last.x) & is_below(voxel.y, y, last.y) & is_below(voxel.z, z, last.z);
}

__device__ inline bool SinkLayout::locate(const glm::ivec3& voxel, const glm::vec3& moved, Origin& origin) const {
  const auto on_axis = [](int voxel, float moved, int& base, float& fraction) {
    base = voxel + (whole_bits(moved, fraction) - __float_as_int(kToWhole));
  };
  glm::ivec3 base;
  on_axis(voxel.x, moved.x, base.x, origin.fraction.x);
  on_axis(voxel.y, moved.y, base.y, origin.fraction.y);
  on_axis(voxel.z, moved.z, base.z, origin.fraction.z);
  const auto is_below = [](int index, int end) { return static_cast<unsigned>(index) < static_cast<unsigned>(end); };
  origin.base = source_index(base);
  return is_below(base.x, last.x) & is_below(base.y, last.y) & is_below(base.z, last.z) &
         (fmaxf(origin.fraction.y, origin.fraction.z) < 1.0f);  // a fraction that was rounded to 1 must be carried
}

/// The fraction of a number of 2^-23 voxel.
__device__ inline float fraction_of(int u) {
  constexpr int kFraction = static_cast<int>(kFixedOne - 1), kOne = 0x3F800000;  // the bits of 1.0f
  return __int_as_float((u & kFraction) | kOne) - 1.0f;
}

template <bool kInside>
__device__ bool SinkLayout::locate(const glm::ivec3& voxel, unsigned column, const FixedU& of, Origin& origin) const {
  const glm::i32vec3 whole = of.u >> kFixedBits;
  origin.fraction = {fraction_of(of.u.x), fraction_of(of.u.y), fraction_of(of.u.z)};
  // `column` is for whole voxels that are raised by `kToWhole`; what that takes is the same for all voxels.
  const auto by_row = static_cast<unsigned>(row), by_slice = static_cast<unsigned>(slice),
             raised = static_cast<unsigned>(__float_as_int(kToWhole)) * (by_slice + by_row + 1);
  origin.base = static_cast<int>(
      static_cast<unsigned>(whole.z) * by_slice +
      (static_cast<unsigned>(whole.y) * by_row + (static_cast<unsigned>(whole.x) + (column + raised))));
  if constexpr (kInside) return of.any;
  const auto is_below = [](int index, int end) { return static_cast<unsigned>(index) < static_cast<unsigned>(end); };
  return of.any & is_below(voxel.x + whole.x, last.x) & is_below(voxel.y + whole.y, last.y) &
         is_below(voxel.z + whole.z, last.z);
}

__device__ inline bool SinkLayout::locate(const glm::ivec3& voxel, const FixedU& of, Origin& origin) const {
  return locate<false>(voxel, column(voxel), of, origin);
}

__device__ inline bool SinkLayout::locate_exactly(const glm::ivec3& voxel, const FixedOffset& u, Origin& origin) const {
  origin.fraction = u.fraction;
  return clamp(voxel + u.whole, origin);
}

__device__ inline bool SinkLayout::locate_exactly(const glm::ivec3& voxel, const glm::vec3& u, Origin& origin) const {
  const glm::ivec3 whole(__float2int_rd(u.x), __float2int_rd(u.y), __float2int_rd(u.z));
  glm::ivec3 base = voxel + whole;
  origin.fraction = u - glm::vec3(whole);
  for (int axis = 0; axis < 3; ++axis) carry_on_axis(base[axis], origin.fraction[axis]);
  return clamp(base, origin);
}

__device__ inline bool SinkLayout::clamp(glm::ivec3 base, Origin& origin) const {
  glm::vec3& t = origin.fraction;
  const bool in_x = clamp_on_axis(last.x, base.x, t.x), in_y = clamp_on_axis(last.y, base.y, t.y),
             in_z = clamp_on_axis(last.z, base.z, t.z);
  origin.base = source_index(base);
  return in_x && in_y && in_z;
}

template <class V, Lerp kRounding>
__device__ void VoxelSink<V, kRounding>::begin(const Origin& origin, bool wanted, Pending& pending) const {
  pending.fraction = origin.fraction;
  if (wanted) read_corners(source + origin.base, 1, row, slice, pending.corners);
}

template <class V, Lerp kRounding>
__device__ void VoxelSink<V, kRounding>::end(int address, const Pending& pending) const {
  output[address] = interpolated<V, kRounding>(pending.corners, pending.fraction);
}

template <class V, Lerp kRounding>
template <class Moved>
__device__ void VoxelSink<V, kRounding>::start(int, const glm::ivec3& voxel, const Moved& moved, bool wanted,
                                               Pending& pending) const {
  Origin origin;
  pending.any = wanted & locate(voxel, moved, origin);
  begin(origin, pending.any, pending);
}

template <class V, Lerp kRounding>
__device__ void VoxelSink<V, kRounding>::finish(int address, const Pending& pending) const {
  // A branch, so that nothing of it is moved before what is read meanwhile.
  if (pending.any) end(address, pending);
}

template <class V, Lerp kRounding>
template <class Offset>
__device__ bool VoxelSink<V, kRounding>::write(int address, const glm::ivec3& voxel, const Offset& u) const {
  Origin origin;
  if (!locate_exactly(voxel, u, origin)) {
    nothing(address);
    return false;
  }
  const glm::vec3& t = origin.fraction;
  int corners[8];  // neighbours without weight may be any voxels: their finite values do not count
  read_corners(source + origin.base, t.x != 0 ? 1 : 0, t.y != 0 ? row : 0, t.z != 0 ? slice : 0, corners);
  output[address] = interpolated<V, kRounding>(corners, t);
  return true;
}

/// Where labels meet; out of line, for few voxels, and by value, so that registers hold them where they do not.
__device__ __noinline__ inline int vote_among(int4 low, int4 high, glm::vec3 t) {
  const int labels[8] = {low.x, low.y, low.z, low.w, high.x, high.y, high.z, high.w};
  const SourceVoxels<int> source{labels, glm::i64vec3(2), glm::i64vec3(0), {1, 2, 4}};
  return sample_vote(source, {glm::i64vec3(0), t}, Padding<int>{}).value;
}

__device__ inline int voted(const int (&l)[8], const glm::vec3& t) {
  bool uniform = true;
#pragma unroll
  for (int n = 1; n < 8; ++n) uniform = uniform & (l[n] == l[0]);
  return uniform ? l[0] : vote_among({l[0], l[1], l[2], l[3]}, {l[4], l[5], l[6], l[7]}, t);
}

template <class V, Lerp kRounding>
template <class Work>
__device__ void VolumesSink<V, kRounding>::with_type(const SinkVolume& volume, Work&& work) const {
  if constexpr (!std::is_void_v<V>) {
    work(static_cast<V*>(nullptr));
  } else if (volume.type == VoxelType::i16) {
    work(static_cast<std::int16_t*>(nullptr));
  } else if (volume.type == VoxelType::u8) {
    work(static_cast<std::uint8_t*>(nullptr));
  } else {
    work(static_cast<std::uint16_t*>(nullptr));
  }
}

template <class V, Lerp kRounding>
__device__ void VolumesSink<V, kRounding>::read(const SinkVolume& volume, const Origin& origin, const glm::ivec3& step,
                                                int (&corners)[8]) const {
  with_type(volume, [&](auto* type) {
    using T = std::remove_pointer_t<decltype(type)>;
    read_corners(static_cast<const T*>(volume.source) + origin.base, step.x, step.y, step.z, corners);
  });
}

template <class V, Lerp kRounding>
__device__ void VolumesSink<V, kRounding>::put(const SinkVolume& volume, int address, int value) const {
  with_type(volume, [&](auto* type) {
    using T = std::remove_pointer_t<decltype(type)>;
    static_cast<T*>(volume.output)[address] = static_cast<T>(value);
  });
}

template <class V, Lerp kRounding>
__device__ void VolumesSink<V, kRounding>::put(const SinkVolume& volume, int address, const int (&corners)[8],
                                               const glm::vec3& t) const {
  put(volume, address,
      std::is_void_v<V> && volume.votes ? voted(corners, t) : interpolated<int, kRounding>(corners, t));
}

template <class V, Lerp kRounding>
__device__ void VolumesSink<V, kRounding>::begin(const Origin& origin, bool wanted, Pending& pending) const {
  pending.any = wanted;
  pending.origin = origin;
  if (!wanted) return;
#pragma unroll
  for (int n = 0; n < kOnTheWay; ++n)
    if (n == 0 || n < count) read(volumes[n], origin, {1, row, slice}, pending.corners[n]);
}

template <class V, Lerp kRounding>
template <class Moved>
__device__ void VolumesSink<V, kRounding>::start(int, const glm::ivec3& voxel, const Moved& moved, bool wanted,
                                                 Pending& pending) const {
  Origin origin;
  const bool inside = locate(voxel, moved, origin);
  begin(origin, wanted & inside, pending);
}

template <class V, Lerp kRounding>
__device__ void VolumesSink<V, kRounding>::finish(int address, const Pending& pending) const {
  if (!pending.any) return;
#pragma unroll
  for (int n = 0; n < kOnTheWay; ++n)
    if (n == 0 || n < count) put(volumes[n], address, pending.corners[n], pending.origin.fraction);
  for (int n = kOnTheWay; n < count; ++n) {
    int corners[8];
    read(volumes[n], pending.origin, {1, row, slice}, corners);
    put(volumes[n], address, corners, pending.origin.fraction);
  }
}

template <class V, Lerp kRounding>
template <class Offset>
__device__ bool VolumesSink<V, kRounding>::write(int address, const glm::ivec3& voxel, const Offset& u) const {
  Origin origin;
  if (!locate_exactly(voxel, u, origin)) {
    nothing(address);
    return false;
  }
  const glm::vec3& t = origin.fraction;
  const glm::ivec3 step(t.x != 0 ? 1 : 0, t.y != 0 ? row : 0, t.z != 0 ? slice : 0);
  for (int n = 0; n < count; ++n) {
    int corners[8];
    read(volumes[n], origin, step, corners);
    put(volumes[n], address, corners, t);
  }
  return true;
}

/// Reads first, then writes.
template <int kCount, class V>
__device__ void copy_column(const V* from, int from_step, V* to, int to_step, std::uint32_t wanted) {
  V copied[kCount];
#pragma unroll
  for (int n = 0; n < kCount; ++n)
    if ((wanted >> n & 1) != 0) copied[n] = from[n * from_step];
#pragma unroll
  for (int n = 0; n < kCount; ++n)
    if ((wanted >> n & 1) != 0) to[n * to_step] = copied[n];
}

template <class V, Lerp kRounding>
template <int kCount>
__device__ void VoxelSink<V, kRounding>::copy(const glm::ivec3& voxel, std::uint32_t wanted) const {
  copy_column<kCount>(source + source_index(voxel), slice, output + address(voxel), output_slice, wanted);
}

template <class V, Lerp kRounding>
template <int kCount>
__device__ void VolumesSink<V, kRounding>::copy(const glm::ivec3& voxel, std::uint32_t wanted) const {
  for (int n = 0; n < count; ++n) {
    with_type(volumes[n], [&](auto* type) {
      using T = std::remove_pointer_t<decltype(type)>;
      copy_column<kCount>(static_cast<const T*>(volumes[n].source) + source_index(voxel), slice,
                          static_cast<T*>(volumes[n].output) + address(voxel), output_slice, wanted);
    });
  }
}

template <class V, Lerp kRounding>
__device__ void VolumesSink<V, kRounding>::nothing(int address) const {
  for (int n = 0; n < count; ++n) put(volumes[n], address, volumes[n].background);
}

}  // namespace tetwarp::cuda_detail
