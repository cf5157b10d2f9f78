// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>
#include <vector>

#include "deform/cpu/claims.h"
#include "deform/cpu/coverage.h"
#include "deform/cpu/intervals/interval_writer.h"
#include "deform/cpu/intervals/lattice_raster.h"
#include "deform/cpu/kept_tiles.h"
#include "deform/cpu/lattice_index.h"
#include "deform/cpu/map_writer.h"
#include "deform/cpu/march.h"
#include "deform/cpu/mesh_resampler.h"
#include "deform/cpu/sampler.h"
#include "deform/cpu/tiles.h"
#include "deform/lattice_or_mesh.h"
#include "deform/target_check.h"

namespace tetwarp {

namespace cpu {

namespace {

constexpr int kWalk = 64;           ///< the most tetrahedra that the exact walk passes
constexpr int kTooManyFolds = 8;    ///< if one tetrahedron in so many is inverted, all voxels are claimed
constexpr int kMostlyFolded = 256;  ///< if one tetrahedron in so many is inverted, most walks fail

/// What is known of each voxel of a tile.
struct TileVoxels {
  LatticeBlock block;
  Claims claims;
  MarchScratch march;
  std::vector<Owners> owners;     ///< once all are settled: none or one
  std::vector<glm::vec3> offset;  ///< undeformed minus deformed place, voxels
  std::uint8_t mapped[kTile], coverage[kTile];
  // Of a coarse field:
  LatticeRaster raster;
  IntervalWriter writer;
  std::vector<std::int32_t> fixed[3];  ///< U of each voxel, 2^-23 voxel

  void reset(std::int64_t voxels, bool coarse) {
    const std::size_t room = static_cast<std::size_t>(voxels) + MarchScratch::kRoom;
    owners.resize(room);
    if (!coarse) offset.resize(room);
    for (std::vector<std::int32_t>& axis : fixed) axis.resize(coarse ? room : 0);
  }
  /// U of a row that begins with voxel n.
  FixedOffsets fixed_offsets(std::size_t n) const { return {{&fixed[0][n], &fixed[1][n], &fixed[2][n]}, {}}; }
};

/// Deforms volumes tile by tile: finds for each voxel where it comes from, then samples its rows. Voxels at rest are
/// copied. If the undeformed vertices lie at whole steps, the march comes first; voxels that it leaves, and all voxels
/// of other lattices, are claimed.
class LatticeResampler final : public ForwardResampler {
 public:
  LatticeResampler(Geometry output, const Limits& limits) : ForwardResampler(output), arena_(limits), kept_(output) {}

  void set_field(const FieldView& field, const FieldOptions& options, const Control& control) override {
    ready_ = false;
    require_host(field.memory, "the field");
    arena_.execute([&] { lattice_.build(output(), field, control); });
    wants_range_ = options.jacobian_range;
    const FieldStatistics& statistics = lattice_.statistics();
    has_coverage_ = false;
    const glm::i64vec3& cells = lattice_.cells();
    const auto many = static_cast<std::uint64_t>(kTetrahedraPerCell * cells.x * cells.y * cells.z / kTooManyFolds);
    can_march_ = lattice_.steps().cells.x != 0 && is_near(field, statistics) && statistics.inverted <= many &&
                 !(lattice_.frame().coarse && (has_large_cells() || form().is_wide));
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

  Report resample(Region region, std::span<const Target> targets, const Maps& maps, const Control& control,
                  const PartSink& finished) override {
    kept_.forget();
    return make(region, targets, maps, control, finished, nullptr);
  }

  Update update(std::span<const Target> targets, const Control& control, std::span<const ValueRange> seen) override {
    const bool may_keep =
        ready_ && lattice_.frame().coarse &&
        std::all_of(targets.begin(), targets.end(), [](const Target& target) { return target.sampled_slices.empty(); });
    if (!may_keep) return ForwardResampler::update(targets, control, seen);
    arena_.execute([&] { kept_.compare(lattice_, targets); });
    const Report report = make(whole(output()), targets, {}, control, {}, &kept_);
    kept_.keep(lattice_, targets);
    return {report, kept_.changed()};
  }

 private:
  /// Computes a region of targets and maps, as `resample` does.
  /// @param kept  says which tiles have to be made, of the whole output; null: all
  Report make(Region region, std::span<const Target> targets, const Maps& maps, const Control& control,
              const PartSink& finished, KeptTiles* kept) {
    require(ready_, "resample needs a field: call set_field first");
    const TargetSamplers samplers = make_samplers(*this, targets, region);
    const MapWriter writer(maps, output(), region);
    const glm::i64vec3& cells = lattice_.cells();
    require_numbers(maps, static_cast<std::uint64_t>(kTetrahedraPerCell * cells.x * cells.y * cells.z));
    const bool places_only = !writer.wants_of_owners();
    const bool may_march = can_march_ && places_only;
    if (may_march && !has_coverage_ && !rests(region)) {
      arena_.execute([&] { coverage_.find(lattice_, output()); });
      has_coverage_ = true;
    }
    const auto can_copy = [&](const Region& box) {
      return !samplers.empty() && places_only && !writer.wants_any() &&
             std::all_of(samplers.begin(), samplers.end(), [&](const auto& of) { return of->can_copy(box); });
    };
    const auto is_copied = [&](const Region& box) { return !kept && can_copy(box) && rests(box); };
    const TileTargets to{samplers, writer, form(), lattice_.frame().nudge};
    const auto make_tile = [&](const Region& box, TileVoxels& tile) {
      if (!writer.wants_owners() && !writer.wants_tetrahedra() && rests(box))
        return can_copy(box) ? copy(box, samplers) : stay(box, tile, samplers, writer);
      Report of_tile;
      const bool gathered = may_march && !mostly_folds(box) && gather(box, tile, of_tile.paths);
      if (!gathered && lattice_.frame().coarse) {
        of_tile.paths.gathered += static_cast<std::uint64_t>(voxel_count(box));
        write_intervals(box, tile, to, of_tile);
        return of_tile;
      }
      if (!gathered) claim_all(box, tile, writer, of_tile.paths);
      write(box, tile, samplers, writer, of_tile);
      return of_tile;
    };
    Report report = for_each_tile<TileVoxels>(arena_, region, control, finished, is_copied,
                                              [&](const Region& box, TileVoxels& tile) {
                                                if (!kept) return make_tile(box, tile);
                                                if (kept->is_changed(box)) kept->report(box) = make_tile(box, tile);
                                                return kept->report(box);
                                              });
    const FieldStatistics& statistics = lattice_.statistics();
    report.inverted = statistics.inverted;
    report.degenerate = statistics.degenerate;
    if (!wants_range_) return report;
    report.jacobian_min = statistics.jacobian_min;
    report.jacobian_max = statistics.jacobian_max;
    return report;
  }

  /// Whether a box lies within the undeformed lattice and everything that may reach it is at rest: then each of its
  /// voxels is owned by a cell at rest and by no other. (Something must reach the box, for what lay there may have
  /// moved away as a whole. Where one of the lattice's blocks in the box rests, its neighbours share vertices with it
  /// and reach the box, too, and so on.)
  bool rests(const Region& box) const {
    const StepLattice& steps = lattice_.steps();
    if (steps.cells.x == 0) return false;
    for (int axis = 0; axis < 3; ++axis) {  // exact, in 2^-12 voxel
      const float from = static_cast<float>(box.begin[axis] * kStepsPerVoxel) - steps.first[axis],
                  to = static_cast<float>((box.end[axis] - 1) * kStepsPerVoxel) - steps.first[axis];
      if (from < 0 || to > static_cast<float>(steps.cells[axis]) * steps.cell[axis]) return false;
    }
    bool any = false, all = true;
    lattice_.find_blocks(box, [&](std::size_t block) {
      any = true;
      all = all && lattice_.rests(block);
    });
    return any && all;
  }

  /// Copies a box at rest; all targets must be able to.
  static Report copy(const Region& box, const TargetSamplers& samplers) {
    Report report;
    report.paths.gathered = static_cast<std::uint64_t>(voxel_count(box));
    for (std::size_t n = 0; n < samplers.size(); ++n) {
      Report not_counted;
      samplers[n]->copy(box, n == 0 ? report : not_counted);
    }
    return report;
  }

  /// Samples a tile at rest where some target cannot be copied.
  Report stay(const Region& box, TileVoxels& tile, const TargetSamplers& samplers, const MapWriter& maps) const {
    const bool coarse = lattice_.frame().coarse;
    Report report;
    report.paths.gathered = static_cast<std::uint64_t>(voxel_count(box));
    const auto width = static_cast<int>(box.end.x - box.begin.x);
    const glm::vec3 offset[kTile] = {};
    const std::int32_t none[kTile] = {};
    const FixedOffsets fixed{{none, none, none}, {}};
    float jacobian[kTile];
    std::fill_n(jacobian, width, 1.0f);
    std::fill_n(tile.mapped, width, std::uint8_t{1});
    for (std::int64_t z = box.begin.z; z < box.end.z; ++z) {
      for (std::int64_t y = box.begin.y; y < box.end.y; ++y) {
        const Row row{{box.begin.x, y, z}, width, tile.mapped, coarse ? nullptr : offset, coarse ? &fixed : nullptr};
        sample_targets(row, samplers, tile.coverage, report);
        maps.write(row, tile.coverage, {.jacobian = jacobian});
      }
    }
    return report;
  }

  PlaceForm form() const { return {lattice_.frame().coarse, lattice_.statistics().most_moved}; }

  /// Whether tetrahedra have so many voxels that rows of them are found faster than voxels, one after the other.
  bool has_large_cells() const {
    constexpr float kLarge = 3.5f * 3.5f * 3.5f;  // voxels
    const glm::vec3 cell = lattice_.steps().cell * kVoxelsPerStep;
    return cell.x * cell.y * cell.z >= kLarge;
  }

  /// Finds the owners of a tile of a coarse field, and samples their voxels.
  void write_intervals(const Region& box, TileVoxels& tile, const TileTargets& to, Report& report) const {
    const bool rest = lattice_.field().outside == Outside::rest;
    tile.writer.prepare(to);
    tile.raster.find(lattice_, box, to.maps.wants_owners(), tile.writer.tile, &tile.writer);
    tile.writer.finish(
        [&](std::int64_t y, std::int64_t z) {
          std::uint32_t outside = 0;
          for (std::int64_t x = box.begin.x; rest && x < box.end.x; ++x)
            outside |= std::uint32_t{!lattice_.frame().holds({x, box.begin.y + y, box.begin.z + z})}
                       << (x - box.begin.x);
          return outside;
        },
        report);
  }

  /// Whether vectors of float can hold everything that a march computes.
  static bool is_near(const FieldView& field, const FieldStatistics& statistics) {
    const glm::i64vec3& size = field.lattice->size;
    constexpr std::int64_t kMostVertices = INT32_MAX / 3;  // so that numbers of a displacement's components fit 32 bits
    return static_cast<float>(statistics.most_moved) <= VectorField::kMostMoved &&
           size.x * size.y * size.z <= kMostVertices;
  }

  /// Whether most blocks that may reach a tile hold inverted tetrahedra: then nearly all of its voxels would be
  /// claimed.
  bool mostly_folds(const Region& box) const {
    if (lattice_.statistics().inverted == 0) return false;
    int blocks = 0, folded = 0;
    lattice_.find_blocks(box, [&](std::size_t number) {
      ++blocks;
      folded += lattice_.has_inverted(number);
    });
    return 2 * folded > blocks;
  }

  /// Finds where the voxels of a tile come from by a march.
  /// @return false where that is not the way: many voxels may have several owners; in a coarse field, which has no
  /// claims, any may, or the walk does not find one
  bool gather(const Region& box, TileVoxels& tile, Paths& paths) const {
    const bool coarse = lattice_.frame().coarse;
    const std::int64_t voxels = voxel_count(box);
    tile.reset(voxels, coarse);
    std::int64_t several = coverage_.owners_of(box, tile.owners.data(), tile.block);
    if (several != 0 && (coarse || voxel_count(around_several(box, tile)) > voxels / 2)) return false;
    const IntBox in{glm::ivec3(box.begin), glm::ivec3(box.end)};
    const NudgeTurns turns(lattice_.frame().nudge);
    MarchTile to{in, tile.owners.data(), coarse ? nullptr : tile.offset.data()};
    for (int axis = 0; coarse && axis < 3; ++axis) to.fixed[axis] = tile.fixed[axis].data();
    march(lattice_.vectors(), turns, to, tile.march);
    const std::int64_t left = walk(in, turns, tile);
    if (coarse && left != 0) return false;
    several += left;
    if (several != 0) claim_several(box, tile);
    const std::int64_t walked = static_cast<std::int64_t>(tile.march.unsettled.size()) - left;
    paths.claimed += static_cast<std::uint64_t>(several);
    paths.walked += static_cast<std::uint64_t>(walked);
    paths.gathered += static_cast<std::uint64_t>(voxels - several - walked);
    return true;
  }

  /// Seeks the owners of voxels that the march left, by a walk. @return how many voxels are still left; these are
  /// marked as having several owners
  std::int64_t walk(const IntBox& box, const NudgeTurns& turns, TileVoxels& tile) const {
    const FieldStatistics& statistics = lattice_.statistics();
    const glm::i64vec3& cells = lattice_.cells();
    const auto few = static_cast<std::uint64_t>(kTetrahedraPerCell * cells.x * cells.y * cells.z / kMostlyFolded);
    const int most = statistics.inverted > few ? 0 : kWalk;
    const glm::ivec3 size = box.end - box.begin;
    const SnappedLattice lattice(lattice_);
    std::int64_t left = 0;
    for (const Unsettled& of : tile.march.unsettled) {
      constexpr int kSide = static_cast<int>(kTile);
      const glm::ivec3 in(of.voxel % kSide, of.voxel / kSide % kSide, of.voxel / (kSide * kSide)),
          voxel = box.begin + in;
      const glm::vec3 place =
          std::isfinite(of.place.x + of.place.y + of.place.z) ? of.place : lattice_.steps().place(glm::vec3(voxel));
      const glm::i32vec3 steps = voxel * kStepsPerVoxel, signs = turns.signs(voxel);
      const auto n = static_cast<std::size_t>((in.z * size.y + in.y) * size.x + in.x);
      LatticeTetrahedron owner;
      if (walk_to_owner(lattice, as_lattice(tetrahedron_at(lattice_.steps(), place)), steps, signs, most, owner)) {
        if (lattice_.frame().coarse) {
          const glm::i64vec3 u = coarse_u(vertices_of(lattice, owner), voxel, signs);
          for (int axis = 0; axis < 3; ++axis) tile.fixed[axis][n] = static_cast<std::int32_t>(u[axis]);
        } else {
          tile.offset[n] = interpolate_u(vertices_of(lattice, owner), steps, signs);
        }
      } else {
        tile.owners[n] = Owners::several;
        ++left;
      }
    }
    return left;
  }

  template <class Visit>
  static void for_each_several(const Region& box, const TileVoxels& tile, Visit&& visit) {
    std::size_t n = 0;
    for (std::int64_t z = box.begin.z; z < box.end.z; ++z) {
      for (std::int64_t y = box.begin.y; y < box.end.y; ++y) {
        for (std::int64_t x = box.begin.x; x < box.end.x; ++x, ++n)
          if (tile.owners[n] == Owners::several) visit(n, glm::i64vec3(x, y, z));
      }
    }
  }

  /// The box around the voxels that may have several owners; there must be one.
  static Region around_several(const Region& box, const TileVoxels& tile) {
    Region around{box.end, box.begin};
    for_each_several(box, tile, [&](std::size_t, const glm::i64vec3& voxel) {
      around.begin = glm::min(around.begin, voxel);
      around.end = glm::max(around.end, voxel + std::int64_t{1});
    });
    return around;
  }

  void claim_several(const Region& box, TileVoxels& tile) const {
    const Region around = around_several(box, tile);
    tile.claims.find(lattice_, around, false, false, tile.block);
    const glm::i64vec3 size = around.end - around.begin;
    for_each_several(box, tile, [&](std::size_t n, const glm::i64vec3& voxel) {
      const glm::i64vec3 in = voxel - around.begin;
      const auto from = static_cast<std::size_t>((in.z * size.y + in.y) * size.x + in.x);
      const bool owned = tile.claims.owner[from] != Claims::kNobody;
      tile.owners[n] = owned ? Owners::one : Owners::none;
      if (owned) tile.offset[n] = tile.claims.offset[from];
    });
  }

  void claim_all(const Region& box, TileVoxels& tile, const MapWriter& maps, Paths& paths) const {
    const std::int64_t voxels = voxel_count(box);
    tile.reset(voxels, false);
    tile.claims.find(lattice_, box, maps.wants_jacobian(), maps.wants_owners(), tile.block);
    for (std::size_t n = 0; n < tile.claims.owner.size(); ++n) {
      tile.owners[n] = tile.claims.owner[n] == Claims::kNobody ? Owners::none : Owners::one;
      tile.offset[n] = tile.claims.offset[n];
    }
    paths.claimed += static_cast<std::uint64_t>(voxels);
  }

  /// Samples the rows of a tile whose voxels are all settled.
  void write(const Region& box, TileVoxels& tile, const TargetSamplers& samplers, const MapWriter& maps,
             Report& report) const {
    const bool coarse = lattice_.frame().coarse;
    const Claims& claims = tile.claims;
    if (maps.wants_owners()) report.multiply_owned = count_of_several(claims.owners);
    const auto width = static_cast<int>(box.end.x - box.begin.x);
    std::size_t first = 0;
    for (std::int64_t z = box.begin.z; z < box.end.z; ++z) {
      for (std::int64_t y = box.begin.y; y < box.end.y; ++y, first += static_cast<std::size_t>(width)) {
        const FixedOffsets fixed = coarse ? tile.fixed_offsets(first) : FixedOffsets{};
        const Row row{{box.begin.x, y, z},
                      width,
                      tile.mapped,
                      coarse ? nullptr : tile.offset.data() + first,
                      coarse ? &fixed : nullptr};
        map_row(row, first, tile, maps, report);
        sample_targets(row, samplers, tile.coverage, report);
        std::uint32_t tetrahedra[kTile];
        if (maps.wants_tetrahedra()) {
          std::transform(claims.owner.data() + first, claims.owner.data() + first + width, tetrahedra,
                         [](std::uint64_t owner) { return static_cast<std::uint32_t>(owner); });  // kNobody, too
        }
        maps.write(row, tile.coverage,
                   {maps.wants_jacobian() ? claims.jacobian.data() + first : nullptr,
                    maps.wants_owners() ? claims.owners.data() + first : nullptr, tetrahedra});
      }
    }
  }

  /// Decides for each voxel of a row whether it comes through the field. A voxel outside the undeformed lattice may
  /// stay where it is.
  void map_row(const Row& row, std::size_t first, TileVoxels& tile, const MapWriter& maps, Report& report) const {
    const bool rest = lattice_.field().outside == Outside::rest;
    if (!rest) {
      std::transform(tile.owners.data() + first, tile.owners.data() + first + row.count, tile.mapped,
                     [](Owners owners) { return static_cast<std::uint8_t>(owners); });
      return;
    }
    for (int i = 0; i < row.count; ++i) {
      const std::size_t place = first + static_cast<std::size_t>(i);
      const bool owned = tile.owners[place] == Owners::one;
      tile.mapped[i] = owned;
      if (lattice_.frame().holds(row.voxel + glm::i64vec3(i, 0, 0))) continue;
      report.conflicts += owned;
      if (owned) continue;
      tile.mapped[i] = 1;
      if (lattice_.frame().coarse)
        for (std::vector<std::int32_t>& axis : tile.fixed) axis[place] = 0;
      else
        tile.offset[place] = glm::vec3(0);
      if (maps.wants_jacobian()) tile.claims.jacobian[place] = 1.0f;
    }
  }

  mutable Arena arena_;
  LatticeIndex lattice_;
  Coverage coverage_;
  KeptTiles kept_;  ///< by `update`
  bool ready_ = false, wants_range_ = true;
  bool can_march_ = false, has_coverage_ = false;
};

}  // namespace

}  // namespace cpu

std::unique_ptr<ForwardResampler> make_cpu_resampler(Geometry output, Limits limits) {
  return std::make_unique<LatticeOrMesh>(
      output, [=] { return std::make_unique<cpu::LatticeResampler>(output, limits); },
      [=] { return cpu::make_mesh_resampler(output, limits); });
}

}  // namespace tetwarp
