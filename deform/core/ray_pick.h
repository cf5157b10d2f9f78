// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/core/ray_cast.h"

// Where along a ray the thing lies that a picture shows.
namespace tetwarp::ray {

/// Of a ray that shows less than this share of anything, nothing is picked.
constexpr float kLeastSeen = 0.01f;

/// How far light from behind comes through a ray.
struct Attenuation {
  float through = 1;  ///< share that comes through the whole ray
  float steps = -1;   ///< from the origin, to where only `limit` comes through; below 0 if that place is not reached
};

/// Follows a ray for Projection::composite, with the pieces of `composite`.
template <class V>
TETWARP_INLINE_HD Attenuation attenuation(const RayScene<V>& scene, const Span& span, float limit) {
  Attenuation result;
  float before = 0;
  bool is_known = false;  // the value before
  for (int n = span.begin - 1; n < span.end; ++n) {
    const float to = steps_to(span, n), last = before;
    const bool was_known = is_known;
    before = sample(scene, place_among(scene.size, index_of(scene, span, to)));
    is_known = is_number<V>(before);
    if (!was_known || !is_known) continue;
    const int low = endless_entry(scene, smaller(last, before)), high = endless_entry(scene, larger(last, before));
    const float depth = sum_over(scene, low, high).depth / static_cast<float>(high - low + 1);
    if (!(depth > 0)) continue;
    const float from = steps_to(span, n - 1), left = result.through * transmitted(depth * (to - from));
    if (left <= limit) {
      result.steps = from + (to - from) * (result.through - limit) / (result.through - left);
      return result;
    }
    result.through = left;
  }
  return result;
}

/// The place of the largest value.
template <class V>
TETWARP_INLINE_HD float steps_to_maximum(const RayScene<V>& scene, const Span& span) {
  float most = 0, steps = -1;
  for (int n = span.begin; n < span.end; ++n) {
    const float to = steps_to(span, n), value = sample(scene, place_among(scene.size, index_of(scene, span, to)));
    if (!is_number<V>(value) || (steps >= 0 && value <= most)) continue;
    most = value;
    steps = to;
  }
  return steps;
}

/// The place before which so much of the sum lies; below 0 if the sum is less. @param total  gets the whole sum
template <class V>
TETWARP_INLINE_HD float steps_to_sum(const RayScene<V>& scene, const Span& span, float limit, float& total) {
  total = 0;
  for (int n = span.begin; n < span.end; ++n) {
    const float from = steps_to(span, n - 1), to = steps_to(span, n);
    const float value = sample(scene, place_among(scene.size, index_of(scene, span, 0.5f * (from + to))));
    if (!is_number<V>(value)) continue;
    const float before = total;
    total = fused(look_up(scene, value).opacity, to - from, total);
    if (total > before && total >= limit) return from + (to - from) * (limit - before) / (total - before);
  }
  return -1;
}

/// Continuous index of the thing that a pixel shows: where half of what its ray shows lies in front (of a sum, half of
/// the sum), or the largest value.
/// @param index  is set where something is seen
/// @return whether something is seen
template <class V>
TETWARP_INLINE_HD bool pick(const RayScene<V>& scene, int column, int row, glm::vec3& index) {
  const Span span = span_of(scene, column, row);
  if (span.begin == span.end) return false;
  float steps = -1;
  if (scene.projection == Projection::maximum) {
    steps = steps_to_maximum(scene, span);
  } else if (scene.projection == Projection::sum) {
    float total = 0;
    steps_to_sum(scene, span, 3e38f, total);
    if (total > kLeastSeen) steps = steps_to_sum(scene, span, 0.5f * total, total);
  } else {
    const float through = attenuation(scene, span, -1.0f).through;
    if (1 - through > kLeastSeen) steps = attenuation(scene, span, 0.5f + 0.5f * through).steps;
  }
  if (!(steps >= 0)) return false;
  index = index_of(scene, span, steps);
  return true;
}

}  // namespace tetwarp::ray
