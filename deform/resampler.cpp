// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/resampler.h"

#include "deform/fields/lattice_mesh.h"
#include "deform/snapped_mesh.h"

namespace tetwarp {

namespace {

void require_one_each(const Geometry& grid, std::size_t vectors) {
  require(static_cast<std::size_t>(voxel_count(grid)) == vectors, [&] {
    return "a field on " + to_string(grid.size) + " vertices needs " + std::to_string(voxel_count(grid)) +
           " displacements, found " + std::to_string(vectors);
  });
}

}  // namespace

FieldView view(const VertexField& field, Outside outside) {
  require_one_each(field.mesh);
  if (!field.mesh.is_empty() && field.replaced.empty()) {
    return {.lattice = has_lattice_vertices(field) ? &field.lattice : nullptr, .outside = outside, .mesh = &field.mesh};
  }
  require_one_each(field.lattice, field.displacement.size());
  if (field.replaced.empty()) return {&field.lattice, field.displacement.data(), outside, Memory::host};
  return {.lattice = &field.lattice,
          .displacement = field.displacement.data(),
          .outside = outside,
          .mesh = &field.mesh,
          .replaced = field.replaced};
}

VolumeView samples_of(PullField& field) {
  require_one_each(field.grid, field.displacement.size());
  return {
      &field.grid, whole(field.grid), VoxelType::f32, 3, std::as_writable_bytes(std::span(field.displacement)).data(),
      Memory::host};
}

PullFieldView view(const PullField& field, Outside outside) {
  require_one_each(field.grid, field.displacement.size());
  return {&field.grid, field.displacement.data(), outside, Memory::host};
}

Resampler::Resampler(Geometry output) : output_(output) {
  require_valid(output_, "output grid");
  require(output_.slices.empty(), "the output grid has uneven slices; only a source may");
  for (int axis = 0; axis < 3; ++axis) {
    require(output_.size[axis] >= 2, [&] {
      return "output grid of " + to_string(output_.size) + " voxels: deforming needs at least 2 on every axis";
    });
    require(output_.size[axis] <= std::int64_t{1} << 18,
            [&] { return "output grid of " + to_string(output_.size) + " voxels: at most 262144 on an axis"; });
  }
}

Report& Report::operator+=(const Report& other) {
  covered += other.covered;
  uncovered += other.uncovered;
  clamped += other.clamped;
  padded += other.padded;
  conflicts += other.conflicts;
  inverted = std::max(inverted, other.inverted);
  degenerate = std::max(degenerate, other.degenerate);
  if (other.multiply_owned) multiply_owned = multiply_owned.value_or(0) + *other.multiply_owned;
  jacobian_min = std::min(jacobian_min, other.jacobian_min);
  jacobian_max = std::max(jacobian_max, other.jacobian_max);
  paths.gathered += other.paths.gathered;
  paths.walked += other.paths.walked;
  paths.claimed += other.paths.claimed;
  return *this;
}

}  // namespace tetwarp
