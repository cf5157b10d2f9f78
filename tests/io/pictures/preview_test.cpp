// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/preview.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <glm/geometric.hpp>
#include <iterator>

#include "deform/phantom.h"
#include "io/pictures/preview_layout.h"
#include "io/preview_scale.h"
#include "tests/support/png_picture.h"
#include "tests/support/scratch.h"

namespace tetwarp {
namespace {

using test::read_png;

std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

Picture preview_of(const ConstVolumeView& before, const ConstVolumeView& after) {
  const Scratch scratch;
  write_preview(scratch / "preview.png", before, after, "a title");
  return read_png(scratch / "preview.png");
}

Colour pixel(const Picture& picture, const Rectangle& panel, double across, double below) {
  return picture.at(panel.x + static_cast<int>(across * panel.width), panel.y + static_cast<int>(below * panel.height));
}

/// All 48 ways in which grid axes can run along patient axes, left-handed ones included.
std::vector<glm::dmat3> all_orientations() {
  std::vector<glm::dmat3> result;
  constexpr int kOrders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  for (const auto& order : kOrders) {
    for (int signs = 0; signs < 8; ++signs) {
      glm::dmat3 direction(0);
      for (int axis = 0; axis < 3; ++axis) direction[axis][order[axis]] = signs >> axis & 1 ? -1 : 1;
      result.push_back(direction);
    }
  }
  return result;
}

Geometry uneven_grid(const glm::dmat3& direction) {
  return {.size = {9, 12, 15}, .spacing = {3, 2, 1.5}, .origin = {-11, 7, 30}, .direction = direction};
}

/// 1000 in the patient's right, front, upper octant, the middle included, else 0.
Volume<std::int16_t> right_front_upper_block(const Geometry& grid) {
  Volume<std::int16_t> volume{grid, {}};
  const AffineMap point = point_from_index(grid);
  const glm::dvec3 c = centre(grid);
  const double slack = 1.6;  // beyond half a voxel: the middle slices are in
  for (std::int64_t k = 0; k < grid.size.z; ++k) {
    for (std::int64_t j = 0; j < grid.size.y; ++j) {
      for (std::int64_t i = 0; i < grid.size.x; ++i) {
        const glm::dvec3 d = point(glm::dvec3(i, j, k)) - c;
        volume.voxels.push_back(d.x < slack && d.y < slack && d.z > -slack ? 1000 : 0);
      }
    }
  }
  return volume;
}

TEST(SlicePicture, CornersLieWhereRadiologistsExpectThemForAllOrientations) {
  struct Expected {
    AnatomicalPlane plane;
    glm::dvec3 right, down;
  };
  const Expected planes[] = {{AnatomicalPlane::axial, {1, 0, 0}, {0, 1, 0}},
                             {AnatomicalPlane::coronal, {1, 0, 0}, {0, 0, -1}},
                             {AnatomicalPlane::sagittal, {0, 1, 0}, {0, 0, -1}}};
  for (const glm::dmat3& direction : all_orientations()) {
    const Geometry grid = uneven_grid(direction);
    const AffineMap point = point_from_index(grid);
    for (const Expected& expected : planes) {
      const Slice slice = middle_slice(grid, expected.plane);
      const glm::dvec3 corner = point(slice.index_at(grid, 0, 0));
      const glm::dvec3 right = point(slice.index_at(grid, 1, 0)) - corner,
                       down = point(slice.index_at(grid, 0, 1)) - corner;
      EXPECT_NEAR(glm::dot(right, expected.right), slice.right.length_mm, 1e-9) << orientation_code(grid);
      EXPECT_NEAR(glm::dot(down, expected.down), slice.down.length_mm, 1e-9) << orientation_code(grid);
    }
  }
}

TEST(SlicePicture, LettersNameThePatientDirections) {
  for (const glm::dmat3& direction : all_orientations()) {
    const Geometry grid = uneven_grid(direction);
    const auto letters = [&](AnatomicalPlane plane) {
      const Slice slice = middle_slice(grid, plane);
      return std::string{slice.right.begin, slice.right.end, slice.down.begin, slice.down.end};
    };
    EXPECT_EQ(letters(AnatomicalPlane::axial), "RLAP");
    EXPECT_EQ(letters(AnatomicalPlane::coronal), "RLSI");
    EXPECT_EQ(letters(AnatomicalPlane::sagittal), "APSI");
  }
}

TEST(SlicePicture, ObliqueGridGivesEachPatientAxisAGridAxisOfItsOwn) {
  const double s = std::sqrt(1.0 / 3), h = std::sqrt(0.5), t = std::sqrt(1.0 / 6);
  const glm::dmat3 cube_on_its_corner(s, s, s, h, -h, 0, t, t,
                                      -2 * t);  // two columns are nearest to the same patient axis or tie
  Geometry grid = uneven_grid(cube_on_its_corner);
  std::array<int, 3> axes = patient_to_grid_axes(grid);
  std::sort(axes.begin(), axes.end());
  EXPECT_EQ(axes, (std::array{0, 1, 2}));
  const double c = std::cos(0.4), q = std::sin(0.4);
  grid.direction = glm::dmat3(0, c, q, -1, 0, 0, 0, -q, c);
  EXPECT_EQ(patient_to_grid_axes(grid), (std::array{1, 0, 2}));
}

TEST(SlicePicture, BlockAtRightFrontTopIsUpperLeftForAllOrientations) {
  for (const glm::dmat3& direction : all_orientations()) {
    const auto volume = right_front_upper_block(uneven_grid(direction));
    for (const AnatomicalPlane plane : {AnatomicalPlane::axial, AnatomicalPlane::coronal, AnatomicalPlane::sagittal}) {
      const Slice slice = middle_slice(volume.geometry, plane);
      const std::vector<double> pixels = sample_slice(view(volume), slice, 4, 4);
      const std::vector<double> quarters = {pixels[0], pixels[3], pixels[12], pixels[15]};
      EXPECT_EQ(quarters, (std::vector<double>{1000, 0, 0, 0})) << orientation_code(volume.geometry);
    }
  }
}

TEST(Preview, BlockAtRightFrontTopIsUpperLeftInEveryPanel) {
  const std::vector<glm::dmat3> orientations = all_orientations();
  for (const std::size_t chosen : {0u, 13u, 26u, 47u}) {
    const auto volume = right_front_upper_block(uneven_grid(orientations[chosen]));
    const Picture picture = preview_of(view(volume), view(volume));
    const PreviewLayout layout = layout_preview(volume.geometry);
    for (const std::size_t row : {0u, 1u}) {
      for (const Rectangle& panel : layout.panels[row]) {
        EXPECT_EQ(pixel(picture, panel, 0.2, 0.2), (Colour{255, 255, 255})) << orientation_code(volume.geometry);
        EXPECT_EQ(pixel(picture, panel, 0.8, 0.2), (Colour{0, 0, 0})) << orientation_code(volume.geometry);
        EXPECT_EQ(pixel(picture, panel, 0.2, 0.8), (Colour{0, 0, 0})) << orientation_code(volume.geometry);
        EXPECT_EQ(pixel(picture, panel, 0.8, 0.8), (Colour{0, 0, 0})) << orientation_code(volume.geometry);
      }
    }
  }
}

TEST(Preview, DifferenceOfEqualVolumesIsBlackEverywhere) {
  const auto volume = make_phantom({40, 40, 30}, {10, 10, 10}, 1);
  const Picture picture = preview_of(view(volume), view(volume));
  std::int64_t coloured = 0, seen = 0;
  const PreviewLayout layout = layout_preview(volume.geometry);
  for (const Rectangle& panel : layout.panels[2]) {
    for (int y = 0; y < panel.height; ++y) {
      for (int x = 0; x < panel.width; ++x, ++seen) coloured += picture.at(panel.x + x, panel.y + y) != Colour{0, 0, 0};
    }
  }
  EXPECT_EQ(coloured, 0);
  EXPECT_GT(seen, 100000);
}

TEST(Preview, RiseIsRedAndFallIsBlue) {
  const Geometry grid{.size = {8, 8, 8}};
  const Volume<float> before{grid, std::vector<float>(512, 1.0f)};
  Volume<float> after = before;
  for (std::size_t i = 0; i < 512; ++i) after.voxels[i] += i % 8 < 4 ? 0.5f : -0.5f;
  const Picture picture = preview_of(view(before), view(after));
  const PreviewLayout layout = layout_preview(grid);
  for (const int column : {0, 1}) {
    const Rectangle& panel = layout.panels[2][static_cast<std::size_t>(column)];
    const Colour rise = pixel(picture, panel, 0.2, 0.5), fall = pixel(picture, panel, 0.8, 0.5);
    EXPECT_GT(rise[0], rise[2]);
    EXPECT_LT(fall[0], fall[2]);
  }
}

TEST(Preview, PictureHasTheSizeOfItsLayoutAndIsNotTooLarge) {
  for (const glm::i64vec3 size :
       {glm::i64vec3(16, 16, 16), glm::i64vec3(60, 8, 4), glm::i64vec3(3, 4, 90), glm::i64vec3(2, 90, 2)}) {
    const Volume<std::uint8_t> volume{{.size = size},
                                      std::vector<std::uint8_t>(static_cast<std::size_t>(size.x * size.y * size.z))};
    const Picture picture = preview_of(view(volume), view(volume));
    const PreviewLayout layout = layout_preview(volume.geometry);
    EXPECT_EQ(picture.width(), layout.width);
    EXPECT_EQ(picture.height(), layout.height);
    EXPECT_LE(picture.width(), 1400);
    EXPECT_LE(picture.height(), 1400);
  }
}

TEST(Preview, PanelsKeepMillimetreProportions) {
  const PreviewLayout layout = layout_preview({.size = {100, 80, 20}, .spacing = {1, 2, 5}});  // 100 x 160 x 100 mm
  const auto& [axial, coronal, sagittal] = layout.panels[0];
  EXPECT_NEAR(axial.height / static_cast<double>(axial.width), 1.6, 0.01);
  EXPECT_NEAR(coronal.height / static_cast<double>(coronal.width), 1.0, 0.01);
  EXPECT_NEAR(sagittal.height / static_cast<double>(sagittal.width), 1 / 1.6, 0.01);
  EXPECT_EQ(axial.height, sagittal.width);
}

TEST(Preview, PanelsDoNotOverlapAndLieInThePicture) {
  for (const glm::i64vec3 size : {glm::i64vec3(64, 64, 64), glm::i64vec3(200, 10, 10), glm::i64vec3(10, 10, 300)}) {
    const PreviewLayout layout = layout_preview({.size = size});
    for (std::size_t row = 0; row < 3; ++row) {
      for (std::size_t column = 0; column < 3; ++column) {
        const Rectangle& panel = layout.panels[row][column];
        EXPECT_LT(panel.y + panel.height, row < 2 ? layout.panels[row + 1][column].y : layout.footer_y);
        const int right = panel.x + panel.width;
        EXPECT_LT(right, column < 2 ? layout.panels[row][column + 1].x : layout.legends[row].x);
      }
    }
  }
}

TEST(Preview, SamePictureGivesSameBytesWithoutTime) {
  const auto volume = make_phantom({24, 24, 24}, {17, 17, 12}, 1);
  const Scratch scratch;
  write_preview(scratch / "one.png", view(volume), view(volume), "title");
  write_preview(scratch / "two.png", view(volume), view(volume), "title");
  EXPECT_EQ(bytes_of(scratch / "one.png"), bytes_of(scratch / "two.png"));
  EXPECT_EQ(bytes_of(scratch / "one.png").find("tIME"), std::string::npos);
}

template <class V>
Colour middle_of_ramp() {
  const Geometry grid{.size = {5, 5, 5}};
  Volume<V> volume{grid, std::vector<V>(125)};
  for (std::size_t i = 0; i < 125; ++i) volume.voxels[i] = static_cast<V>(20 * (i % 5));
  const Picture picture = preview_of(view(volume), view(volume));
  return pixel(picture, layout_preview(grid).panels[0][0], 0.5, 0.5);
}

TEST(Preview, EveryVoxelTypeShowsTheSameValuesAlike) {
  const Colour expected = middle_of_ramp<double>();
  EXPECT_NEAR(expected[0], 128, 3);
  EXPECT_EQ(middle_of_ramp<std::uint8_t>(), expected);
  EXPECT_EQ(middle_of_ramp<std::int8_t>(), expected);
  EXPECT_EQ(middle_of_ramp<std::uint16_t>(), expected);
  EXPECT_EQ(middle_of_ramp<std::int16_t>(), expected);
  EXPECT_EQ(middle_of_ramp<std::uint32_t>(), expected);
  EXPECT_EQ(middle_of_ramp<std::int32_t>(), expected);
  EXPECT_EQ(middle_of_ramp<float>(), expected);
}

TEST(Preview, NumbersThatAreNoneHaveTheirOwnColour) {
  const Geometry grid{.size = {6, 6, 6}};
  Volume<float> volume{grid, std::vector<float>(216, NAN)};
  const Picture all = preview_of(view(volume), view(volume));
  EXPECT_EQ(pixel(all, layout_preview(grid).panels[0][0], 0.5, 0.5), kNotANumber);
  EXPECT_EQ(pixel(all, layout_preview(grid).panels[2][0], 0.5, 0.5), kNotANumber);
}

TEST(Preview, WindowIsThatOfCtForHounsfieldUnitsAndOfPercentilesElse) {
  const std::vector<double> ct = {-1000, -100, 40, 1200}, other = {0, 1, 2, 3, 4};
  EXPECT_TRUE(choose_window(ct, VoxelType::i16).hounsfield);
  EXPECT_EQ(choose_window(ct, VoxelType::i16).width, 1500);
  EXPECT_FALSE(choose_window(other, VoxelType::i16).hounsfield);
  EXPECT_EQ(choose_window(other, VoxelType::f32).width, 4);
  EXPECT_EQ(choose_window(other, VoxelType::f32).level, 2);
}

TEST(Preview, PaddingDoesNotDecideTheRangeOfHounsfieldDifferences) {
  EXPECT_EQ(choose_difference_scale(std::vector<double>{-4000, 3000, 0}, true).range, 1000);
  EXPECT_EQ(choose_difference_scale(std::vector<double>{-4000, 3000, 0}, false).range, 5000);
  EXPECT_EQ(choose_difference_scale(std::vector<double>{0.03, 0}, false).range, 0.05);
  EXPECT_TRUE(choose_difference_scale(std::vector<double>{0, 0}, true).none);
}

TEST(Preview, RefusesVolumesOnOtherGridsAndVectors) {
  const Scratch scratch;
  const AnyVolume volume({.size = {4, 4, 4}}, VoxelType::u8), larger({.size = {4, 4, 5}}, VoxelType::u8);
  const AnyVolume moved({.size = {4, 4, 4}, .origin = {0, 0, 0.5}}, VoxelType::u8),
      vectors({.size = {4, 4, 4}}, VoxelType::f32, 3);
  EXPECT_THROW(write_preview(scratch / "p.png", volume.view(), larger.view(), ""), InputError);
  EXPECT_THROW(write_preview(scratch / "p.png", volume.view(), moved.view(), ""), InputError);
  EXPECT_THROW(write_preview(scratch / "p.png", vectors.view(), vectors.view(), ""), InputError);
  EXPECT_FALSE(std::filesystem::exists(scratch / "p.png"));
}

TEST(Preview, FailureToWriteNamesThePath) {
  const Scratch scratch;
  const Geometry grid{.size = {4, 4, 4}};
  const Volume<std::uint8_t> volume{grid, std::vector<std::uint8_t>(64)};
  const std::filesystem::path path = scratch / "no such folder" / "p.png";
  try {
    write_preview(path, view(volume), view(volume), "");
    FAIL() << "written to a folder that does not exist";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find(path.string()), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace tetwarp
