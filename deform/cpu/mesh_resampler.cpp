// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/cpu/mesh_resampler.h"

#include <algorithm>
#include <bit>
#include <glm/common.hpp>

#include "deform/cpu/intervals/interval_writer.h"
#include "deform/cpu/intervals/mesh_raster.h"
#include "deform/cpu/tiles.h"
#include "deform/target_check.h"

namespace tetwarp::cpu {

namespace {

/// What a task works with.
struct Scratch {
  IntervalWriter writer;
  IntervalTile at_rest;  ///< owners in the undeformed mesh
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
  for_each_tile<IntervalTile>(
      arena_, whole(output()), {.stop = control.stop}, {}, [&](const Region& box, IntervalTile& tile) {
        rest_raster_.find(box, false, tile, nullptr);
        const std::uint32_t all = ~0u >> (kTile - (box.end.x - box.begin.x));
        for (std::int64_t z = box.begin.z; z < box.end.z; ++z) {
          for (std::int64_t y = box.begin.y; y < box.end.y; ++y) {
            const std::uint32_t holes = all & ~tile.covered(y - box.begin.y, z - box.begin.z);
            if (holes == 0) continue;
            voxels += std::popcount(holes);
            const std::int64_t number =
                (z * output().size.y + y) * output().size.x + box.begin.x + std::countr_zero(holes);
            for (std::int64_t known = lowest; number < known && !lowest.compare_exchange_weak(known, number);) continue;
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
  require_numbers(maps, mesh_.tetrahedra.size());
  const TileTargets to{samplers, writer, PlaceForm(mesh_.coarse, mesh_.most_moved), mesh_.nudge};
  Report report = for_each_tile<Scratch>(arena_, region, control, finished, [&](const Region& box, Scratch& scratch) {
    Report of_tile;
    of_tile.paths.claimed = static_cast<std::uint64_t>(voxel_count(box));
    if (stays_outside_) rest_raster_.find(box, false, scratch.at_rest, nullptr);
    scratch.writer.prepare(to);
    raster_.find(box, writer.wants_owners(), scratch.writer.tile, &scratch.writer);
    scratch.writer.finish(
        [&](std::int64_t y, std::int64_t z) { return stays_outside_ ? ~scratch.at_rest.covered(y, z) : 0u; }, of_tile);
    return of_tile;
  });
  mesh_.describe(report);
  return report;
}

}  // namespace

std::unique_ptr<ForwardResampler> make_mesh_resampler(const Geometry& output, const Limits& limits) {
  return std::make_unique<MeshResampler>(output, limits);
}

}  // namespace tetwarp::cpu
