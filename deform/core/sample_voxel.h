// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/core/sample.h"
#include "deform/geometry.h"
#include "deform/resampler.h"

namespace tetwarp {

/// Where the slices of an uneven source lie, in units of their mean distance: from 0 to count - 1, rising.
struct UnevenSlices {
  const double* at = nullptr;  ///< null: even
  std::int64_t count = 0;

  /// Continuous slice index of a place along the stack, which is in units of the mean distance. It is linear between
  /// neighbouring slices; beyond the outermost slices it continues the outermost intervals.
  TETWARP_HD double index(double place) const {
    std::int64_t low = 0, high = count - 1;  // at[low] <= place < at[high], or beyond an end
    while (high - low > 1) {
      const std::int64_t middle = (low + high) / 2;
      if (place < at[middle])
        high = middle;
      else
        low = middle;
    }
    return static_cast<double>(low) + (place - at[low]) / (at[high] - at[low]);
  }
};

/// How a source grid lies relative to the output grid.
struct SourceRelation {
  bool same_grid = false;  ///< whether source and output have the same grid, so that places stay exact
  /// Output index to source index, where grids differ; for an uneven source as if its slices were even.
  AffineMap source_from_output;
  UnevenSlices slices;

  /// Continuous source index of a continuous output index.
  TETWARP_HD glm::dvec3 operator()(const glm::dvec3& place) const {
    glm::dvec3 index = source_from_output(place);
    if (slices.at) index.z = slices.index(index.z);
    return index;
  }
};

/// Everything that the sampling of one output voxel of a target needs: plain data, the same for every backend.
template <class V>
struct SamplePlan {
  SourceVoxels<V> source;
  Padding<V> padding;
  V background;
  bool background_saturated;
  SourceRelation relation;
};

/// A value, and whether it was saturated, or taken from one voxel because of padding.
template <class V>
struct VoxelValue {
  V value;
  bool saturated, padded;
};

/// The value of one output voxel, and how it came about.
template <class V>
struct SampledVoxel {
  V value;
  bool inside, saturated, padded;
  /// Slices of the source that had weight; set where `inside`.
  std::int64_t first_slice, last_slice;
};

/// How linear interpolation is rounded where offsets have a type: glm::vec3 in dense and pull fields, FixedOffset in
/// coarse ones.
template <class Offset>
constexpr Lerp kLerpOf = std::is_same_v<Offset, FixedOffset> ? Lerp::fused : Lerp::separate;

/// Computes where an output voxel comes from, on the grid of the source.
/// @return false if that is outside the source
template <class V, class Offset>
TETWARP_INLINE_HD bool source_place(const SamplePlan<V>& plan, const glm::i64vec3& voxel, const Offset& offset,
                                    Place& place) {
  place = plan.relation.same_grid ? place_at(voxel, offset)
                                  : place_at(plan.relation(glm::dvec3(voxel) + in_double(offset)));
  return clamp_to_grid(place, plan.source.size);
}

/// The value at a place on the grid of the source.
template <class V, Interpolation kInterpolation>
TETWARP_INLINE_HD VoxelValue<V> sample_place(const SourceVoxels<V>& source, const Place& place,
                                             const Padding<V>& padding, Lerp rounding) {
  if (place.fraction.x == 0 && place.fraction.y == 0 && place.fraction.z == 0) {  // a copy, to the bit
    const V value = source.at(place.base.x, place.base.y, place.base.z);
    return {value, false, padding.present && padding.holds(value)};
  }
  if constexpr (kInterpolation == Interpolation::vote) {
    const Label<V> label = sample_vote(source, place, padding);
    return {label.value, false, label.padded};
  } else {
    Sample<V> sample;
    if constexpr (kInterpolation == Interpolation::nearest) {
      sample = sample_nearest(source, place, padding);
    } else if constexpr (kInterpolation == Interpolation::linear) {
      sample = sample_linear(source, place, padding, rounding);
    } else {
      sample = sample_cubic(source, place, padding);
    }
    bool saturated = false;
    const V value = to_voxel<V>(sample.value, &saturated);
    return {value, saturated, sample.padded};
  }
}

/// First and last slice of the source with weight at a place on its grid.
template <Interpolation kInterpolation>
TETWARP_INLINE_HD void slices_at(const Place& place, std::int64_t slices, std::int64_t& first, std::int64_t& last) {
  first = place.base.z;
  last = first + (place.fraction.z != 0);
  if constexpr (kInterpolation == Interpolation::nearest) {
    first = last = first + (place.fraction.z >= 0.5f);
  } else if constexpr (kInterpolation == Interpolation::cubic) {
    if (place.fraction.z != 0) {
      first = clamp_index(first - 1, slices);
      last = clamp_index(last + 1, slices);
    }
  }
}

/// The value of one output voxel whose place is known.
/// @param inside  whether the place is one, inside the source
template <class V, Interpolation kInterpolation>
TETWARP_HD SampledVoxel<V> sample_at(const SamplePlan<V>& plan, bool inside, const Place& place, Lerp rounding) {
  if (!inside) return {plan.background, false, plan.background_saturated, false, 0, 0};
  const VoxelValue<V> found = sample_place<V, kInterpolation>(plan.source, place, plan.padding, rounding);
  SampledVoxel<V> sampled{found.value, true, found.saturated, found.padded, 0, 0};
  slices_at<kInterpolation>(place, plan.source.size.z, sampled.first_slice, sampled.last_slice);
  return sampled;
}

/// Computes the value of one output voxel (docs/design/definition.md, "What the voxel gets").
///
/// @param mapped  whether the field says where the voxel comes from
/// @param offset  undeformed minus deformed place, voxels: a glm::vec3, or a FixedOffset of a coarse field
template <class V, Interpolation kInterpolation, class Offset>
TETWARP_HD SampledVoxel<V> sample_voxel(const SamplePlan<V>& plan, const glm::i64vec3& voxel, bool mapped,
                                        const Offset& offset) {
  Place place;
  const bool inside = mapped && source_place(plan, voxel, offset, place);
  return sample_at<V, kInterpolation>(plan, inside, place, kLerpOf<Offset>);
}

/// Several values of one output voxel whose place is known, each interpolated alone.
///
/// @param plan    plan of the first value of each voxel, without padding
/// @param output  gets the values, side by side
/// @return the last value; saturated if any value was
template <class V, Interpolation kInterpolation>
TETWARP_HD SampledVoxel<V> sample_components_at(const SamplePlan<V>& plan, int components, bool inside,
                                                const Place& place, Lerp rounding, V* output) {
  SampledVoxel<V> sampled{plan.background, false, plan.background_saturated, false, 0, 0};
  if (!inside) {
    for (int n = 0; n < components; ++n) output[n] = plan.background;
    return sampled;
  }
  sampled.inside = true;
  sampled.saturated = false;
  slices_at<kInterpolation>(place, plan.source.size.z, sampled.first_slice, sampled.last_slice);
  SourceVoxels<V> source = plan.source;
  for (int n = 0; n < components; ++n, ++source.voxels) {
    const VoxelValue<V> found = sample_place<V, kInterpolation>(source, place, plan.padding, rounding);
    output[n] = sampled.value = found.value;
    sampled.saturated = sampled.saturated || found.saturated;
  }
  return sampled;
}

/// Computes several values of one output voxel, as `sample_voxel` and `sample_components_at` say.
template <class V, Interpolation kInterpolation, class Offset>
TETWARP_HD SampledVoxel<V> sample_components(const SamplePlan<V>& plan, int components, const glm::i64vec3& voxel,
                                             bool mapped, const Offset& offset, V* output) {
  Place place;
  const bool inside = mapped && source_place(plan, voxel, offset, place);
  return sample_components_at<V, kInterpolation>(plan, components, inside, place, kLerpOf<Offset>, output);
}

}  // namespace tetwarp
