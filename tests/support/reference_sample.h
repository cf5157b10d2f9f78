// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "deform/resampler.h"

namespace tetwarp::test {

/// The value of a source at a place by the formulas in double: sums of weight times voxel, not nested interpolations.
struct ReferenceSample {
  bool inside = false;  ///< the place is within half a voxel of the outermost centres
  bool padded = false;
  double value = 0;  ///< the value before it is rounded to the voxel type
  double jump = 1;   ///< distance in voxels to the nearest place where the sample is not continuous
};

/// Weights of the voxels first, first + 1, ... on one axis.
struct ReferenceTaps {
  std::int64_t first;
  int count;
  double weight[4];
};

inline ReferenceTaps reference_taps(double x, Interpolation interpolation) {
  const double base = std::floor(x), t = x - base;
  const auto low = static_cast<std::int64_t>(base);
  switch (interpolation) {
    case Interpolation::nearest: return {static_cast<std::int64_t>(std::floor(x + 0.5)), 1, {1}};
    case Interpolation::linear:
    case Interpolation::vote: return {low, 2, {1 - t, t}};
    case Interpolation::cubic: break;
  }
  const auto catmull_rom = [](double s) {  // the kernel of Keys 1981 with a = -1/2, at distance s
    if (s < 1) return 1.5 * s * s * s - 2.5 * s * s + 1;
    return s < 2 ? -0.5 * s * s * s + 2.5 * s * s - 4 * s + 2 : 0.0;
  };
  return {low - 1, 4, {catmull_rom(1 + t), catmull_rom(t), catmull_rom(1 - t), catmull_rom(2 - t)}};
}

/// The label with the largest sum of weights (of several the smallest label), and by how much it leads.
struct ReferenceVote {
  double label, margin;
};

inline ReferenceVote reference_vote(const std::map<double, double>& weight_of_label) {
  ReferenceVote vote{};
  double most = -1, second = -1;
  for (const auto& [label, weight] : weight_of_label) {  // by rising label
    second = std::max(second, std::min(weight, most));
    if (weight <= most) continue;
    most = weight;
    vote.label = label;
  }
  vote.margin = most - std::max(second, 0.0);
  return vote;
}

template <class V>
ReferenceSample reference_sample(const Volume<V>& source, glm::dvec3 x, Interpolation interpolation,
                                 const std::optional<PaddingRange>& padding = {}) {
  ReferenceSample sample;
  const glm::i64vec3& size = source.geometry.size;
  for (int axis = 0; axis < 3; ++axis) {
    const auto last = static_cast<double>(size[axis] - 1);
    sample.jump = std::min({sample.jump, std::abs(x[axis] + 0.5), std::abs(x[axis] - last - 0.5)});
    if (!(x[axis] >= -0.5 && x[axis] <= last + 0.5)) return sample;
    x[axis] = std::clamp(x[axis], 0.0, last);
    if (interpolation == Interpolation::nearest) {
      sample.jump = std::min(sample.jump, std::abs(x[axis] + 0.5 - std::nearbyint(x[axis] + 0.5)));
    }
  }
  sample.inside = true;
  const ReferenceTaps taps[3] = {reference_taps(x.x, interpolation), reference_taps(x.y, interpolation),
                                 reference_taps(x.z, interpolation)};
  double heaviest = -1, heaviest_value = 0;
  std::map<double, double> weight_of_label;
  for (int k = 0; k < taps[2].count; ++k) {
    for (int j = 0; j < taps[1].count; ++j) {
      for (int i = 0; i < taps[0].count; ++i) {
        const double weight = taps[0].weight[i] * taps[1].weight[j] * taps[2].weight[k];
        if (weight == 0) continue;
        const glm::i64vec3 at =
            glm::min(glm::max(glm::i64vec3(taps[0].first + i, taps[1].first + j, taps[2].first + k), glm::i64vec3(0)),
                     size - std::int64_t{1});
        const auto value =
            static_cast<double>(source.voxels[static_cast<std::size_t>(at.x + size.x * (at.y + size.y * at.z))]);
        sample.value += weight * value;
        if (interpolation == Interpolation::vote) weight_of_label[value] += weight;
        if (padding && value >= padding->low && value <= padding->high) sample.padded = true;
        if (weight > heaviest) {
          heaviest = weight;
          heaviest_value = value;
        }
      }
    }
  }
  if (interpolation == Interpolation::vote) {
    const ReferenceVote vote = reference_vote(weight_of_label);
    sample.value = vote.label;
    sample.jump = std::min(sample.jump, vote.margin / 6);  // along each axis the lead falls by at most 2 for each voxel
  }
  if (sample.padded) sample.value = heaviest_value;
  return sample;
}

}  // namespace tetwarp::test
