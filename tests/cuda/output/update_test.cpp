// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Updates of volumes on the device, frame by frame, against whole passes of the CPU, bit for bit.
#include <cuda_runtime.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <optional>

#include "backend/devices.h"
#include "backend/factories.h"
#include "deform/fields/formula.h"
#include "deform/fields/lattice_mesh.h"
#include "tests/cuda/on_device.h"
#include "tests/support/fields.h"
#include "tests/support/shifted.h"

namespace tetwarp {
namespace {

using namespace test;

/// A volume that goes through one field after another, on the device and on the CPU.
class Updates : public testing::Test {
 protected:
  void SetUp() override {
    if (device_count() == 0) GTEST_SKIP() << "no CUDA device";
    source_.voxels.resize(static_cast<std::size_t>(voxel_count(grid_)));
    for (std::int16_t& voxel : source_.voxels) voxel = static_cast<std::int16_t>(random_.integer(-1000, 3000));
    source_there_.emplace(source_.voxels);
    output_there_.emplace(poisoned<std::int16_t>(grid_).voxels);
    device_ = make_forward_resampler(BackendKind::cuda, grid_);
    cpu_ = make_cpu_resampler(grid_);
    for (std::unique_ptr<Renderer>& renderer : renderers_) renderer = make_renderer(BackendKind::cuda);
    set_style(style_.transfer);
  }

  Target target_there(double background = -7) {
    return {.source = on_device(view(source_), source_there_->data()),
            .output = on_device(view(held_), output_there_->data()),
            .background = background};
  }
  Report update(const VertexField& field, double background = -7, const std::vector<ValueRange>& seen = {}) {
    device_->set_field(view(field, Outside::background));
    const Target target = target_there(background);
    Update update = device_->update({&target, 1}, {}, seen);
    changed_ = std::move(update.changed);
    return update.report;
  }
  void expect_whole_pass(const VertexField& field, const Report& found, double background = -7) {
    Report report;
    const std::vector<std::int16_t> expected = whole_pass(field, background, &report);
    EXPECT_TRUE(output_there_->download() == expected);
    EXPECT_EQ(report.covered, found.covered);
    EXPECT_EQ(report.uncovered, found.uncovered);
    EXPECT_EQ(report.inverted, found.inverted);
  }
  /// What the CPU makes of all voxels. @param report  of it: written, unless null
  std::vector<std::int16_t> whole_pass(const VertexField& field, double background, Report* report = nullptr) {
    auto expected = poisoned<std::int16_t>(grid_);
    const Target target{.source = view(source_), .output = view(expected), .background = background};
    cpu_->set_field(view(field, Outside::background));
    const Report found = cpu_->resample(whole(grid_), {&target, 1});
    if (report) *report = found;
    return expected.voxels;
  }
  /// In the regions that the last update wrote.
  std::int64_t voxels_changed() const {
    std::int64_t within = 0;
    for (const Region& region : changed_) within += voxel_count(region);
    return within;
  }
  void set_style(const TransferFunction& transfer) {
    style_.transfer = transfer;
    for (const std::unique_ptr<Renderer>& renderer : renderers_) renderer->set_style(style_);
  }
  /// The pictures of what the device holds, by renderers that were told of each change, and of what it should hold.
  void expect_picture(bool is_first) { expect_picture(is_first, output_there_->download()); }
  /// The same. @param voxels  of which it should be the picture
  void expect_picture(bool is_first, const std::vector<std::int16_t>& voxels) {
    const Volume<std::int16_t> expected{grid_, voxels};
    const auto on_cpu = make_cpu_renderer();
    on_cpu->set_style(style_);
    on_cpu->set_volume(view(expected));
    double angle = 40;
    for (const std::unique_ptr<Renderer>& renderer : renderers_) {  // one sees one side
      if (is_first) {
        renderer->set_volume(on_device(view(held_), output_there_->data()));
      } else {
        renderer->update_volume(changed_);
      }
      const ViewPlane plane = view_plane({.angle_deg = angle, .width = kWidth, .height = kHeight}, grid_);
      angle += 180;
      std::vector<std::uint8_t> found(3 * kWidth * kHeight), wanted(found.size());
      renderer->render(plane, found);
      on_cpu->render(plane, wanted);
      EXPECT_EQ(found, wanted);
    }
  }
  /// Moves some vertices.
  void move_some(VertexField& field, double share, double mm) {
    for (glm::vec3& moved : field.displacement) {
      if (!random_.chance(share)) continue;
      moved += glm::vec3(mm * glm::dvec3(random_.real(-1, 1), random_.real(-1, 1), random_.real(-1, 1)));
    }
  }

  static constexpr int kWidth = 120, kHeight = 100;  ///< pixels

  const Geometry grid_ = unit_grid({91, 70, 58});
  Random random_{test_seed(), 77};
  Volume<std::int16_t> source_{grid_, {}}, held_ = poisoned<std::int16_t>(grid_);
  std::optional<OnDevice<std::int16_t>> source_there_, output_there_;
  std::unique_ptr<ForwardResampler> device_, cpu_;
  RenderStyle style_{.transfer = transfer_function("ct-bone")};
  std::array<std::unique_ptr<Renderer>, 2> renderers_;
  std::vector<Region> changed_;  ///< by the last update
};

TEST_F(Updates, AreWholePasses) {
  SCOPED_TRACE(seed_text(test_seed()));
  for (const std::int64_t cell : {8, 16, 12, 4, 1}) {
    SCOPED_TRACE("cells of " + std::to_string(cell));
    VertexField field =
        sample_on(lattice_over(grid_, cell), Bubble{.radius = 25, .strength = 0.3, .centre = {40, 35, 30}});
    expect_whole_pass(field, update(field));
    expect_picture(true);
    for (const double share : {0.01, 0.003, 0.0, 0.2, 1.0, 0.01, 0.01}) {
      move_some(field, share, 0.3 * static_cast<double>(cell));
      if (random_.chance(0.3)) {  // a field that nobody updates by
        device_->set_field(view(field, Outside::background));
        move_some(field, share, 0.5);
      }
      expect_whole_pass(field, update(field));
      expect_picture(false);
    }
  }
}

TEST_F(Updates, WriteOnlyWhatMayChange) {
  VertexField field = sample_on(lattice_over(grid_, 8), Bubble{.radius = 25, .strength = 0.3, .centre = {40, 35, 30}});
  const std::uint64_t covered = update(field).covered;
  const std::vector<std::int16_t> nothing(source_.voxels.size(), 99);
  EXPECT_EQ(changed_, std::vector<Region>{whole(grid_)});
  ASSERT_EQ(
      cudaMemcpy(output_there_->data(), nothing.data(), nothing.size() * sizeof(std::int16_t), cudaMemcpyHostToDevice),
      cudaSuccess);
  field.displacement.front() += glm::vec3(0.5f, 0, 0);  // the cell at the first voxel
  const Report report = update(field);
  const std::vector<std::int16_t> found = output_there_->download();
  EXPECT_NE(found.front(), 99);
  EXPECT_EQ(found.back(), 99);
  const std::int64_t within = voxels_changed();
  EXPECT_GT(within, 0);
  EXPECT_LE(std::count_if(found.begin(), found.end(), [](std::int16_t voxel) { return voxel != 99; }), within);
  EXPECT_GT(std::count(found.begin(), found.end(), 99), std::ptrdiff_t(found.size() * 8 / 10));
  EXPECT_NEAR(static_cast<double>(report.covered), static_cast<double>(covered), 200);
}

/// A source of tissue with some bones and some air, all with noise.
class SeenUpdates : public Updates {
 protected:
  void SetUp() override {
    Updates::SetUp();
    if (IsSkipped()) return;
    struct Ball {
      glm::dvec3 centre;
      double radius, value;
    };
    std::vector<Ball> balls;
    for (int n = 0; n < 6; ++n) {
      balls.push_back({{random_.real(0, 91), random_.real(0, 70), random_.real(0, 58)},
                       random_.real(2, 12),
                       n < 3 ? 700.0 : -800.0});
    }
    make_source([&](const glm::ivec3& voxel) {
      double value = 40;
      for (const Ball& ball : balls)
        if (glm::distance(glm::dvec3(voxel), ball.centre) < ball.radius) value = ball.value;
      return value;
    });
  }
  /// @param value  of a voxel, to which noise is added
  template <class Value>
  void make_source(Value&& value) {
    std::size_t n = 0;
    for (int z = 0; z < 58; ++z) {
      for (int y = 0; y < 70; ++y) {
        for (int x = 0; x < 91; ++x)
          source_.voxels[n++] = static_cast<std::int16_t>(value(glm::ivec3(x, y, z)) + random_.real(-100, 100));
      }
    }
    source_there_.emplace(source_.voxels);
  }
};

TEST_F(SeenUpdates, ShowThePictureOfTheWholeVolume) {
  SCOPED_TRACE(seed_text(test_seed()));
  std::size_t differing = 0;
  for (const char* const name : {"ct-bone", "ct-lung", "ct-vessel", "mip", "xray"}) {
    SCOPED_TRACE(name);
    set_style(transfer_function(name));
    const std::vector<ValueRange> seen = seen_values(style_);
    for (const double background : {-1000.0, 900.0}) {
      for (const std::int64_t cell : {8, 16}) {
        SCOPED_TRACE("cells of " + std::to_string(cell) + ", background " + std::to_string(background));
        VertexField field =
            sample_on(lattice_over(grid_, cell), Bubble{.radius = 25, .strength = 0.3, .centre = {40, 35, 30}});
        device_ = make_forward_resampler(BackendKind::cuda, grid_);
        update(field, background, seen);
        expect_picture(true, whole_pass(field, background));
        for (const double share : {0.01, 0.1, 1.0, 0.01, 0.3, 0.02}) {
          move_some(field, share, 0.3 * static_cast<double>(cell));
          if (random_.chance(0.5)) {  // so that what is seen comes to other tiles
            for (glm::vec3& moved : field.displacement) moved += glm::vec3(6, 3, -4);
          }
          update(field, background, seen);
          const std::vector<std::int16_t> expected = whole_pass(field, background), found = output_there_->download();
          for (std::size_t n = 0; n < found.size(); ++n) differing += found[n] != expected[n] ? 1 : 0;
          expect_picture(false, expected);
        }
        expect_whole_pass(field, update(field, background), background);  // what was left is made
      }
    }
  }
  EXPECT_GT(differing, 0u) << "nothing was ever left";
}

/// A bone that goes through tiles in which nothing was seen before.
TEST_F(SeenUpdates, FollowWhatIsSeenIntoOtherTiles) {
  make_source([](const glm::ivec3& voxel) {
    return glm::distance(glm::dvec3(voxel), glm::dvec3(12, 35, 29)) < 6 ? 700.0 : 40.0;
  });
  VertexField field = uniform_field(lattice_over(grid_, 8), glm::vec3(0));
  for (int frame = 0; frame < 16; ++frame) {
    SCOPED_TRACE(frame);
    update(field, -1000, seen_values(style_));
    expect_picture(frame == 0, whole_pass(field, -1000));
    for (glm::vec3& moved : field.displacement) moved += glm::vec3(4, 0, 0);
  }
}

/// A bone up to the border of a tile. In the tile behind it there is tissue from far away, since the cells between are
/// pressed flat; when that moves, the bone's surface looks different.
TEST_F(SeenUpdates, MakeWhatLiesBesideWhatIsSeen) {
  constexpr int kCell = 16;
  VertexField field = uniform_field(lattice_over(grid_, kCell), glm::vec3(0));
  update(field);
  field.displacement.front().x = 0.5f;
  update(field);
  ASSERT_FALSE(changed_.empty());
  const auto border = static_cast<int>(changed_.front().end.x), vertex = (border + kCell / 2) / kCell;
  ASSERT_GT(vertex, 0);
  make_source([&](const glm::ivec3& voxel) {
    return voxel.x >= vertex * kCell - 12 && voxel.x < vertex * kCell ? 700.0 : 40.0;
  });
  const auto vertices_at = [&](int x, const auto& use) {
    for (std::size_t n = 0; n < field.displacement.size(); ++n)
      if (static_cast<std::int64_t>(n) % field.lattice.size.x == x) use(field.displacement[n]);
  };
  const auto place = [&](int x, double at) {
    vertices_at(x, [&](glm::vec3& moved) { moved.x = static_cast<float>(at - x * kCell); });
  };
  place(0, 0);
  place(vertex, border - 0.6);
  place(vertex + 1, border - 0.1);
  for (int frame = 0; frame < 5; ++frame) {
    SCOPED_TRACE(frame);
    update(field, -1000, seen_values(style_));
    expect_picture(frame == 0, whole_pass(field, -1000));
    vertices_at(vertex + 2, [](glm::vec3& moved) { moved.y += 3; });
  }
}

TEST_F(SeenUpdates, MakeWhatWasLeftWhenItMayBeSeen) {
  style_.transfer = transfer_function("ct-bone");
  const std::vector<ValueRange> bone = seen_values(style_), lung{{-900, -700}};
  std::fill(source_.voxels.begin(), source_.voxels.end(), std::int16_t{40});
  source_there_.emplace(source_.voxels);
  VertexField field = uniform_field(lattice_over(grid_, 8), glm::vec3(0));
  update(field, 0, bone);
  move_some(field, 1, 2);
  const Report left = update(field, 0, bone);
  EXPECT_TRUE(changed_.empty());
  EXPECT_EQ(left.covered, static_cast<std::uint64_t>(voxel_count(grid_)));
  update(field, 0, lung);
  EXPECT_TRUE(changed_.empty());
  update(field, 0, {{30, 50}});  // the field is that of before, but tiles of it were left
  EXPECT_EQ(voxels_changed(), voxel_count(grid_));
  EXPECT_EQ(output_there_->download(), whole_pass(field, 0));
  move_some(field, 1, 2);
  expect_whole_pass(field, update(field, 0), 0);
  move_some(field, 1, 2);
  update(field, 0, bone);  // what tiles contain is not known since the call before, so all are made
  EXPECT_EQ(changed_, std::vector<Region>{whole(grid_)});
}

/// A background that lies between two whole numbers is one of them in the volume, and is seen as that.
TEST_F(SeenUpdates, MakeHolesOfARoundedBackground) {
  make_source([](const glm::ivec3&) { return 1000; });
  for (const double background : {-7.4, -7.5, 8.5, 8.6}) {
    SCOPED_TRACE(background);
    VertexField field = uniform_field(lattice_over(grid_, 8), glm::vec3(40, 0, 0));
    const std::vector<std::int16_t> expected = whole_pass(field, background);
    const std::int16_t hole = *std::min_element(expected.begin(), expected.end());
    EXPECT_LE(std::abs(hole - background), 0.5);
    const std::vector<ValueRange> seen{{static_cast<float>(hole), static_cast<float>(hole)}};
    device_ = make_forward_resampler(BackendKind::cuda, grid_);
    update(uniform_field(field.lattice, glm::vec3(0)), background, seen);
    update(field, background, seen);
    const std::vector<std::int16_t> found = output_there_->download();
    for (std::size_t n = 0; n < expected.size(); ++n) ASSERT_EQ(found[n] == hole, expected[n] == hole) << n;
  }
}

TEST_F(Updates, ClearWhatTissueHasLeft) {
  Geometry lattice = unit_grid({5, 4, 4});
  lattice.spacing = glm::dvec3(8);
  lattice.origin = {10, 12, 8};
  for (const glm::vec3& by : {glm::vec3(0), glm::vec3(44, 20, 20), glm::vec3(0), glm::vec3(-15, 10, 0)}) {
    SCOPED_TRACE(by.x);
    const VertexField field = uniform_field(lattice, by);
    expect_whole_pass(field, update(field));
  }
}

TEST_F(Updates, MakeAllAgainAfterWhatTheyDoNotKnow) {
  VertexField field = sample_on(lattice_over(grid_, 8), Bubble{.radius = 25, .strength = 0.3, .centre = {40, 35, 30}});
  update(field);
  const auto then = [&](const char* what) {
    SCOPED_TRACE(what);
    expect_whole_pass(field, update(field));
  };
  field.displacement[20] += glm::vec3(1, 1, 0);
  expect_whole_pass(field, update(field, 5), 5);
  then("another background");
  const Target target = target_there();
  VertexField other = field;
  move_some(other, 0.5, 2);
  device_->set_field(view(other, Outside::background));
  device_->resample({{0, 0, 0}, {91, 70, 20}}, {&target, 1});
  then("a region that was resampled");
  device_->set_field(view(other, Outside::background));
  device_->resample(whole(grid_), {&target, 1});
  then("a whole pass by another field");
  device_->set_field(view(other, Outside::rest));
  device_->update({&target, 1});
  then("an update by claims");
  field = sample_on(lattice_over(grid_, 16), Bubble{.radius = 25, .strength = 0.3, .centre = {40, 35, 30}});
  then("another lattice");
  VertexField mesh;
  mesh.mesh = mesh_of(other);
  expect_whole_pass(mesh, update(mesh));
  then("a mesh");
}

}  // namespace
}  // namespace tetwarp
