// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// What is seen without a device while something moves: fewer voxels of the same deformed volume.

#include <gtest/gtest.h>

#include <cmath>

#include "backend/factories.h"
#include "deform/fields/lattice_mesh.h"
#include "deform/phantom.h"
#include "view/session/coarse_volume.h"
#include "view/session/sampled_field.h"
#include "view/session/scene.h"

namespace tetwarp::viewer {
namespace {

Geometry grid_of(const glm::i64vec3& size, const glm::dvec3& spacing, const glm::dvec3& origin = glm::dvec3(0)) {
  Geometry grid;
  grid.size = size;
  grid.spacing = spacing;
  grid.origin = origin;
  return grid;
}

/// A displacement that is linear along each axis, so that values between vertices are known.
glm::dvec3 trilinear(const glm::dvec3& p) {
  return {0.1 * p.x - 0.02 * p.y * p.z / 40, 3 - 0.05 * p.z, 0.001 * p.x * p.y * p.z / 40 + 1};
}

VertexField sampled(const Geometry& lattice) {
  VertexField field{lattice, {}};
  const AffineMap point = point_from_index(lattice);
  for (std::int64_t k = 0; k < lattice.size.z; ++k)
    for (std::int64_t j = 0; j < lattice.size.y; ++j)
      for (std::int64_t i = 0; i < lattice.size.x; ++i)
        field.displacement.emplace_back(trilinear(point(glm::dvec3(i, j, k))));
  return field;
}

TEST(SampledField, IsTrilinearBetweenVertices) {
  const VertexField field = sampled(grid_of({7, 6, 5}, {8, 9, 10}, {-20, -15, 3}));
  VertexField samples{grid_of({19, 16, 13}, {2.5, 2.75, 3}, {-19, -14, 3.5}), {}};
  ASSERT_TRUE(sample_field(view(field), samples));
  const VertexField wanted = sampled(samples.lattice);
  ASSERT_EQ(samples.displacement.size(), wanted.displacement.size());
  float worst = 0;
  for (std::size_t n = 0; n < wanted.displacement.size(); ++n)
    worst = std::max(worst, glm::distance(samples.displacement[n], wanted.displacement[n]));
  EXPECT_LT(worst, 1e-5f);
}

TEST(SampledField, AtItsOwnVerticesIsTheField) {
  const VertexField field = sampled(grid_of({4, 5, 6}, {8, 9, 10}, {-20, -15, 3}));
  VertexField samples{field.lattice, {}};
  ASSERT_TRUE(sample_field(view(field), samples));
  EXPECT_EQ(samples.displacement, field.displacement);
}

TEST(SampledField, IsTakenAtTheVoxelsOfEveryCoarseVolume) {
  // The last block of an axis may have fewer voxels, and its middle then lies beyond the last vertex.
  for (const std::int64_t size : {40, 97, 257, 300, 511, 512, 513, 768, 1024}) {
    for (const std::int64_t cell : {4, 8, 16, 32}) {
      const Geometry grid = grid_of({size, 512, 300}, {0.8, 0.9, 1.1});
      const VertexField field = sampled(lattice_over(grid, cell));
      VertexField samples{coarse_grid(grid, coarse_blocks(grid)), {}};
      EXPECT_TRUE(sample_field(view(field), samples)) << size << " voxels, cells of " << cell;
      EXPECT_EQ(samples.displacement.size(), static_cast<std::size_t>(voxel_count(samples.lattice)));
    }
  }
}

TEST(SampledField, IsRefusedWhereTheFieldIsNotALatticeOverAllPoints) {
  const Geometry lattice = grid_of({4, 5, 6}, {8, 9, 10});
  const VertexField field = sampled(lattice);
  const auto refuses = [](const VertexField& one, const Geometry& points) {
    VertexField samples{points, {}};
    return !sample_field(view(one), samples) && samples.displacement.empty();
  };
  EXPECT_TRUE(refuses(field, grid_of({4, 5, 7}, {8, 9, 10})));                // beyond the last vertex
  EXPECT_TRUE(refuses(field, grid_of({4, 5, 6}, {8, 9, 10}, {-4.1, 0, 0})));  // before the first
  Geometry turned = lattice;
  turned.direction = glm::dmat3(glm::dvec3(0, 1, 0), glm::dvec3(-1, 0, 0), glm::dvec3(0, 0, 1));
  EXPECT_TRUE(refuses(field, turned));
  VertexField mesh;
  mesh.mesh = mesh_of(field);
  EXPECT_TRUE(refuses(mesh, lattice));
}

TEST(MovingBlocks, HalveOnlyWhatIsLarge) {
  EXPECT_EQ(moving_blocks(grid_of({512, 512, 300}, glm::dvec3(1))), glm::i64vec3(2));
  EXPECT_EQ(moving_blocks(grid_of({512, 512, 40}, glm::dvec3(1))), glm::i64vec3(2, 2, 1));
  EXPECT_EQ(moving_blocks(grid_of({512, 3, 40}, glm::dvec3(1))), glm::i64vec3(2, 1, 1));
  Geometry uneven = grid_of({512, 512, 300}, glm::dvec3(1));
  uneven.slices.resize(300);
  EXPECT_EQ(moving_blocks(uneven), glm::i64vec3(2, 2, 1));
}

/// A phantom with slices so large that fewer pixels are made of them while something moves.
class MovingScene : public ::testing::Test {
 protected:
  MovingScene() : phantom_(make_phantom({264, 240, 24}, {1.5, 1.6, 5}, 1)), scene_({.source = view(phantom_)}) {
    look_.window = {.width = 2000, .level = 0};
    VertexField field;
    field.lattice = lattice_over(phantom_.geometry, 16);
    const AffineMap point = point_from_index(field.lattice);
    const glm::i64vec3 size = field.lattice.size;
    for (std::int64_t n = 0; n < voxel_count(field.lattice); ++n) {
      const glm::dvec3 p = point(glm::dvec3(n % size.x, n / size.x % size.y, n / (size.x * size.y)));
      field.displacement.emplace_back(12 * std::sin(p.y / 40), 9 * std::cos(p.x / 50), 3 * std::sin(p.x / 60));
    }
    scene_.keep_field(std::move(field));
  }

  /// Mean difference of grey levels between a moving slice and the means of the exact one's pixels.
  double difference(AnatomicalPlane plane, const glm::dvec3& at) {
    const Slice slice = scene_.slice_near(plane, at);
    const PaneImage exact = scene_.slice(slice, look_), quick = scene_.moving_slice(slice, look_);
    const int wide = exact.width / quick.width, high = exact.height / quick.height;
    EXPECT_EQ(exact.width, wide * quick.width);
    EXPECT_EQ(exact.height, high * quick.height);
    EXPECT_GT(wide * high, 1);
    double sum = 0;
    for (int y = 0; y < quick.height; ++y) {
      for (int x = 0; x < quick.width; ++x) {
        double mean = 0;
        for (int n = 0; n < wide * high; ++n)
          mean += exact.pixels[static_cast<std::size_t>((y * high + n / wide) * exact.width + x * wide + n % wide)];
        sum += std::abs(mean / (wide * high) - quick.pixels[static_cast<std::size_t>(y * quick.width + x)]);
      }
    }
    return sum / (quick.width * quick.height);
  }

  Volume<std::int16_t> phantom_;
  Scene scene_;
  SliceLook look_;
};

TEST_F(MovingScene, SlicesShowTheSamePlaceWithFewerPixels) {
  for (const AnatomicalPlane plane : {AnatomicalPlane::axial, AnatomicalPlane::coronal, AnatomicalPlane::sagittal}) {
    const double near = difference(plane, {11, -17, 20});
    EXPECT_LT(near, 3) << static_cast<int>(plane);
    // The bound tells a slice from one four voxels away.
    const Slice slice = scene_.slice_near(plane, {11, -17, 20});
    const glm::dvec3 away =
        8.0 * glm::dvec3(slice.normal_axis == 0, slice.normal_axis == 1, 2.5 * (slice.normal_axis == 2));
    const PaneImage here = scene_.moving_slice(slice, look_),
                    there = scene_.moving_slice(scene_.slice_near(plane, glm::dvec3(11, -17, 20) + away), look_);
    double sum = 0;
    for (std::size_t n = 0; n < here.pixels.size(); ++n) sum += std::abs(here.pixels[n] - there.pixels[n]);
    EXPECT_GT(sum / static_cast<double>(here.pixels.size()), near) << static_cast<int>(plane);
  }
}

TEST_F(MovingScene, TheCoarsePictureShowsTheVolumeThatTheExactOneShows) {
  scene_.set_style({.transfer = transfer_function("ct-skin")});
  const ViewPlane plane = view_plane({.width = 96, .height = 96}, scene_.grid());
  const PaneImage coarse = scene_.volume(plane);
  const std::optional<glm::dvec3> picked = scene_.pick(plane, 48, 48);
  scene_.make_exact();
  const PaneImage exact = scene_.volume(plane);
  const std::optional<glm::dvec3> wanted = scene_.pick(plane, 48, 48);
  ASSERT_TRUE(picked && wanted);
  EXPECT_LT(glm::distance(*picked, *wanted), 5);  // a coarse voxel has a side of 4.5 mm
  double sum = 0;
  for (std::size_t n = 0; n < exact.pixels.size(); ++n) sum += std::abs(exact.pixels[n] - coarse.pixels[n]);
  EXPECT_LT(sum / static_cast<double>(exact.pixels.size()), 4);
  // A field that moves nothing shows another volume.
  VertexField still;
  still.lattice = lattice_over(phantom_.geometry, 16);
  still.displacement.assign(static_cast<std::size_t>(voxel_count(still.lattice)), glm::vec3(0));
  scene_.keep_field(std::move(still));
  const PaneImage before = scene_.volume(plane);
  double moved = 0;
  for (std::size_t n = 0; n < exact.pixels.size(); ++n) moved += std::abs(exact.pixels[n] - before.pixels[n]);
  EXPECT_GT(moved, 1.5 * sum);
}

}  // namespace
}  // namespace tetwarp::viewer
