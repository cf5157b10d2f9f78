// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
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

/// What was done with a voxel of a row.
enum class RowState : std::uint8_t {
  sampled = 1,  ///< its value is written
  left = 2      ///< `sample_voxel` has to compute it
};

/// Where the voxels of a row come from, for all sources with one layout. Only places well inside the source are
/// computed; other voxels are left.
struct LinearPlaces {
  alignas(64) float x[kMostInRow], y[kMostInRow], z[kMostInRow];  ///< fractions
  alignas(64) std::int32_t at[kMostInRow];                        ///< voxel of the buffer; 0 where it is left
  RowState state[kMostInRow];
  bool fused = false;  ///< whether the field is coarse: then interpolations are fused (`Lerp`)
  int count = 0;       ///< number of voxels in whole vectors; the voxels after them are left
  int sampled = 0;     ///< number of voxels that are not left
  SliceRange slices;   ///< slices of the sources that have weight

  /// Computes the places, once for a row.
  /// @param row  up to kMostInRow voxels, the same in all calls
  void find(const LinearLayout& layout, const Row& row);

 private:
  LinearLayout layout_;
  bool found_ = false;
};

/// Samples the voxels of a row that are not left, with the widest vectors that the processor has (Highway). The result
/// has the bits of `sample_voxel` with linear interpolation.
///
/// @param places  computed for the layout of the source
/// @param output  gets values of the source's type
void sample_linear_row(const LinearSource& source, const LinearPlaces& places, void* output);

/// The same with Interpolation::vote.
void sample_vote_row(const LinearSource& source, const LinearPlaces& places, void* output);

}  // namespace tetwarp::cpu
