// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/target_check.h"

#include <cmath>
#include <glm/common.hpp>

namespace tetwarp {

namespace {

constexpr int kWidestReach = 2;  // voxels from its place that cubic interpolation reads

std::string describe(const Region& region) {
  const auto corner = [](const glm::i64vec3& at) {
    return "(" + std::to_string(at.x) + ", " + std::to_string(at.y) + ", " + std::to_string(at.z) + ")";
  };
  return corner(region.begin) + " to " + corner(region.end);
}

template <class View>
void check_view(const View& view, const std::string& name) {
  require(view.geometry && view.voxels, [&] { return name + " is empty"; });
  require(view.components >= 1,
          [&] { return name + " has " + std::to_string(view.components) + " components, expected 1 or more"; });
  require(contains(whole(*view.geometry), view.buffered), [&] {
    return name + " buffers " + describe(view.buffered) + ", which is not part of its grid of " +
           to_string(view.geometry->size);
  });
}

void check_target(const Target& target, const Geometry& output, const Region& region, const Region& needed) {
  check_view(target.source, "the source");
  check_view(target.output, "the output");
  require_source_grid(*target.source.geometry, target.interpolation);
  require(*target.output.geometry == output, [&] {
    return "the output of " + to_string(target.output.geometry->size) + " voxels is not on the resampler's grid of " +
           to_string(output.size);
  });
  require(target.output.type == target.source.type, [&] {
    return "the output holds " + to_string(target.output.type) + ", the source " + to_string(target.source.type) +
           ": they must be the same";
  });
  require(target.output.components == target.source.components, [&] {
    return "the output has " + std::to_string(target.output.components) + " components, the source " +
           std::to_string(target.source.components) + ": they must be the same";
  });
  require(!target.padding || target.source.components == 1, [&] {
    return "padding is for one value a voxel, the source has " + std::to_string(target.source.components) +
           " components";
  });
  require(contains(target.output.buffered, region), [&] {
    return "the output buffers " + describe(target.output.buffered) + ", the region asked for is " + describe(region);
  });
  require(contains(target.source.buffered, needed),
          [&] { return "the source buffers " + describe(target.source.buffered) + ", needed is " + describe(needed); });
  require(target.sampled_slices.empty() || static_cast<std::int64_t>(target.sampled_slices.size()) == output.size.z,
          [&] {
            return "sampled_slices has " + std::to_string(target.sampled_slices.size()) +
                   " entries, expected one for each of " + std::to_string(output.size.z) + " slices";
          });
}

void check_map(const VolumeView& map, const std::string& name, VoxelType type, int components, const Geometry& output,
               const Region& region) {
  if (!map.voxels) return;
  require(map.geometry && *map.geometry == output,
          [&] { return "the " + name + " map is not on the resampler's grid"; });
  require(map.type == type && map.components == components, [&] {
    return "the " + name + " map holds " + std::to_string(map.components) + " x " + to_string(map.type) +
           ", expected " + std::to_string(components) + " x " + to_string(type);
  });
  require(contains(map.buffered, region), [&] { return "the " + name + " map does not buffer the region asked for"; });
}

/// Removes the rounding that two changes of frame leave, where two grids agree along an axis: voxels are then copied
/// exactly, and those beside them, padding above all, have no weight.
AffineMap without_rounding(AffineMap map) {
  constexpr double kRounding = 1e-12, kNearly = 1e-9;  // kRounding of a step, kNearly of a voxel
  for (int row = 0; row < 3; ++row) {
    bool whole = true;
    for (int column = 0; column < 3; ++column) {
      double& step = map.linear[column][row];
      whole = whole && std::abs(step - std::round(step)) <= kRounding;
      if (std::abs(step - std::round(step)) <= kRounding) step = std::round(step);
    }
    const double place = std::round(map.offset[row] * kStepsPerVoxel) / kStepsPerVoxel;
    if (whole && std::abs(map.offset[row] - place) <= kNearly) map.offset[row] = place;
  }
  return map;
}

}  // namespace

void check_targets(const Resampler& resampler, std::span<const Target> targets, const Region& region) {
  const Geometry& output = resampler.output();
  require(contains(whole(output), region),
          [&] { return "the region asked for is not part of the output grid of " + to_string(output.size); });
  for (const Target& target : targets) {
    const Geometry* grid = target.source.geometry;
    const bool all = !grid || target.source.buffered == whole(*grid);
    check_target(target, output, region, all ? Region{} : resampler.source_region(*grid, region));
  }
}

void check_maps(const Maps& maps, const Geometry& output, const Region& region) {
  check_map(maps.coverage, "coverage", VoxelType::u8, 1, output, region);
  check_map(maps.inverse_mm, "inverse", VoxelType::f32, 3, output, region);
  check_map(maps.jacobian, "jacobian", VoxelType::f32, 1, output, region);
  check_map(maps.owners, "owners", VoxelType::u16, 1, output, region);
  check_map(maps.tetrahedra, "tetrahedra", VoxelType::u32, 1, output, region);
}

void require_numbers(const Maps& maps, std::uint64_t tetrahedra) {
  require(!maps.tetrahedra.voxels || tetrahedra < kNoTetrahedron, [&] {
    return "the field has " + std::to_string(tetrahedra) + " tetrahedra; a map of their numbers holds fewer than " +
           std::to_string(kNoTetrahedron);
  });
}

void require_source_grid(const Geometry& source, Interpolation interpolation) {
  require_valid(source, "source grid");
  require(source.slices.empty() || interpolation != Interpolation::cubic,
          "cubic interpolation needs even slices, those of the source are not; choose linear");
}

void require_host(Memory memory, const std::string& name) {
  require(memory == Memory::host,
          [&] { return name + " is in device memory, which the CPU cannot read; use a resampler on that device"; });
}

SourceRelation relate(const Geometry& source, const Geometry& output, const double* slices) {
  const AffineMap map = without_rounding(index_from_point(source) * point_from_index(output));
  return {source == output, map, {slices, std::ssize(source.slices)}};
}

std::vector<double> uneven_slices(const Geometry& source) {
  std::vector<double> slices = source.slices;
  for (double& at : slices) at /= source.spacing.z;
  return slices;
}

Region source_box(const Geometry& source, const Geometry& output, const glm::dvec3& low, const glm::dvec3& high) {
  if (!(low.x <= high.x)) return {};
  const std::vector<double> slices = uneven_slices(source);
  const SourceRelation source_from_output = relate(source, output, slices.empty() ? nullptr : slices.data());
  glm::dvec3 least(INFINITY), most(-INFINITY);
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 at(corner & 1 ? high.x : low.x, corner >> 1 & 1 ? high.y : low.y, corner >> 2 ? high.z : low.z);
    const glm::dvec3 index = source_from_output(at);
    least = glm::min(least, index);
    most = glm::max(most, index);
  }
  const glm::dvec3 last(source.size);
  least = glm::clamp(glm::floor(least) - double{kWidestReach}, glm::dvec3(0), last);
  most = glm::clamp(glm::floor(most) + double{kWidestReach + 1}, glm::dvec3(0), last);
  return {glm::i64vec3(least), glm::i64vec3(most)};
}

}  // namespace tetwarp
