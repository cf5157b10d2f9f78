// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cmath>

#include "deform/core/lattice_vertex.h"
#include "deform/vertex_field.h"

namespace tetwarp {

/// A pull field over an output grid: x0 = p + d(p), where d is trilinear between samples.
///
/// A sample with a NaN is missing: neither its place nor a voxel that would be interpolated from it has a source. A
/// voxel within 2^-12 of the way from one sample to the next, on some axis, does without the next one if that is
/// missing, so that rounding of a grid that was meant to be the output grid takes no voxel away.
///
/// Samples are snapped to 2^-12 voxel of output index like the vertices of a forward field, so whole shifts copy
/// exactly whatever the spacing.
struct PullFrame {
  /// In units of a sample: a place this near to a sample counts as on it.
  static constexpr double kSlack = 1.0 / kStepsPerVoxel;

  /// In units of a sample: a place may lie this far beyond the outermost samples and counts as on them. Headers are
  /// rounded, and a grid that ends there was meant to end at the voxel, as is a lattice (make_lattice_frame).
  static constexpr double kBorderRounding = 1.0 / 256;

  AffineMap grid_from_output;
  glm::dmat3 output_from_mm{1};
  glm::i64vec3 size{0};
  const glm::vec3* displacement = nullptr;  ///< LPS mm, i fastest, in the memory of the backend
  bool rest_outside = false;                ///< voxels outside the grid stay where they are

  TETWARP_HD glm::dvec3 in_voxels(const glm::vec3& mm) const { return output_from_mm * glm::dvec3(mm); }

  TETWARP_HD const glm::vec3& vector(const glm::i64vec3& at) const {
    return displacement[(at.z * size.y + at.y) * size.x + at.x];
  }

  /// Whether a sample, or a vector interpolated from samples, says that its place has no source.
  /// @param v  has no infinite component
  template <class Vector>
  TETWARP_HD static bool is_missing(const Vector& v) {
    return v.x != v.x || v.y != v.y || v.z != v.z;
  }

  /// Whether a sample is missing, or finite and not too long.
  TETWARP_HD bool is_usable(const glm::vec3& mm) const {
    if (!is_missing(mm)) return is_within(in_voxels(mm), kLargestIndex);
    return !std::isinf(mm.x) && !std::isinf(mm.y) && !std::isinf(mm.z);
  }

  /// A sample in voxels of output index, with a NaN where it is missing. It is rounded as by `snap`, whose integers
  /// have no NaN and no -0.
  TETWARP_HD glm::dvec3 sample(const glm::i64vec3& at) const {
    const glm::dvec3 steps = in_voxels(vector(at)) * double{kStepsPerVoxel};
    return glm::dvec3(std::rint(steps.x) + 0, std::rint(steps.y) + 0, std::rint(steps.z) + 0) * (1.0 / kStepsPerVoxel);
  }

  /// The value at share t of the way from a to b.
  /// @tparam kGaps  whether a missing end may be ignored within kSlack of the other end
  template <bool kGaps>
  TETWARP_HD static glm::dvec3 between(const glm::dvec3& a, const glm::dvec3& b, double t) {
    const glm::dvec3 mixed = a + t * (b - a);
    if (!kGaps || !is_missing(mixed) || (t > kSlack && t < 1 - kSlack)) return mixed;
    return t <= kSlack ? a : b;
  }

  /// Interpolates trilinearly.
  /// @tparam kGaps      whether samples may be missing (NaN), as in `between`
  /// @param index      continuous index on the samples
  /// @param sample_at  `sample_at(at)` gives what `sample(at)` gives
  /// @return a missing vector where a sample that is needed is missing
  template <bool kGaps, class SampleAt>
  TETWARP_HD glm::dvec3 trilinear(const glm::dvec3& index, const SampleAt& sample_at) const {
    const glm::i64vec3 low(index);  // index >= 0
    const glm::dvec3 t = index - glm::dvec3(low);
    glm::i64vec3 high;
    for (int axis = 0; axis < 3; ++axis) high[axis] = low[axis] + 1 < size[axis] ? low[axis] + 1 : size[axis] - 1;
    glm::dvec3 along_z[2];
    for (int z = 0; z < 2; ++z) {
      glm::dvec3 along_y[2];
      for (int y = 0; y < 2; ++y) {
        const glm::i64vec3 a(low.x, y ? high.y : low.y, z ? high.z : low.z), b(high.x, a.y, a.z);
        along_y[y] = between<kGaps>(sample_at(a), sample_at(b), t.x);
      }
      along_z[z] = between<kGaps>(along_y[0], along_y[1], t.y);
    }
    return between<kGaps>(along_z[0], along_z[1], t.z);
  }

  /// Moves an index that lies up to 1/256 sample outside the grid onto it.
  /// @return false if it lies further out
  TETWARP_HD bool clamp_to_samples(glm::dvec3& index) const {
    for (int axis = 0; axis < 3; ++axis) {
      const auto last = static_cast<double>(size[axis] - 1);
      if (!(index[axis] >= -kBorderRounding && index[axis] <= last + kBorderRounding)) return false;
      index[axis] = index[axis] < 0 ? 0 : (index[axis] > last ? last : index[axis]);
    }
    return true;
  }

  /// Computes the undeformed minus deformed place of a voxel, in voxels.
  /// @return whether the voxel has a source
  TETWARP_HD bool offset_at(const glm::i64vec3& voxel, glm::vec3& offset) const {
    return offset_at(voxel, offset, [this](const glm::i64vec3& at) { return sample(at); });
  }

  /// Computes the undeformed minus deformed place of a voxel, in voxels, from samples that `sample_at` gives.
  /// @return whether the voxel has a source
  template <class SampleAt>
  TETWARP_HD bool offset_at(const glm::i64vec3& voxel, glm::vec3& offset, const SampleAt& sample_at) const {
    glm::dvec3 index = grid_from_output(glm::dvec3(voxel));
    offset = glm::vec3(0);
    if (!clamp_to_samples(index)) return rest_outside;
    const glm::i64vec3 low(index);
    glm::dvec3 found(0);
    if (glm::dvec3(low) == index) {
      found = sample_at(low);  // what both of these give there, without the seven others
    } else {
      found = trilinear<false>(index, sample_at);
      if (is_missing(found)) found = trilinear<true>(index, sample_at);
    }
    if (is_missing(found)) return false;
    offset = glm::vec3(found);
    return true;
  }
};

}  // namespace tetwarp
