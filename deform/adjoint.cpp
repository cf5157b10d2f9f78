// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/adjoint.h"

#include <string>

#include "deform/target_check.h"
#include "deform/text/enum_names.h"

namespace tetwarp {

namespace {

template <class View>
void check_view(const View& view, const std::string& name, const Geometry& grid, const ConstVolumeView& source) {
  require(view.geometry && *view.geometry == grid && view.buffered == whole(grid),
          [&] { return name + " does not hold the whole grid that it belongs to, of " + to_string(grid.size); });
  require(view.type == source.type && view.components == source.components, [&] {
    return name + " has " + std::to_string(view.components) + " values of " + to_string(view.type) +
           " a voxel, and its source " + std::to_string(source.components) + " of " + to_string(source.type);
  });
}

}  // namespace

std::int64_t vertex_count(const FieldView& field) {
  const std::int64_t of_mesh = field.mesh ? std::ssize(field.mesh->rest) : 0;
  return of_mesh + (field.displacement ? voxel_count(*field.lattice) : 0);
}

void check_adjoint(const Geometry& output, std::span<const AdjointTarget> targets,
                   const DisplacementGradient& displacement, std::size_t vertices) {
  const bool wants_displacement = !displacement.values.empty();
  require(!wants_displacement || displacement.values.size() == vertices, [&] {
    return "the gradient of the displacement has room for " + std::to_string(displacement.values.size()) +
           " vertices, and the field has " + std::to_string(vertices);
  });
  for (const AdjointTarget& target : targets) {
    const ConstVolumeView& source = target.source;
    require(source.geometry != nullptr, "a source has no geometry");
    require_source_grid(*source.geometry, target.interpolation);
    require(source.type == VoxelType::f32 || source.type == VoxelType::f64, [&] {
      return "there is no gradient of a volume of " + to_string(source.type) +
             ", whose values are rounded; convert it to float32";
    });
    require(source.type == targets.front().source.type, "the volumes of a call must have one type");
    require(source.components >= 1, "a source has no values");
    require(target.output_gradient.voxels != nullptr, "a target has no gradient of its output");
    check_view(target.output_gradient, "the gradient of an output", output, source);
    if (target.source_gradient.voxels)
      check_view(target.source_gradient, "the gradient of a source", *source.geometry, source);
    require(target.interpolation != Interpolation::vote,
            "there is no gradient of interpolation by vote, which chooses among labels");
    if (!wants_displacement) continue;
    require(target.interpolation == Interpolation::linear, [&] {
      return "there is no gradient of the displacement through " + std::string(name_of(target.interpolation)) +
             " interpolation; use linear";
    });
    require(source.voxels != nullptr && source.buffered == whole(*source.geometry),
            "the gradient of the displacement needs all voxels of the source");
  }
}

}  // namespace tetwarp
