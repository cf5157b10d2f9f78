#pragma once

#include "deform/core/lattice_vertex.h"
#include "deform/vertex_field.h"

namespace tetwarp {

/// A pull field over an output grid: x0 = p + d(p), d trilinear between samples.
///
/// Samples are snapped to 2^-12 voxel of output index like the vertices of a forward field, so that whole shifts copy
/// exactly whatever the spacing.
struct PullFrame {
  AffineMap grid_from_output;
  glm::dmat3 output_from_mm{1};
  glm::i64vec3 size{0};
  const glm::vec3* displacement = nullptr;  ///< LPS mm, i fastest, in the memory of who asks
  bool rest_outside = false;                ///< voxels outside the grid stay where they are

  TETWARP_HD glm::dvec3 in_voxels(const glm::vec3& mm) const { return output_from_mm * glm::dvec3(mm); }

  /// A sample in voxels of output index.
  TETWARP_HD glm::dvec3 sample(const glm::i64vec3& at) const {
    const glm::i32vec3 steps = snap(in_voxels(displacement[(at.z * size.y + at.y) * size.x + at.x]));
    return glm::dvec3(steps) * (1.0 / kStepsPerVoxel);
  }

  /// Takes an index up to 2^-12 sample outside the grid onto it. @return false if it is further out
  TETWARP_HD bool clamp_to_samples(glm::dvec3& index) const {
    constexpr double kSlack = 1.0 / kStepsPerVoxel;
    for (int axis = 0; axis < 3; ++axis) {
      const auto last = static_cast<double>(size[axis] - 1);
      if (!(index[axis] >= -kSlack && index[axis] <= last + kSlack)) return false;
      index[axis] = index[axis] < 0 ? 0 : (index[axis] > last ? last : index[axis]);
    }
    return true;
  }

  /// Undeformed minus deformed place, voxels. @return whether the voxel comes from anywhere
  TETWARP_HD bool offset_at(const glm::i64vec3& voxel, glm::vec3& offset) const {
    glm::dvec3 index = grid_from_output(glm::dvec3(voxel));
    offset = glm::vec3(0);
    if (!clamp_to_samples(index)) return rest_outside;
    const glm::i64vec3 low(index);  // index >= 0
    const glm::dvec3 t = index - glm::dvec3(low);
    glm::i64vec3 high;
    for (int axis = 0; axis < 3; ++axis) high[axis] = low[axis] + 1 < size[axis] ? low[axis] + 1 : size[axis] - 1;
    glm::dvec3 along_z[2];
    for (int z = 0; z < 2; ++z) {
      glm::dvec3 along_y[2];
      for (int y = 0; y < 2; ++y) {
        const glm::i64vec3 a(low.x, y ? high.y : low.y, z ? high.z : low.z), b(high.x, a.y, a.z);
        const glm::dvec3 first = sample(a);
        along_y[y] = first + t.x * (sample(b) - first);
      }
      along_z[z] = along_y[0] + t.y * (along_y[1] - along_y[0]);
    }
    offset = glm::vec3(along_z[0] + t.z * (along_z[1] - along_z[0]));
    return true;
  }
};

}  // namespace tetwarp
