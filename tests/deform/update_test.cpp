// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Updates of volumes on the CPU, frame by frame, against whole passes, byte for byte.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "tests/support/fields.h"
#include "tests/support/run.h"
#include "tests/support/shifted.h"

namespace tetwarp {
namespace {

using namespace test;

/// A volume that goes through one field after another.
class Animation {
 public:
  Animation(const Geometry& grid, Random& random)
      : grid_(grid),
        source_(random_values<std::int16_t>(grid, random, -1000, 3000)),
        output_(poisoned<std::int16_t>(grid)),
        updated_(make_cpu_resampler(grid)) {}

  ForwardResampler& resampler() { return *updated_; }
  Target target() {
    return {.source = view(std::as_const(source_)),
            .output = view(output_),
            .interpolation = interpolation_,
            .background = background_,
            .padding = padding_};
  }
  void set_interpolation(Interpolation interpolation) { interpolation_ = interpolation; }
  void set_background(double background) { background_ = background; }
  void set_padding(double low, double high) { padding_ = {low, high}; }

  /// Updates, and compares with a whole pass of a resampler that knows nothing else.
  void expect_whole_pass(const VertexField& field, Outside outside) {
    const std::vector<std::int16_t> before = output_.voxels;
    updated_->set_field(view(field, outside));
    const Target given = target();
    const Update found = updated_->update({&given, 1});
    changed_ = found.changed;

    Volume<std::int16_t> expected = poisoned<std::int16_t>(grid_);
    Target anew = target();
    anew.output = view(expected);
    const auto resampler = make_cpu_resampler(grid_);
    resampler->set_field(view(field, outside));
    const Report report = resampler->resample(whole(grid_), {&anew, 1});
    EXPECT_EQ(output_.voxels, expected.voxels);
    EXPECT_EQ(found.report.covered, report.covered);
    EXPECT_EQ(found.report.uncovered, report.uncovered);
    EXPECT_EQ(found.report.clamped, report.clamped);
    EXPECT_EQ(found.report.padded, report.padded);
    EXPECT_EQ(found.report.conflicts, report.conflicts);
    EXPECT_EQ(found.report.inverted, report.inverted);
    EXPECT_EQ(found.report.degenerate, report.degenerate);
    EXPECT_EQ(found.report.jacobian_min, report.jacobian_min);
    for_each_voxel(grid_, [&](const glm::i64vec3& voxel, std::size_t n) {
      if (output_.voxels[n] != before[n]) {
        EXPECT_TRUE(is_in_changed(voxel)) << to_string(voxel);
      }
    });
  }
  std::int64_t voxels_changed() const {
    std::int64_t count = 0;
    for (const Region& region : changed_) count += voxel_count(region);
    return count;
  }

 private:
  bool is_in_changed(const glm::i64vec3& voxel) const {
    return std::any_of(changed_.begin(), changed_.end(), [&](const Region& region) {
      return contains(region, {voxel, voxel + std::int64_t{1}});
    });
  }

  Geometry grid_;
  Volume<std::int16_t> source_, output_;
  std::unique_ptr<ForwardResampler> updated_;
  Interpolation interpolation_ = Interpolation::linear;
  double background_ = -7;
  std::optional<PaddingRange> padding_ = PaddingRange{-1000, -950};
  std::vector<Region> changed_;
};

/// Moves a share of the vertices.
void move_some(VertexField& field, double share, double mm, Random& random) {
  for (glm::vec3& moved : field.displacement) {
    if (random.chance(share))
      moved += glm::vec3(glm::dvec3(random.real(-mm, mm), random.real(-mm, mm), random.real(-mm, mm)));
  }
}

/// A field over several tiles, or over a part of them.
FieldCase case_of_tiles(Random& random) {
  const Geometry grid = oblique_grid({random.integer(33, 90), random.integer(33, 80), random.integer(33, 70)});
  Geometry lattice = lattice_over(grid, random.integer(2, 16));
  if (random.chance(0.4)) {  // vertices between voxels, and voxels outside
    lattice.spacing *= random.real(0.7, 1);
    lattice.origin += glm::dvec3(random.real(0, 9), random.real(0, 9), random.real(0, 9));
  }
  VertexField field = uniform_field(lattice, glm::vec3(0));
  move_some(field, random.one_of({0.0, 0.01, 1.0}), 0.2 * lattice.spacing.x, random);
  return {grid, field, "tiles " + to_string(grid.size) + ", lattice " + to_string(lattice.size), {}};
}

TEST(CpuUpdates, AreWholePasses) {
  SCOPED_TRACE(seed_text(test_seed()));
  for (std::uint64_t n = 0; n < test_cases(40); ++n) {
    SCOPED_TRACE("case " + std::to_string(n));
    Random random(test_seed(), 9100 + n);
    FieldCase given = random.chance(0.3)   ? random_injective_case(random)
                      : random.chance(0.5) ? random_folding_case(random)
                                           : case_of_tiles(random);
    VertexField& field = given.field;
    SCOPED_TRACE(given.description);
    Animation animation(given.output, random);
    animation.set_interpolation(random.one_of(kInterpolations));
    Outside outside = Outside::background;
    const double mm = field.lattice.spacing.x;
    for (const double share : {0.0, 0.02, 0.0, 0.3, 0.02, 0.02}) {
      if (random.chance(0.3)) outside = outside == Outside::rest ? Outside::background : Outside::rest;
      move_some(field, share, random.chance(0.3) ? 20 * mm : 0.3 * mm, random);
      ASSERT_NO_FATAL_FAILURE(animation.expect_whole_pass(field, outside));
    }
  }
}

TEST(CpuUpdates, MakeOnlyTilesThatTheFieldMayChange) {
  SCOPED_TRACE(seed_text(test_seed()));
  Random random(test_seed(), 9200);
  const Geometry grid = unit_grid({128, 96, 64});
  const std::int64_t tile = 32 * 32 * 32, all = voxel_count(grid);
  Animation animation(grid, random);
  VertexField field = uniform_field(lattice_over(grid, 8), glm::vec3(0.3f, 0.2f, 0.1f));
  const auto vertex = [&](int i, int j, int k) -> glm::vec3& {
    return field.displacement[static_cast<std::size_t>((k * field.lattice.size.y + j) * field.lattice.size.x + i)];
  };
  const auto changed_by = [&](double background = -7) {
    animation.set_background(background);
    animation.expect_whole_pass(field, Outside::background);
    return animation.voxels_changed();
  };
  EXPECT_EQ(changed_by(), all);
  EXPECT_EQ(changed_by(), 0);
  vertex(6, 6, 6).x += 1;  // voxel 48 on each axis, within the second tile on each
  EXPECT_EQ(changed_by(), tile);
  vertex(6, 6, 6).x += 60;  // into the fourth
  EXPECT_EQ(changed_by(), 3 * tile);
  vertex(6, 6, 6).x -= 60;
  EXPECT_EQ(changed_by(), 3 * tile);
  vertex(4, 4, 4).x += 1;  // a corner of eight tiles, so that each of its cells lies in one
  EXPECT_EQ(changed_by(), 8 * tile);
  EXPECT_EQ(changed_by(5), all) << "another background";
  animation.set_interpolation(Interpolation::nearest);
  EXPECT_EQ(changed_by(5), all) << "another interpolation";
  animation.set_padding(0, 100);
  EXPECT_EQ(changed_by(5), all) << "other padding";
  EXPECT_EQ(changed_by(5), 0);

  vertex(6, 6, 6).x += 1;
  animation.resampler().set_field(view(field, Outside::background));
  const Target target = animation.target();
  animation.resampler().resample(whole(grid), {&target, 1});  // others may have written
  EXPECT_EQ(changed_by(5), all);
  field = uniform_field(lattice_over(grid, 16), glm::vec3(0.3f, 0.2f, 0.1f));
  EXPECT_EQ(changed_by(5), all) << "another lattice";
}

TEST(CpuUpdates, MakeAllAfterOneThatWasStopped) {
  Random random(test_seed(), 9300);
  const Geometry grid = unit_grid({96, 96, 64});
  Animation animation(grid, random);
  VertexField field = uniform_field(lattice_over(grid, 8), glm::vec3(0.3f, 0.2f, 0.1f));
  animation.expect_whole_pass(field, Outside::background);
  field.displacement[200].y += 2;
  animation.resampler().set_field(view(field, Outside::background));
  std::stop_source source;
  source.request_stop();
  const Target target = animation.target();
  EXPECT_THROW(animation.resampler().update({&target, 1}, {.stop = source.get_token()}), Cancelled);
  animation.expect_whole_pass(field, Outside::background);
  EXPECT_EQ(animation.voxels_changed(), voxel_count(grid));
}

}  // namespace
}  // namespace tetwarp
