// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

#include "deform/core/ray_sample.h"
#include "deform/render/projection.h"

namespace tetwarp {

/// An entry of the table of a transfer function: the colour of a value, and what one step through it adds to a sum.
struct alignas(16) TransferEntry {
  float red = 0, green = 0, blue = 0, opacity = 0;
};
/// Sums over all entries below one: the optical depth of a step, and that depth times each colour.
struct alignas(16) TransferIntegral {
  float red = 0, green = 0, blue = 0, depth = 0;
};
constexpr int kTransferEntries = 4096;

/// Values of which nothing is seen: those below `below`, and those between `from` and `to`. There may be more.
struct ClearValues {
  float below = 0, from = 0, to = 0;
};

/// Volumes are divided into blocks of 8 x 8 x 8 voxels, so that rays can leap over empty ones.
constexpr int kRayBlockBits = 3, kRayBlock = 1 << kRayBlockBits;
/// Least and largest value around a block: of its voxels, of one layer before and of two layers behind them. Each
/// sample in the block lies between the two, even with rounding errors in its place.
struct BlockRange {
  float least = 0, most = 0;
};
/// Largest number of blocks over which a ray leaps at once.
constexpr int kFarthestBlock = 15;

/// What the rays of a picture need to know besides the voxels. Positions are continuous indices of the volume.
struct RayFrame {
  Projection projection = Projection::composite;
  float lowest = 0, per_value = 0;                ///< value v is entry (v - lowest) * per_value of the table
  glm::vec3 first{0}, per_column{0}, per_row{0};  ///< where the ray of a pixel begins
  glm::vec3 step{0}, per_step{0};  ///< from a sample to the next, and the inverse of its components (0 for 0)
  /// By axis of patient space: the change a mm along it, from differences over two voxels along i, j, k.
  glm::mat3 to_gradient{1};
  glm::vec3 light{0}, halfway{0};  ///< unit vectors towards the light, and halfway to the viewer
  float ambient = 0, diffuse = 0, specular = 0;
  float per_gradient = 0;  ///< one over the change a mm from which a place is lit as a surface; 0: no light
  glm::vec3 background{0};
};

/// The tables that rays look up, where a backend keeps them.
struct RayTables {
  const BlockRange* ranges = nullptr;       ///< by block, i fastest
  const std::uint8_t* distances = nullptr;  ///< blocks to the nearest one that is not empty, the largest along an axis
  glm::ivec3 blocks{0};
  const TransferEntry* entries = nullptr;
  const TransferIntegral* integrals = nullptr;   ///< kTransferEntries + 1
  TransferIntegral lowest_entry, highest_entry;  ///< what holds for each entry beyond the table's ends
  ClearValues clear;
  const std::uint8_t* tints = nullptr;  ///< number of each voxel's colour, i fastest; 0: none; null: no voxel has one
  const TransferEntry* tint_colours = nullptr;  ///< 256: `opacity` of the colour is mixed to what is seen
};

template <class V>
struct RayScene : RayFrame, RayTables, ray::RayVolume<V> {};

/// The entry that a value would have if the table had no ends.
TETWARP_INLINE_HD int endless_entry(const RayFrame& frame, float value) {
  constexpr float kFar = 4e6f;
  const float entry = ray::fused(value - frame.lowest, frame.per_value, 0.5f);
  return static_cast<int>(std::floor(entry > -kFar ? (entry < kFar ? entry : kFar) : -kFar));
}

/// The entry of a value in the table.
TETWARP_INLINE_HD int transfer_entry(const RayFrame& frame, float value) {
  const float entry = ray::fused(value - frame.lowest, frame.per_value, 0.5f);
  return entry > 0 ? static_cast<int>(entry < kTransferEntries - 1 ? entry : kTransferEntries - 1) : 0;
}

namespace ray {

constexpr float kOpaque = 0.998f;  ///< opacity behind which nothing is looked for: 0.002 is half a grey level

/// A ray within the volume, from `enter` to `leave`, in steps from its origin. Its samples lie at both ends and at all
/// whole steps between: numbers `begin` up to, not including, `end`. Piece n lies before sample n.
struct Span {
  glm::vec3 origin;
  float enter, leave;
  int begin, end;
};

/// The part of a ray that lies in the volume, half a voxel around the outermost centres included.
template <class V>
TETWARP_INLINE_HD Span span_of(const RayScene<V>& scene, int column, int row) {
  Span span;
  span.origin = scene.first + scene.per_column * static_cast<float>(column) + scene.per_row * static_cast<float>(row);
  float enter = 0, leave = 1e6f;
  for (int axis = 0; axis < 3; ++axis) {
    const float low = -0.5f - span.origin[axis], high = static_cast<float>(scene.size[axis]) - 0.5f - span.origin[axis];
    if (scene.per_step[axis] == 0) {
      if (low > 0 || high < 0) leave = -1;
      continue;
    }
    const float a = low * scene.per_step[axis], b = high * scene.per_step[axis];
    enter = larger(enter, smaller(a, b));
    leave = smaller(leave, larger(a, b));
  }
  span.enter = enter;
  span.leave = leave;
  span.begin = static_cast<int>(std::ceil(enter));
  span.end = leave < enter ? span.begin : static_cast<int>(std::ceil(leave)) + 1;
  return span;
}

/// Steps from the origin to sample n.
TETWARP_INLINE_HD float steps_to(const Span& span, int n) {
  return clamped(static_cast<float>(n), span.enter, span.leave);
}

template <class V>
TETWARP_INLINE_HD glm::vec3 index_of(const RayScene<V>& scene, const Span& span, float steps) {
  glm::vec3 index;
  for (int axis = 0; axis < 3; ++axis) index[axis] = fused(scene.step[axis], steps, span.origin[axis]);
  return index;
}

template <class V>
TETWARP_INLINE_HD float sample(const RayScene<V>& scene, const RayPlace& place) {
  return value_at<V>(scene, place);
}

template <class V>
TETWARP_INLINE_HD TransferEntry look_up(const RayScene<V>& scene, float value) {
  return scene.entries[transfer_entry(scene, value)];
}

/// The block of a sample.
TETWARP_INLINE_HD glm::ivec3 block_of(const RayPlace& place) {
  return {place.whole.x >> kRayBlockBits, place.whole.y >> kRayBlockBits, place.whole.z >> kRayBlockBits};
}

/// The first sample behind a block and behind `around` more blocks on every side of it.
template <class V>
TETWARP_INLINE_HD int behind(const RayScene<V>& scene, const Span& span, int n, const glm::ivec3& block, int around) {
  float leave = static_cast<float>(span.end);
  for (int axis = 0; axis < 3; ++axis) {
    if (scene.per_step[axis] == 0) continue;
    const int side = scene.per_step[axis] > 0 ? block[axis] + around + 1 : block[axis] - around;
    leave = smaller(leave, (static_cast<float>(side * kRayBlock) - span.origin[axis]) * scene.per_step[axis]);
  }
  const int next = static_cast<int>(std::floor(leave)) + 1;
  return next > n ? next : n + 1;
}

/// 1 / sqrt(x) to 5e-6, of normal numbers above 0: two steps of Newton's method from a guess by halving the exponent.
/// Roots and quotients would be slower on the device.
TETWARP_INLINE_HD float inverse_root(float x) {
  const float half = 0.5f * x;
  float root = std::bit_cast<float>(0x5f375a86 - (std::bit_cast<int>(x) >> 1));
  for (int step = 0; step < 2; ++step) root *= fused(-half * root, root, 1.5f);
  return root;
}

/// What light does to a colour: it is multiplied by `factor`, and `added` is added to each channel.
struct Shade {
  float factor = 1, added = 0;
};

/// The light of Blinn and Phong on both sides of a surface. Where the value hardly changes there is no surface, and
/// the colour stays as it is.
template <class V>
TETWARP_INLINE_HD Shade shade_at(const RayScene<V>& scene, const glm::vec3& index) {
  const glm::vec3 differences = differences_at<V>(scene, place_among(scene.size, index));
  glm::vec3 slope;
  for (int axis = 0; axis < 3; ++axis) slope[axis] = dot(scene.to_gradient[axis], differences);
  const float square = dot(slope, slope);
  if (!(square > 0)) return {};
  const float inverse = inverse_root(square);
  const float towards = std::abs(dot(slope, scene.light)) * inverse;
  float shine = std::abs(dot(slope, scene.halfway)) * inverse;
  for (int doubled = 0; doubled < 5; ++doubled) shine *= shine;  // to the power of 32
  const float surface = smaller(square * inverse * scene.per_gradient, 1.0f);
  return {fused(surface, fused(scene.diffuse, towards, scene.ambient - 1), 1), surface * scene.specular * shine};
}

/// The sum of the integrals over all entries from `low` to `high`, both included; entries beyond the table's ends are
/// those at its ends.
TETWARP_INLINE_HD TransferIntegral sum_over(const RayTables& tables, int low, int high) {
  const TransferIntegral from = tables.integrals[clamped(low, 0, kTransferEntries)],
                         to = tables.integrals[clamped(high + 1, 0, kTransferEntries)];
  TransferIntegral sum{to.red - from.red, to.green - from.green, to.blue - from.blue, to.depth - from.depth};
  const auto add = [&](const TransferIntegral& entry, int count) {
    const auto times = static_cast<float>(count);
    sum.red = fused(entry.red, times, sum.red);
    sum.green = fused(entry.green, times, sum.green);
    sum.blue = fused(entry.blue, times, sum.blue);
    sum.depth = fused(entry.depth, times, sum.depth);
  };
  if (low < 0 && tables.lowest_entry.depth > 0) add(tables.lowest_entry, smaller(high + 1, 0) - low);
  if (high >= kTransferEntries) add(tables.highest_entry, high + 1 - larger(low, kTransferEntries));
  return sum;
}

/// exp(-depth) to 1e-4, by operations that round alike on every backend.
TETWARP_INLINE_HD float transmitted(float depth) {
  const float t = depth * 0.125f;
  const float e = fused(t, fused(t, fused(t, fused(t, 1.0f / 24, 1.0f / 6), 0.5f), 1), 1);
  const float squared = e * e, fourth = squared * squared;
  return 1 / (fourth * fourth);
}

/// A colour with the tint of the nearest voxel mixed into it.
template <class V>
TETWARP_INLINE_HD glm::vec3 tinted(const RayScene<V>& scene, const glm::vec3& colour, const glm::vec3& index) {
  std::int64_t voxel = 0;
  for (int axis = 2; axis >= 0; --axis)
    voxel = voxel * scene.size[axis] +
            static_cast<int>(clamped(index[axis], 0.0f, static_cast<float>(scene.size[axis] - 1)) + 0.5f);
  const std::uint8_t tint = scene.tints[voxel];
  if (tint == 0) return colour;
  const TransferEntry& added = scene.tint_colours[tint];
  return colour + (glm::vec3(added.red, added.green, added.blue) - colour) * added.opacity;
}

/// What is known of a sample.
enum class Known : std::uint8_t {
  nothing,  ///< it lies in an empty block, or before the ray
  seen,     ///< its value may be seen
  below,    ///< its value lies below those that are seen
  between   ///< its value lies in the gap between values that are seen
};

TETWARP_INLINE_HD Known kind_of(const ClearValues& clear, float value) {
  if (value < clear.below) return Known::below;
  return value > clear.from && value < clear.to ? Known::between : Known::seen;
}

/// Adds up the pieces of a ray. In a piece all values between those of its two samples count alike, so that thin layers
/// are not stepped over (pre-integration without attenuation within a piece, Engel 2001; as differences of integrals,
/// Lum 2004).
///
/// The first sample behind an empty block has no piece: it lies at most a voxel behind it, so that its value is among
/// those of that block (`BlockRange`), and nothing is seen between it and the sample before.
template <class V>
TETWARP_INLINE_HD glm::vec3 composite(const RayScene<V>& scene, const Span& span) {
  if (span.begin == span.end) return scene.background;
  glm::vec3 colour(0);
  float through = 1, before = 0;                 // `before` is the value of the sample before
  Known known = Known::nothing;                  // of it
  for (int n = span.begin - 1; n < span.end;) {  // from where the ray enters on
    const float to = steps_to(span, n);
    const RayPlace place = place_among(scene.size, index_of(scene, span, to));
    const glm::ivec3 block = block_of(place);
    if (const int empty = scene.distances[number_in(scene.blocks, block)]; empty > 0) {
      n = behind(scene, span, n, block, empty - 1);
      known = Known::nothing;
      continue;
    }
    ++n;
    const float value = sample(scene, place), last = before;
    const Known was = known;
    before = value;
    known = kind_of(scene.clear, value);
    if (was == Known::nothing || (was == known && was != Known::seen)) continue;  // no piece, or a clear one
    if (!is_number<V>(last) || !is_number<V>(value)) continue;
    const int low = endless_entry(scene, smaller(last, value)), high = endless_entry(scene, larger(last, value));
    const TransferIntegral sum = sum_over(scene, low, high);
    if (!(sum.depth > 0)) continue;
    const float from = steps_to(span, n - 2), count = static_cast<float>(high - low + 1),
                inverse = 1 / (sum.depth * count);
    const float left = through * transmitted(sum.depth * sum.depth * inverse * (to - from));
    glm::vec3 seen(sum.red, sum.green, sum.blue);
    float share = count * inverse;  // of the sum: its colour
    Shade shade;
    if (scene.tints || scene.per_gradient > 0) {
      const glm::vec3 middle = index_of(scene, span, 0.5f * (from + to));
      if (scene.tints) {
        seen = tinted(scene, seen * share, middle);
        share = 1;
      }
      if (scene.per_gradient > 0) shade = shade_at(scene, middle);
    }
    const float weight = through - left;
    const float times = weight * shade.factor * share, added = weight * shade.added;
    for (int channel = 0; channel < 3; ++channel)
      colour[channel] = fused(seen[channel], times, colour[channel] + added);
    through = left;
    if (through < 1 - kOpaque) break;
  }
  return colour + scene.background * through;
}

template <class V>
TETWARP_INLINE_HD glm::vec3 maximum(const RayScene<V>& scene, const Span& span) {
  float most = 0;
  bool found = false;
  for (int n = span.begin; n < span.end;) {
    const RayPlace place = place_among(scene.size, index_of(scene, span, steps_to(span, n)));
    const glm::ivec3 block = block_of(place);
    const std::int64_t number = number_in(scene.blocks, block);
    if (found && scene.ranges[number].most <= larger(most, scene.lowest)) {  // nothing that would be seen
      n = behind(scene, span, n, block, larger(scene.distances[number] - 1, 0));
      continue;
    }
    ++n;
    const float value = sample(scene, place);
    if (!is_number<V>(value) || (found && value <= most)) continue;
    most = value;
    found = true;
  }
  if (!found) return scene.background;
  const TransferEntry entry = look_up(scene, most);
  return {entry.red, entry.green, entry.blue};
}

template <class V>
TETWARP_INLINE_HD glm::vec3 integral(const RayScene<V>& scene, const Span& span) {
  float total = 0, from = steps_to(span, span.begin - 1);
  for (int n = span.begin; n < span.end;) {
    const float to = steps_to(span, n);
    const RayPlace place = place_among(scene.size, index_of(scene, span, 0.5f * (from + to)));  // of the piece's middle
    const glm::ivec3 block = block_of(place);
    if (const int empty = scene.distances[number_in(scene.blocks, block)]; empty > 0) {
      n = behind(scene, span, n, block, empty - 1);
      from = steps_to(span, n - 1);
      continue;
    }
    ++n;
    const float value = sample(scene, place);
    if (is_number<V>(value)) total = fused(look_up(scene, value).opacity, to - from, total);
    from = to;
  }
  return scene.background + (glm::vec3(1) - scene.background) * smaller(total, 1.0f);
}

TETWARP_INLINE_HD std::uint8_t to_byte(float share) {
  return static_cast<std::uint8_t>(255 * clamped(share, 0.0f, 1.0f) + 0.5f);
}

}  // namespace ray

/// Colour of one pixel.
struct RayColour {
  std::uint8_t red, green, blue;
};

/// Casts the ray of a pixel, with the same bits on every backend: which blocks are leapt over changes none.
template <class V>
TETWARP_INLINE_HD RayColour cast_ray(const RayScene<V>& scene, int column, int row) {
  const ray::Span span = ray::span_of(scene, column, row);
  glm::vec3 colour;
  switch (scene.projection) {
    case Projection::maximum: colour = ray::maximum(scene, span); break;
    case Projection::sum: colour = ray::integral(scene, span); break;
    default: colour = ray::composite(scene, span); break;
  }
  return {ray::to_byte(colour.x), ray::to_byte(colour.y), ray::to_byte(colour.z)};
}

}  // namespace tetwarp
