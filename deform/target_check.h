// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <limits>
#include <span>
#include <vector>

#include "deform/core/sample_voxel.h"
#include "deform/resampler.h"

namespace tetwarp {

/// Checks the views of a call against the resampler's grid, the region to resample, and each other.
/// @throws InputError naming the view, and what was expected and found
void check_targets(const Resampler& resampler, std::span<const Target> targets, const Region& region);
void check_maps(const Maps& maps, const Geometry& output, const Region& region);
/// @throws InputError for a source grid that is not valid, or whose slices an interpolation cannot use
void require_source_grid(const Geometry& source, Interpolation interpolation);
/// @param tetrahedra  how many the field has
/// @throws InputError where `Maps::tetrahedra` is wanted and 32 bits do not number them
void require_numbers(const Maps& maps, std::uint64_t tetrahedra);

/// Refuses device memory, for a backend that has none.
/// @throws InputError naming the view that is on a device
void require_host(Memory memory, const std::string& name);

/// The part of the source grid that any interpolation may read for places in a box of continuous output index, clipped.
Region source_box(const Geometry& source, const Geometry& output, const glm::dvec3& low, const glm::dvec3& high);

/// Where a voxel of the grid lies in what a view buffers, in voxels.
template <class View>
std::size_t buffer_index(const View& view, const glm::i64vec3& voxel) {
  const glm::i64vec3 at = voxel - view.buffered.begin, size = view.buffered.end - view.buffered.begin;
  return static_cast<std::size_t>((at.z * size.y + at.y) * size.x + at.x);
}

/// Padding as voxel values: what of the range the type can hold.
template <class V>
Padding<V> padding_of(const std::optional<PaddingRange>& range) {
  if (!range) return {false, V{}, V{}};
  if constexpr (std::is_floating_point_v<V>) return {true, static_cast<V>(range->low), static_cast<V>(range->high)};
  constexpr double kLowest = static_cast<double>(std::numeric_limits<V>::lowest());
  constexpr double kHighest = static_cast<double>(std::numeric_limits<V>::max());
  const double low = std::max(std::ceil(range->low), kLowest), high = std::min(std::floor(range->high), kHighest);
  if (!(low <= high)) return {false, V{}, V{}};
  return {true, static_cast<V>(low), static_cast<V>(high)};
}

/// @param slices  `uneven_slices(source)`, where the backend reads them; null for an even source
SourceRelation relate(const Geometry& source, const Geometry& output, const double* slices);

/// Places of the slices of an uneven source in units of their mean distance; empty for an even one.
std::vector<double> uneven_slices(const Geometry& source);

/// The plan of a checked target, for the first value of each voxel. `voxels` are the source's, wherever the backend
/// keeps them.
template <class V>
SamplePlan<V> plan_target(const Target& target, const SourceRelation& relation, const V* voxels) {
  const Region& held = target.source.buffered;
  const glm::i64vec3 size = held.end - held.begin;
  SamplePlan<V> plan;
  plan.source = {voxels, target.source.geometry->size, held.begin,
                 glm::i64vec3(1, size.x, size.x * size.y) * std::int64_t{target.source.components}};
  plan.padding = padding_of<V>(target.padding);
  plan.background_saturated = false;
  plan.background = to_voxel<V>(static_cast<Working<V>>(target.background), &plan.background_saturated);
  plan.relation = relation;
  return plan;
}

}  // namespace tetwarp
