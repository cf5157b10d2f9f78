// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <type_traits>

#include "deform/core/sample_voxel.h"
#include "deform/cpu/sampler.h"

namespace tetwarp::cpu {

/// Voxel types of which `sample_linear_row` knows what two that lie side by side are made of.
template <class V>
constexpr bool kHasLinearRow = std::is_integral_v<V> && sizeof(V) <= 2;

/// How the voxels lie of a source on the grid of the output.
struct LinearLayout {
  glm::ivec3 begin, last;   ///< first voxel that is buffered, and last voxel of the whole grid
  std::int32_t row, slice;  ///< steps from a voxel to the next

  bool operator==(const LinearLayout&) const = default;
};

/// A source on the grid of the output, of one component and without padding, that 32-bit offsets reach.
struct LinearSource {
  VoxelType type;
  const void* voxels;
  LinearLayout layout;

  /// @param buffered  voxels that are buffered  @return whether there is such a source
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

constexpr int kMostInRow = 64;  ///< voxels that are sampled together; tiles have fewer

/// What becomes of a voxel of a row.
enum class RowState : std::uint8_t {
  sampled = 1,  ///< written
  left = 2      ///< for `sample_voxel`
};

/// Where the voxels of a row come from in all sources of one layout: those from well inside; others are left.
struct LinearPlaces {
  alignas(64) float x[kMostInRow], y[kMostInRow], z[kMostInRow];  ///< fractions
  alignas(64) std::int32_t at[kMostInRow];                        ///< voxel of the buffer; 0 where it is left
  RowState state[kMostInRow];
  int count = 0;      ///< voxels, whole vectors of them; those behind are left
  int sampled = 0;    ///< voxels that are not left
  SliceRange slices;  ///< of the sources

  /// Finds them once for a row.
  /// @param row  of up to kMostInRow voxels, the same in all calls
  void find(const LinearLayout& layout, const Row& row);

 private:
  LinearLayout layout_;
  bool found_ = false;
};

/// Samples what is not left: the bits of `sample_voxel` with linear interpolation, by the widest vectors that the
/// processor has (Highway).
///
/// @param places  for the layout of the source  @param output  of the source's type
void sample_linear_row(const LinearSource& source, const LinearPlaces& places, void* output);

/// The same for a vote, where all voxels around have one label.
///
/// @param state  of each voxel, as `places` has it; where there are several labels, it is left
/// @return voxels that are not left
int sample_uniform_row(const LinearSource& source, const LinearPlaces& places, void* output, RowState* state);

}  // namespace tetwarp::cpu
