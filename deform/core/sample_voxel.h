#pragma once

#include "deform/core/sample.h"
#include "deform/geometry.h"
#include "deform/resampler.h"

namespace tetwarp {

/// How a source grid lies to the output grid.
struct SourceRelation {
  bool same_grid = false;        ///< source and output share their grid: places stay exact
  AffineMap source_from_output;  ///< where they do not
};

/// All that one output voxel needs to know of a target: plain data, the same for every backend.
template <class V>
struct SamplePlan {
  SourceVoxels<V> source;
  Padding<V> padding;
  V background;
  bool background_saturated;
  SourceRelation relation;
};

template <class V>
struct SampledVoxel {
  V value;
  bool inside, saturated, padded;
  std::int64_t first_slice, last_slice;  ///< of the source, with weight; where inside
};

/// The value of one output voxel (semantics section 4).
///
/// @param mapped  whether the field says where it comes from; @param offset  undeformed minus deformed place, voxels
template <class V, Interpolation kInterpolation>
TETWARP_HD SampledVoxel<V> sample_voxel(const SamplePlan<V>& plan, const glm::i64vec3& voxel, bool mapped,
                                        const glm::vec3& offset) {
  const SampledVoxel<V> nothing{plan.background, false, plan.background_saturated, false, 0, 0};
  if (!mapped) return nothing;
  Place place = plan.relation.same_grid
                    ? place_at(voxel, offset)
                    : place_at(plan.relation.source_from_output(glm::dvec3(voxel) + glm::dvec3(offset)));
  if (!clamp_to_grid(place, plan.source.size)) return nothing;
  if (place.fraction.x == 0 && place.fraction.y == 0 && place.fraction.z == 0) {  // a copy, to the bit
    const V value = plan.source.at(place.base.x, place.base.y, place.base.z);
    return {value, true, false, plan.padding.present && plan.padding.holds(value), place.base.z, place.base.z};
  }
  Sample<V> sample;
  std::int64_t first = place.base.z, last = place.base.z + (place.fraction.z != 0);
  if constexpr (kInterpolation == Interpolation::nearest) {
    sample = sample_nearest(plan.source, place, plan.padding);
    first = last = place.base.z + (place.fraction.z >= 0.5f);
  } else if constexpr (kInterpolation == Interpolation::linear) {
    sample = sample_linear(plan.source, place, plan.padding);
  } else {
    sample = sample_cubic(plan.source, place, plan.padding);
    if (place.fraction.z != 0) {
      first = clamp_index(first - 1, plan.source.size.z);
      last = clamp_index(last + 1, plan.source.size.z);
    }
  }
  bool saturated = false;
  const V value = to_voxel<V>(sample.value, &saturated);
  return {value, true, saturated, sample.padded, first, last};
}

}  // namespace tetwarp
