#pragma once

#include <cstdint>
#include <type_traits>

#include "deform/core/sample_voxel.h"
#include "deform/cpu/sampler.h"

namespace tetwarp::cpu {

/// Voxel types of which `sample_linear_row` knows what two that lie side by side are made of.
template <class V>
constexpr bool kHasLinearRow = std::is_integral_v<V> && sizeof(V) <= 2;

/// A source on the grid of the output, of one component and without padding, that 32-bit offsets reach.
struct LinearSource {
  VoxelType type;
  const void* voxels;
  glm::ivec3 begin, last;  ///< first voxel that is buffered, and last voxel of the whole grid
  std::int32_t row, slice, voxel_count;

  /// @param buffered  voxels that are buffered  @return whether there is such a source
  template <class V>
  static bool make(const SamplePlan<V>& plan, std::int64_t buffered, LinearSource& source) {
    constexpr std::int64_t kMost = INT32_MAX / static_cast<std::int64_t>(sizeof(V));
    if (!plan.relation.same_grid || plan.padding.present || buffered > kMost || buffered < 4) return false;
    const SourceVoxels<V>& of = plan.source;
    source = {voxel_type_of<V>(),
              of.voxels,
              glm::ivec3(of.begin),
              glm::ivec3(of.size) - 1,
              static_cast<std::int32_t>(of.stride.y),
              static_cast<std::int32_t>(of.stride.z),
              static_cast<std::int32_t>(buffered)};
    return true;
  }
};

constexpr int kMostInRow = 64;  ///< voxels that are sampled together; tiles have fewer

/// What became of a voxel of a row.
enum class RowState : std::uint8_t {
  sampled = 1,  ///< written
  left = 2      ///< for `sample_voxel`
};

/// Samples the voxels of a row that come from well inside the source: the bits of `sample_voxel` with linear
/// interpolation, by the widest vectors that the processor has (Highway).
///
/// @param row  of up to kMostInRow voxels  @param output  of the source's type  @param state  of each voxel, written
/// @return slices of the source that were sampled
SliceRange sample_linear_row(const LinearSource& source, const Row& row, void* output, RowState* state);

/// The same for a vote, where all voxels around have one label; where they have several, the voxel is left.
SliceRange sample_uniform_row(const LinearSource& source, const Row& row, void* output, RowState* state);

}  // namespace tetwarp::cpu
