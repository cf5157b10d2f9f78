// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/slice_view.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include "io/lattice_lines.h"
#include "tests/support/fields.h"

namespace tetwarp {
namespace {

using test::unit_grid;

/// Slices without text: a pixel for each voxel.
SliceViewOptions plain(const Geometry& grid) {
  return {.window = {100, 50}, .width = static_cast<int>(grid.size.x), .height = 4096, .caption = {}, .plain = true};
}

template <class V>
Volume<V> volume_of(const Geometry& grid, const std::function<double(const glm::i64vec3&)>& value) {
  Volume<V> volume{grid, {}};
  for (std::int64_t k = 0; k < grid.size.z; ++k)
    for (std::int64_t j = 0; j < grid.size.y; ++j)
      for (std::int64_t i = 0; i < grid.size.x; ++i) volume.voxels.push_back(static_cast<V>(value({i, j, k})));
  return volume;
}

TEST(DirectionLetters, OneAlongAnAxisAndTwoInBetween) {
  EXPECT_EQ(direction_letters({1, 0, 0}), "L");
  EXPECT_EQ(direction_letters({-1, 0, 0}), "R");
  EXPECT_EQ(direction_letters({0, 1, 0}), "P");
  EXPECT_EQ(direction_letters({0, -1, 0}), "A");
  EXPECT_EQ(direction_letters({0, 0, 1}), "S");
  EXPECT_EQ(direction_letters({0, 0, -1}), "I");
  EXPECT_EQ(direction_letters(glm::normalize(glm::dvec3(1, 0.2, 0))), "L");
  EXPECT_EQ(direction_letters(glm::normalize(glm::dvec3(1, -0.8, 0))), "LA");
  EXPECT_EQ(direction_letters(glm::normalize(glm::dvec3(0.6, 0, -1))), "IL");
}

TEST(SliceView, ASliceIsItsVoxelsInTheWindow) {
  const Geometry grid = unit_grid({40, 30, 20});
  const Volume<std::int16_t> volume =
      volume_of<std::int16_t>(grid, [](const glm::i64vec3& v) { return static_cast<double>(v.x + v.y); });
  const SlicePart axial{middle_slice(grid, AnatomicalPlane::axial), {}};
  const Picture picture = draw_slices(view(volume), {&axial, 1}, plain(grid));
  ASSERT_EQ(picture.width(), 40);
  ASSERT_EQ(picture.height(), 30);
  for (const auto& [x, y] : {std::pair{0, 0}, {39, 29}, {11, 22}}) EXPECT_NEAR(picture.at(x, y)[0], 2.55 * (x + y), 1);
}

TEST(SliceView, GoesThroughAPointAndRefusesOneOutside) {
  const Geometry grid = unit_grid({40, 30, 20});
  EXPECT_EQ(slice_through(grid, AnatomicalPlane::axial, {3, 4, 6.4}).voxel, 6);
  EXPECT_EQ(slice_through(grid, AnatomicalPlane::coronal, {3, 4.6, 6}).voxel, 5);
  EXPECT_EQ(slice_through(grid, AnatomicalPlane::sagittal, {3, 4, 6}).voxel, 3);
  EXPECT_THROW(slice_through(grid, AnatomicalPlane::axial, {3, 4, 20}), InputError);
  EXPECT_EQ(region_of(grid, slice_through(grid, AnatomicalPlane::coronal, {3, 4, 6})),
            (Region{{0, 4, 0}, {40, 5, 20}}));
}

TEST(SliceView, AMontageIsThreeSlicesAtOneScale) {
  Geometry grid = unit_grid({40, 30, 20});
  grid.spacing = {1, 2, 3};
  const Volume<std::int16_t> volume = volume_of<std::int16_t>(grid, [](const glm::i64vec3&) { return 100; });
  std::vector<SlicePart> parts;
  for (const AnatomicalPlane plane : {AnatomicalPlane::axial, AnatomicalPlane::coronal, AnatomicalPlane::sagittal})
    parts.push_back({middle_slice(grid, plane), {}});
  SliceViewOptions options = plain(grid);
  options.width = 40 + 40 + 60;
  const Picture picture = draw_slices(view(volume), parts, options);
  EXPECT_EQ(picture.width(), 140);  // 40 and 40 mm across, 60
  EXPECT_EQ(picture.height(), 60);
  options.plain = false;
  options.width = 100;
  options.height = 60;
  EXPECT_THROW(draw_slices(view(volume), parts, options), InputError);
}

TEST(SliceView, OverlaysTintTheVoxelsThatTheyAreAbout) {
  const Geometry grid = unit_grid({40, 30, 20});
  const Volume<std::int16_t> volume = volume_of<std::int16_t>(grid, [](const glm::i64vec3&) { return 50; });
  const Volume<std::uint8_t> coverage = volume_of<std::uint8_t>(grid, [](const glm::i64vec3& v) { return v.x < 20; });
  const Volume<std::uint16_t> owners =
      volume_of<std::uint16_t>(grid, [](const glm::i64vec3& v) { return v.x < 10 ? 3 : 1; });
  const Volume<float> jacobian = volume_of<float>(grid, [](const glm::i64vec3& v) {
    return v.x < 10 ? 2 : v.x < 20 ? 0.5 : v.x < 30 ? -1 : NAN;
  });
  const auto shown = [&](OverlayKind kind, const ConstVolumeView& map) {
    const SlicePart part{middle_slice(grid, AnatomicalPlane::axial), {{kind, map, {}}}};
    return draw_slices(view(volume), {&part, 1}, plain(grid));
  };
  const Picture holes = shown(OverlayKind::coverage, view(coverage)), folds = shown(OverlayKind::folds, view(owners)),
                changes = shown(OverlayKind::jacobian, view(jacobian));
  const Colour grey = holes.at(5, 5);
  EXPECT_EQ(grey[0], grey[1]);
  EXPECT_GT(holes.at(30, 5)[1], holes.at(30, 5)[0] + 50);
  EXPECT_GT(folds.at(5, 5)[0], folds.at(5, 5)[2] + 50);
  EXPECT_EQ(folds.at(30, 5), grey);
  EXPECT_GT(changes.at(5, 5)[0], changes.at(5, 5)[2] + 50);                                    // grown: red
  EXPECT_GT(changes.at(15, 5)[2], changes.at(15, 5)[0] + 50);                                  // shrunk: blue
  EXPECT_GT(std::min(changes.at(25, 5)[0], changes.at(25, 5)[2]), changes.at(25, 5)[1] + 50);  // inside out: violet
  EXPECT_EQ(changes.at(35, 5), grey);
}

TEST(TintScale, NumbersStandForTheTintsOfTheirValues) {
  for (const OverlayKind kind : {OverlayKind::coverage, OverlayKind::folds, OverlayKind::jacobian}) {
    const TintScale scale(kind);
    const std::vector<glm::vec4> colours = scale.colours();
    ASSERT_EQ(colours.size(), 256u);
    EXPECT_EQ(colours[0], glm::vec4(0));
    for (const double value : {-3.0, 0.0, 0.1, 0.5, 0.7, 0.99, 1.0, 1.4, 2.0, 3.0, 50.0}) {
      const Tint tint = tint_of(kind, value);
      const glm::vec4 found = colours[scale.number(value)];
      EXPECT_NEAR(found.a, tint.share, 0.004) << value;
      if (tint.share < 0.01) continue;
      for (int channel = 0; channel < 3; ++channel)
        EXPECT_NEAR(found[channel] * 255, tint.colour[static_cast<std::size_t>(channel)], 1e-3) << value;
    }
  }
  EXPECT_EQ(TintScale(OverlayKind::jacobian).number(NAN), 0);
}

TEST(SliceView, LinesOfTheLatticeAreWhereCellsMeet) {
  const Geometry grid = unit_grid({160, 120, 5});
  const Volume<std::int16_t> volume = volume_of<std::int16_t>(grid, [](const glm::i64vec3&) { return 0; });
  constexpr double kShift = 7;  // what lies at x came from x - 7
  std::vector<glm::vec3> inverse(static_cast<std::size_t>(voxel_count(grid)), glm::vec3(-kShift, 0, 0));
  const ConstVolumeView map{&grid,       whole(grid), VoxelType::f32, 3, std::as_bytes(std::span(inverse)).data(),
                            Memory::host};
  const SlicePart part{middle_slice(grid, AnatomicalPlane::axial),
                       {{OverlayKind::lattice, map, lattice_over(grid, 20)}}};
  const Picture picture = draw_slices(view(volume), {&part, 1}, plain(grid));
  int lines = 0;
  for (int x = 1; x < 160; ++x) {
    if (picture.at(x, 30)[2] == 0) continue;
    ++lines;
    EXPECT_NEAR(std::remainder(x - kShift, 20), 0, 1) << x;
  }
  EXPECT_EQ(lines, 8);
}

TEST(LatticeLines, FollowTheVertices) {
  const Geometry grid = unit_grid({101, 101, 101});
  const VertexField moved = test::uniform_field(lattice_over(grid, 25), {10, 0, -20});
  const ViewPlane plane = view_plane({.width = 200, .height = 200}, grid);
  Picture picture(200, 200);
  draw_lattice(picture, plane, moved);
  const auto is_lit = [&](const glm::dvec3& point) {
    const glm::dvec3 at = plane.project(point);
    const int x = static_cast<int>(at.x), y = static_cast<int>(at.y);
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx)
        if (picture.at(x + dx, y + dy)[2] > 0) return true;
    return false;
  };
  for (const double x : {0, 25, 50, 75})
    for (const double z : {50, 75, 100}) {
      EXPECT_TRUE(is_lit({x + 10, 50, z - 20}));
      EXPECT_TRUE(is_lit({x + 10, 50, z - 20 - 12}));  // on a line between two
      EXPECT_FALSE(is_lit({x + 10 + 12, 50, z - 20 - 12}));
    }
}

}  // namespace
}  // namespace tetwarp
