// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Updates of volumes on the device, frame by frame, against whole passes of the CPU, bit for bit.
#include <cuda_runtime.h>
#include <gtest/gtest.h>

#include <algorithm>
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
    renderer_ = make_renderer(BackendKind::cuda);
    renderer_->set_style({.transfer = transfer_function("ct-bone")});
  }

  Target target_there(double background = -7) {
    return {.source = on_device(view(source_), source_there_->data()),
            .output = on_device(view(held_), output_there_->data()),
            .background = background};
  }
  Report update(const VertexField& field, double background = -7) {
    device_->set_field(view(field, Outside::background));
    const Target target = target_there(background);
    Update update = device_->update({&target, 1});
    changed_ = std::move(update.changed);
    return update.report;
  }
  void expect_whole_pass(const VertexField& field, const Report& found, double background = -7) {
    auto expected = poisoned<std::int16_t>(grid_);
    const Target target{.source = view(source_), .output = view(expected), .background = background};
    cpu_->set_field(view(field, Outside::background));
    const Report report = cpu_->resample(whole(grid_), {&target, 1});
    EXPECT_TRUE(output_there_->download() == expected.voxels);
    EXPECT_EQ(report.covered, found.covered);
    EXPECT_EQ(report.uncovered, found.uncovered);
    EXPECT_EQ(report.inverted, found.inverted);
  }
  /// The picture of what the device holds, by a renderer that was told of each change, and of what it should hold.
  void expect_picture(bool is_first) {
    const std::vector<std::int16_t> there = output_there_->download();
    const Volume<std::int16_t> expected{grid_, there};
    const ViewPlane plane = view_plane({.angle_deg = 40, .width = 60, .height = 50}, grid_);
    std::vector<std::uint8_t> found(3 * 60 * 50), wanted(found.size());
    if (is_first) {
      renderer_->set_volume(on_device(view(expected), output_there_->data()));
    } else {
      renderer_->update_volume(changed_);
    }
    renderer_->render(plane, found);
    const auto on_cpu = make_cpu_renderer();
    on_cpu->set_style({.transfer = transfer_function("ct-bone")});
    on_cpu->set_volume(view(expected));
    on_cpu->render(plane, wanted);
    EXPECT_EQ(found, wanted);
  }
  /// Moves some vertices.
  void move_some(VertexField& field, double share, double mm) {
    for (glm::vec3& moved : field.displacement) {
      if (!random_.chance(share)) continue;
      moved += glm::vec3(mm * glm::dvec3(random_.real(-1, 1), random_.real(-1, 1), random_.real(-1, 1)));
    }
  }

  const Geometry grid_ = unit_grid({91, 70, 58});
  Random random_{test_seed(), 77};
  Volume<std::int16_t> source_{grid_, {}}, held_ = poisoned<std::int16_t>(grid_);
  std::optional<OnDevice<std::int16_t>> source_there_, output_there_;
  std::unique_ptr<ForwardResampler> device_, cpu_;
  std::unique_ptr<Renderer> renderer_;
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
  std::int64_t within = 0;
  for (const Region& region : changed_) {
    const glm::i64vec3 size = region.end - region.begin;
    within += size.x * size.y * size.z;
  }
  EXPECT_GT(within, 0);
  EXPECT_LE(std::count_if(found.begin(), found.end(), [](std::int16_t voxel) { return voxel != 99; }), within);
  EXPECT_GT(std::count(found.begin(), found.end(), 99), std::ptrdiff_t(found.size() * 8 / 10));
  EXPECT_NEAR(static_cast<double>(report.covered), static_cast<double>(covered), 200);
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
