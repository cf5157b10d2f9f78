#include <algorithm>
#include <cmath>
#include <vector>

#include "deform/cpu/lattice_index.h"
#include "deform/cpu/map_writer.h"
#include "deform/cpu/sampler.h"
#include "deform/cpu/tiles.h"
#include "deform/target_check.h"

namespace tetwarp {

namespace cpu {

namespace {

constexpr std::uint64_t kNobody = UINT64_MAX;

/// What is known of each voxel of a tile: the lowest tetrahedron that owns it, and what that one says.
struct Tile {
  LatticeIndex::Block block;
  std::vector<std::uint64_t> owner;
  std::vector<glm::vec3> offset;
  std::vector<float> jacobian;
  std::vector<std::uint16_t> owners;
  std::uint8_t mapped[kTile], coverage[kTile];

  void reset(std::size_t voxels, const MapWriter& maps) {
    owner.assign(voxels, kNobody);
    offset.resize(voxels);
    if (maps.wants_jacobian()) jacobian.resize(voxels);
    if (maps.wants_owners()) owners.assign(voxels, 0);
  }
};

/// Scatter into a tile, then gather: every cell that may reach the tile claims its voxels (the lowest number wins,
/// whatever the order), with the offset to the undeformed place; then rows are sampled.
class ForwardResampler final : public Resampler {
 public:
  ForwardResampler(Geometry output, const Limits& limits) : Resampler(output), arena_(make_arena(limits)) {}

  void set_field(const FieldView& field, const Control& control) override {
    ready_ = false;
    require_host(field.memory, "the field");
    arena_.execute([&] { lattice_.build(output(), field, control); });
    wants_range_ = control.jacobian_range;
    ready_ = true;
  }

  Region source_region(const Geometry& source, Region region) const override {
    require(ready_, "source_region needs a field: call set_field first");
    region = intersection(region, whole(output()));
    glm::dvec3 low(INFINITY), high(-INFINITY);
    lattice_.find_blocks(region, [&](std::size_t block) { lattice_.rest_box(block, &low, &high); });
    if (lattice_.field().outside == Outside::rest && !tetwarp::is_empty(region)) {
      low = glm::min(low, glm::dvec3(region.begin));
      high = glm::max(high, glm::dvec3(region.end - std::int64_t{1}));
    }
    return source_box(source, output(), low, high);
  }

  Report resample(Region region, std::span<const Target> targets, const Maps& maps, const Control& control) override {
    require(ready_, "resample needs a field: call set_field first");
    const std::vector<TargetSampler> samplers = make_samplers(*this, targets, region);
    const MapWriter writer(maps, output(), region);
    const bool may_copy = !writer.wants_jacobian() && !writer.wants_owners();
    Report report = for_each_tile<Tile>(arena_, region, control, [&](const Region& box, Tile& tile) {
      if (may_copy && rests(box)) return copy(box, tile, samplers, writer);
      claim(box, tile, writer);
      return gather(box, tile, samplers, writer);
    });
    report.paths.claimed = static_cast<std::uint64_t>(voxel_count(region)) - report.paths.gathered;
    const FieldStatistics& statistics = lattice_.statistics();
    report.inverted = statistics.inverted;
    report.degenerate = statistics.degenerate;
    if (!wants_range_) return report;
    report.jacobian_min = statistics.jacobian_min;
    report.jacobian_max = statistics.jacobian_max;
    return report;
  }

 private:
  /// Whether a tile lies within the undeformed lattice, and all that may reach it rests: then each voxel is owned by a
  /// cell at rest, and by no other.
  bool rests(const Region& box) const {
    const StepLattice& steps = lattice_.steps();
    if (steps.cells.x == 0) return false;
    for (int axis = 0; axis < 3; ++axis) {  // exact, in 2^-12 voxel
      const float from = static_cast<float>(box.begin[axis] * kStepsPerVoxel) - steps.first[axis],
                  to = static_cast<float>((box.end[axis] - 1) * kStepsPerVoxel) - steps.first[axis];
      if (from < 0 || to > static_cast<float>(steps.cells[axis]) * steps.cell[axis]) return false;
    }
    bool all = true;
    lattice_.find_blocks(box, [&](std::size_t block) { all = all && lattice_.rests(block); });
    return all;
  }

  Report copy(const Region& box, Tile& tile, const std::vector<TargetSampler>& samplers, const MapWriter& maps) const {
    Report report;
    report.paths.gathered = static_cast<std::uint64_t>(voxel_count(box));
    const auto width = static_cast<int>(box.end.x - box.begin.x);
    const glm::vec3 offset[kTile] = {};
    std::fill_n(tile.mapped, width, std::uint8_t{1});
    for (std::int64_t z = box.begin.z; z < box.end.z; ++z) {
      for (std::int64_t y = box.begin.y; y < box.end.y; ++y) {
        const Row row{{box.begin.x, y, z}, width, tile.mapped, offset, true};
        sample_targets(row, samplers, tile.coverage, report);
        maps.write(row, tile.coverage, nullptr, nullptr);
      }
    }
    return report;
  }

  void claim(const Region& box, Tile& tile, const MapWriter& maps) const {
    tile.reset(static_cast<std::size_t>(voxel_count(box)), maps);
    const glm::i64vec3 size = box.end - box.begin;
    const glm::i64vec3& cells = lattice_.cells();
    const VoxelBox voxels{box.begin, box.end};
    lattice_.find_blocks(box, [&](std::size_t number) {
      LatticeIndex::Block& block = tile.block;
      lattice_.load(number, block);
      for (int z = 0; z < block.cells.z; ++z) {
        for (int y = 0; y < block.cells.y; ++y) {
          for (int x = 0; x < block.cells.x; ++x) {
            const glm::i64vec3 at = block.first_cell + glm::i64vec3(x, y, z);
            const std::uint64_t first =
                kTetrahedraPerCell * static_cast<std::uint64_t>((at.z * cells.y + at.y) * cells.x + at.x);
            visit_cell(
                block.cell({x, y, z}), block.is_odd({x, y, z}), voxels, lattice_.frame().nudge,
                [&](const glm::i64vec3& voxel, const glm::i32vec3& signs, int t, const Tetrahedron& tetrahedron) {
                  const glm::i64vec3 in = voxel - box.begin;
                  const auto place = static_cast<std::size_t>((in.z * size.y + in.y) * size.x + in.x);
                  if (maps.wants_owners() && tile.owners[place] != UINT16_MAX) ++tile.owners[place];
                  const std::uint64_t owner = first + static_cast<std::uint64_t>(t);
                  if (owner >= tile.owner[place]) return;
                  tile.owner[place] = owner;
                  tile.offset[place] = interpolate_u(tetrahedron, detail::to_steps(voxel), signs);
                  if (maps.wants_jacobian()) tile.jacobian[place] = static_cast<float>(jacobian(tetrahedron));
                });
          }
        }
      }
    });
  }

  Report gather(const Region& box, Tile& tile, const std::vector<TargetSampler>& samplers,
                const MapWriter& maps) const {
    Report report;
    if (maps.wants_owners()) {
      report.multiply_owned =
          static_cast<std::uint64_t>(std::count_if(tile.owners.begin(), tile.owners.begin() + voxel_count(box),
                                                   [](std::uint16_t owners) { return owners > 1; }));
    }
    const auto width = static_cast<int>(box.end.x - box.begin.x);
    std::size_t first = 0;
    for (std::int64_t z = box.begin.z; z < box.end.z; ++z) {
      for (std::int64_t y = box.begin.y; y < box.end.y; ++y, first += static_cast<std::size_t>(width)) {
        const Row row{{box.begin.x, y, z}, width, tile.mapped, tile.offset.data() + first};
        settle(row, first, tile, maps, report);
        sample_targets(row, samplers, tile.coverage, report);
        maps.write(row, tile.coverage, maps.wants_jacobian() ? tile.jacobian.data() + first : nullptr,
                   maps.wants_owners() ? tile.owners.data() + first : nullptr);
      }
    }
    return report;
  }

  /// Decides for a row which voxels come through the field; those outside the undeformed lattice may stay where they
  /// are.
  void settle(const Row& row, std::size_t first, Tile& tile, const MapWriter& maps, Report& report) const {
    const bool rest = lattice_.field().outside == Outside::rest;
    for (int i = 0; i < row.count; ++i) {
      const std::size_t place = first + static_cast<std::size_t>(i);
      const bool owned = tile.owner[place] != kNobody;
      tile.mapped[i] = owned;
      if (!rest || lattice_.frame().holds(row.voxel + glm::i64vec3(i, 0, 0))) continue;
      report.conflicts += owned;
      if (owned) continue;
      tile.mapped[i] = 1;
      tile.offset[place] = glm::vec3(0);
      if (maps.wants_jacobian()) tile.jacobian[place] = 1.0f;
    }
  }

  mutable tbb::task_arena arena_;
  LatticeIndex lattice_;
  bool ready_ = false, wants_range_ = true;
};

}  // namespace

}  // namespace cpu

std::unique_ptr<Resampler> make_cpu_resampler(Geometry output, Limits limits) {
  return std::make_unique<cpu::ForwardResampler>(output, limits);
}

}  // namespace tetwarp
