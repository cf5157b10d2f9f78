// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <limits>
#include <type_traits>

#include "deform/core/sample_voxel.h"
#include "deform/cpu/sampler.h"

namespace tetwarp::cpu {

/// Voxel types that `sample_linear_row` and `sample_vote_row` can sample: integers of 8 and 16 bits, and float.
template <class V>
constexpr bool kHasLinearRow = (std::is_integral_v<V> && sizeof(V) <= 2) || std::is_same_v<V, float>;

/// How the voxels of a source lie that is on the grid of the output.
struct LinearLayout {
  glm::ivec3 begin,  ///< first voxel that is buffered
      last;          ///< last voxel of the whole grid
  std::int32_t row,  ///< voxels from one row to the next
      slice;         ///< voxels from one slice to the next

  bool operator==(const LinearLayout&) const = default;
};

/// A source on the grid of the output, with one component, without padding, and small enough for 32-bit offsets.
struct LinearSource {
  VoxelType type;
  const void* voxels;
  LinearLayout layout;

  /// Describes the source of a plan.
  /// @param buffered  number of voxels that are buffered
  /// @return whether the source can be described
  template <class V>
  static bool make(const SamplePlan<V>& plan, std::int64_t buffered, LinearSource& source) {
    constexpr std::int64_t kMost = INT32_MAX / static_cast<std::int64_t>(sizeof(V));
    if (!plan.relation.same_grid || plan.padding.present || buffered > kMost || buffered < 4) return false;
    const SourceVoxels<V>& of = plan.source;
    source = {voxel_type_of<V>(),
              of.voxels,
              {glm::ivec3(of.begin), glm::ivec3(of.size) - 1, static_cast<std::int32_t>(of.stride.y),
               static_cast<std::int32_t>(of.stride.z)}};
    return true;
  }
};

/// What was done with a voxel.
enum class RowState : std::uint8_t {
  sampled = 1,  ///< its value is written
  left = 2      ///< `sample_voxel` has to compute it
};

/// Where the voxels of a row or a list come from, for all sources with one layout. Only places well inside the source
/// are computed; other voxels are left.
struct LinearPlaces {
  alignas(64) float x[kRoomTogether], y[kRoomTogether], z[kRoomTogether];  ///< fractions
  alignas(64) std::int32_t at[kRoomTogether];                              ///< voxel of the buffer; 0 where it is left
  alignas(64) std::int32_t slice[kRoomTogether];  ///< slice of the source below the place, where it is not left
  RowState state[kRoomTogether];
  bool fused = false;    ///< whether the field is coarse: then interpolations are fused (`Lerp`)
  bool in_a_row = true;  ///< whether the voxels are a row
  int count = 0;         ///< number of voxels in whole vectors; the voxels after them are left
  int sampled = 0;       ///< number of voxels that are not left
  SliceRange slices;     ///< of a row: slices of the sources that have weight where interpolation is linear

  /// Computes the places, once for a row or a list.
  /// @param voxels  up to kMostTogether, the same in all calls
  void find(const LinearLayout& layout, const Row& voxels);
  void find(const LinearLayout& layout, const VoxelList& voxels);

 private:
  bool begins(const LinearLayout& layout);

  LinearLayout layout_;
  bool found_ = false;
};

/// How far each voxel of a list lies from the first of its tile in a volume, with the widest vectors that the processor
/// has (Highway). @param row, slice  from one row and slice of the volume to the next  @param to  up to 64 are written
/// behind the last
void find_steps(const VoxelList& list, std::int32_t row, std::int32_t slice, std::int32_t (&to)[kRoomTogether]);

/// Samples the voxels that are not left, with the widest vectors that the processor has (Highway). The result
/// has the bits of `sample_voxel` with linear interpolation.
///
/// @param places  computed for the layout of the source
/// @param output  gets values of the source's type
void sample_linear_row(const LinearSource& source, const LinearPlaces& places, void* output);

/// The same with Interpolation::vote.
void sample_vote_row(const LinearSource& source, const LinearPlaces& places, void* output);

/// The voxels of the buffer that are nearest to places that are not left, with the widest vectors that the processor
/// has (Highway); for others, some voxel. Some place must not be left.
void find_nearest(const LinearLayout& layout, const LinearPlaces& places, std::int32_t (&at)[kRoomTogether]);

/// Samples with Interpolation::nearest, for any type. @param voxels  of the buffer
template <class V>
void sample_nearest_row(const LinearLayout& layout, const V* voxels, const LinearPlaces& places, V* output) {
  if (places.sampled == 0) return;  // there may be no voxel at all that can be read
  std::int32_t at[kRoomTogether];
  find_nearest(layout, places, at);
  for (int i = 0; i < places.count; ++i) {
    const V value = voxels[at[i]];
    output[i] = value;
    if constexpr (std::is_floating_point_v<V>) {  // all that is no number, and no copy, is one and the same NaN
      const bool is_copy = places.x[i] == 0 && places.y[i] == 0 && places.z[i] == 0;
      if (value != value && !is_copy) output[i] = std::numeric_limits<V>::quiet_NaN();
    }
  }
}

}  // namespace tetwarp::cpu
