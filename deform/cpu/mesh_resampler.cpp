// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/cpu/mesh_resampler.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>

#include "deform/cpu/map_writer.h"
#include "deform/cpu/mesh_raster.h"
#include "deform/cpu/sampler.h"
#include "deform/cpu/tiles.h"
#include "deform/target_check.h"

namespace tetwarp::cpu {

namespace {

/// What is known of each voxel of a tile.
struct TileVoxels {
  MeshOwners owners, at_rest;
  std::uint8_t mapped[kTile], coverage[kTile];
  glm::vec3 offset[kTile];
  float jacobian[kTile];
};

/// Deforms volumes tile by tile: rasterises the tetrahedra, then samples the rows.
class MeshResampler final : public ForwardResampler {
 public:
  MeshResampler(const Geometry& output, const Limits& limits) : ForwardResampler(output), arena_(limits) {}

  void set_field(const FieldView& field, const FieldOptions& options, const Control& control) override;
  Region source_region(const Geometry& source, Region region) const override;
  Report resample(Region region, std::span<const Target> targets, const Maps& maps, const Control& control,
                  const PartSink& finished) override;

 private:
  void require_reach(const Control& control);
  void map_row(const Row& row, std::size_t first, const MapWriter& maps, TileVoxels& tile, Report& report) const;

  Arena arena_;
  /// The deformed mesh; and the undeformed one, where it matters which voxels lie outside.
  SnappedMesh mesh_, rest_;
  MeshRaster raster_, rest_raster_;
  bool ready_ = false, stays_outside_ = false;
};

void MeshResampler::set_field(const FieldView& field, const FieldOptions&, const Control& control) {
  ready_ = false;
  arena_.execute([&] { mesh_ = snap_mesh(output(), field, control); });
  raster_.build(mesh_, output(), control);
  stays_outside_ = field.outside == Outside::rest;
  if (field.outside != Outside::background) {
    rest_ = undeformed(mesh_);
    rest_raster_.build(rest_, output(), control);
  }
  if (field.outside == Outside::refuse) require_reach(control);
  ready_ = true;
}

/// Refuses an undeformed mesh that does not reach over the whole output. @throws InputError
void MeshResampler::require_reach(const Control& control) {
  std::atomic<std::int64_t> voxels = 0, lowest = INT64_MAX;
  for_each_tile<MeshOwners>(
      arena_, whole(output()), {.stop = control.stop}, {}, [&](const Region& box, MeshOwners& owners) {
        rest_raster_.find(box, false, owners);
        std::size_t n = 0;
        for (std::int64_t z = box.begin.z; z < box.end.z; ++z) {
          for (std::int64_t y = box.begin.y; y < box.end.y; ++y) {
            for (std::int64_t x = box.begin.x; x < box.end.x; ++x, ++n) {
              if (owners.owner[n] != MeshOwners::kNobody) continue;
              ++voxels;
              const std::int64_t number = (z * output().size.y + y) * output().size.x + x;
              for (std::int64_t known = lowest; number < known && !lowest.compare_exchange_weak(known, number);)
                continue;
            }
          }
        }
        return Report{};
      });
  if (voxels != 0) refuse_mesh_reach(output(), voxels, lowest);
}

Region MeshResampler::source_region(const Geometry& source, Region region) const {
  require(ready_, "source_region needs a field: call set_field first");
  region = intersection(region, whole(output()));
  return mesh_source_region(mesh_, stays_outside_, output(), source, region);
}

Report MeshResampler::resample(Region region, std::span<const Target> targets, const Maps& maps, const Control& control,
                               const PartSink& finished) {
  require(ready_, "resample needs a field: call set_field first");
  const TargetSamplers samplers = make_samplers(*this, targets, region);
  const MapWriter writer(maps, output(), region);
  Report report =
      for_each_tile<TileVoxels>(arena_, region, control, finished, [&](const Region& box, TileVoxels& tile) {
        Report of_tile;
        of_tile.paths.claimed = static_cast<std::uint64_t>(voxel_count(box));
        raster_.find(box, writer.wants_owners(), tile.owners);
        if (stays_outside_) rest_raster_.find(box, false, tile.at_rest);
        if (writer.wants_owners()) of_tile.multiply_owned = count_of_several(tile.owners.count);
        const auto width = static_cast<int>(box.end.x - box.begin.x);
        std::size_t first = 0;
        for (std::int64_t z = box.begin.z; z < box.end.z; ++z) {
          for (std::int64_t y = box.begin.y; y < box.end.y; ++y, first += static_cast<std::size_t>(width)) {
            const Row row{{box.begin.x, y, z}, width, tile.mapped, tile.offset};
            map_row(row, first, writer, tile, of_tile);
            sample_targets(row, samplers, tile.coverage, of_tile);
            writer.write(row, tile.coverage, writer.wants_jacobian() ? tile.jacobian : nullptr,
                         writer.wants_owners() ? tile.owners.count.data() + first : nullptr);
          }
        }
        return of_tile;
      });
  mesh_.describe(report);
  return report;
}

/// Decides for a row where each voxel comes from. @param first  number of the row's first voxel in the tile
void MeshResampler::map_row(const Row& row, std::size_t first, const MapWriter& maps, TileVoxels& tile,
                            Report& report) const {
  const std::uint32_t* owner = tile.owners.owner.data() + first;
  for (int i = 0; i < row.count;) {
    int end = i + 1;
    while (end < row.count && owner[end] == owner[i]) ++end;
    const bool owned = owner[i] != MeshOwners::kNobody;
    std::fill(tile.mapped + i, tile.mapped + end, static_cast<std::uint8_t>(owned));
    std::fill(tile.offset + i, tile.offset + end, glm::vec3(0));
    if (maps.wants_jacobian()) std::fill(tile.jacobian + i, tile.jacobian + end, NAN);
    if (owned) {
      const Tetrahedron t = mesh_.tetrahedron(owner[i]);
      const TetrahedronMap map(t);
      for (int n = i; n < end; ++n) {
        const glm::i64vec3 voxel = row.voxel + glm::i64vec3(n, 0, 0);
        const glm::i32vec3 steps = detail::to_steps(voxel);
        tile.offset[n] = map.u(steps, [&] { return interpolate_u_exactly(t, steps, mesh_.nudge.signs(voxel)); });
      }
      if (maps.wants_jacobian()) std::fill(tile.jacobian + i, tile.jacobian + end, forward_jacobian(t));
    }
    i = end;
  }
  if (!stays_outside_) return;
  for (int i = 0; i < row.count; ++i) {
    if (tile.at_rest.owner[first + static_cast<std::size_t>(i)] != MeshOwners::kNobody) continue;
    report.conflicts += tile.mapped[i];
    if (tile.mapped[i]) continue;
    tile.mapped[i] = 1;
    tile.jacobian[i] = 1.0f;
  }
}

}  // namespace

std::unique_ptr<ForwardResampler> make_mesh_resampler(const Geometry& output, const Limits& limits) {
  return std::make_unique<MeshResampler>(output, limits);
}

}  // namespace tetwarp::cpu
