// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Cubic B-spline control point grids of NiftyReg: by closed form, and beside the formula in NumPy.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "io/field_file.h"
#include "io/image_file.h"
#include "io/transform_file.h"
#include "tests/support/foreign_field.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"

namespace tetwarp {
namespace {

/// Control points 7 x 6 x 8, at no right angle to anything.
Geometry control_grid() {
  Geometry grid = oblique_grid();
  grid.size = {7, 6, 8};
  grid.spacing = {12, 10, 8};
  return grid;
}

/// The file of a grid whose control point (3, 2, 4) is moved by (3, 5, 7) mm, LPS.
void write_one_moved(const std::filesystem::path& path, VoxelType type, const Geometry& grid = control_grid()) {
  AnyVolume volume(grid, type, 3);
  const AffineMap point = point_from_index(grid);
  std::size_t n = 0;
  for (std::int64_t k = 0; k < grid.size.z; ++k) {
    for (std::int64_t j = 0; j < grid.size.y; ++j) {
      for (std::int64_t i = 0; i < grid.size.x; ++i) {
        const bool moved = i == 3 && j == 2 && k == 4;
        const glm::dvec3 lps = point(glm::dvec3(i, j, k)) + glm::dvec3(3, 5, 7) * (moved ? 1.0 : 0.0);
        const glm::dvec3 ras(-lps.x, -lps.y, lps.z);
        for (int c = 0; c < 3; ++c, ++n) {
          if (type == VoxelType::f64) {
            volume.as<double>()[n] = ras[c];
          } else {
            volume.as<float>()[n] = static_cast<float>(ras[c]);
          }
        }
      }
    }
  }
  write_image(path, volume.view());
  std::string bytes = read_bytes(path);
  put(bytes, 56, 2.0F);  // intent_p1
  bytes.replace(328, 11, "NREG_TRANS\0", 11);
  write_file(path, bytes);
}

std::string refused(const std::filesystem::path& path) {
  return refusal([&] { read_transform_file(path); });
}

TEST(NiftyRegSpline, OneMovedControlPointMovesByTheWeightsOfTheSpline) {
  const Scratch scratch;
  const Geometry grid = control_grid();
  const AffineMap point = point_from_index(grid);
  for (const VoxelType type : {VoxelType::f32, VoxelType::f64}) {
    write_one_moved(scratch / "cpp.nii", type);
    ASSERT_TRUE(is_transform_file(scratch / "cpp.nii"));
    EXPECT_FALSE(is_field_file(scratch / "cpp.nii"));
    const TransformFile file = read_transform_file(scratch / "cpp.nii");
    EXPECT_EQ(file.tool, "NiftyReg");
    EXPECT_EQ(file.classes, std::vector<std::string>{"cubic B-spline of 7 x 6 x 8 control points"});
    EXPECT_EQ(file.direction, Direction::pull);
    EXPECT_EQ(file.parameters, 3U * 7 * 6 * 8);
    const auto expect = [&](const glm::dvec3& index, double weight) {
      EXPECT_LT(glm::distance(file.displacement(point(index)), glm::dvec3(3, 5, 7) * weight), 3e-5)
          << index.x << " " << index.y << " " << index.z;
    };
    // One axis: 2/3 at the control point, 1/6 at its neighbours, 23/48 half way, 1/48 one and a half away, then 0.
    expect({3, 2, 4}, 8.0 / 27);
    expect({4, 2, 4}, 2.0 / 27);
    expect({3, 2.5, 4}, 4.0 / 9 * 23 / 48);
    expect({3, 2, 5.5}, 4.0 / 9 / 48);
    expect({1, 2, 4}, 0);
    EXPECT_EQ(*file.outside, 0U);
  }
}

TEST(NiftyRegSpline, OutermostControlPointsGoOnBeyondTheGrid) {
  const Scratch scratch;
  Geometry grid = control_grid();
  grid.size = {4, 4, 5};  // the moved one is the last of i and of k
  write_one_moved(scratch / "cpp.nii", VoxelType::f64, grid);
  const TransformFile file = read_transform_file(scratch / "cpp.nii");
  const AffineMap point = point_from_index(grid);
  const auto at = [&](const glm::dvec3& index) { return file.displacement(point(index)); };
  const glm::dvec3 moved(3, 5, 7);
  EXPECT_LT(glm::distance(at({3, 2, 4}), moved * (5.0 / 6 * 2 / 3 * 5 / 6)), 1e-4);
  EXPECT_LT(glm::distance(at({1e4, 2, 1e4}), moved * (2.0 / 3)), 1e-4);
  EXPECT_EQ(*file.outside, 2U);
  EXPECT_LT(glm::length(at({-50, 2, -1e4})), 1e-4);
  EXPECT_EQ(*file.outside, 3U);
  at({1 - 1e-5, 1 - 1e-5, 1 - 1e-5});  // the first voxel of the image, as floats have it
  at({2 + 1e-5, 2 + 1e-5, 3 + 1e-5});
  EXPECT_EQ(*file.outside, 3U);
  at({0.9, 2, 2});
  EXPECT_EQ(*file.outside, 4U);
}

/// The largest difference between a transform and the positions of a NiftyReg deformation field.
double largest_difference(const TransformFile& file, const std::filesystem::path& positions) {
  const PullField field = read_pull_field(positions);
  const AffineMap point = point_from_index(field.grid);
  const glm::i64vec3 size = field.grid.size;
  double largest = 0;
  for (std::size_t v = 0; v < field.displacement.size(); ++v) {
    const auto n = static_cast<std::int64_t>(v);
    const glm::dvec3 at = point(glm::dvec3(n % size.x, n / size.x % size.y, n / (size.x * size.y)));
    largest = std::max(largest, glm::distance(file.displacement(at), glm::dvec3(field.displacement[v])));
  }
  return largest;
}

TEST(NiftyRegSpline, AgreesWithTheFormulaInNumPyOnTheImageAndOnATurnedGrid) {
  const Scratch scratch;
  for (const Geometry& any : grids()) {
    Geometry grid = any;
    grid.spacing = {3, 2.5, 4};
    write_field_file(scratch / "f.mha", PullField{grid, corner_displacement(grid)});
    for (const std::string kind : {"spline:corner", "spline:random"}) {
      if (!make_foreign_field(kind, scratch / "f.mha", scratch / "cpp.nii")) GTEST_SKIP() << "python3-nibabel";
      const TransformFile file = read_transform_file(scratch / "cpp.nii");
      // sform and positions are floats, near 230 mm.
      EXPECT_LT(largest_difference(file, scratch / "cpp-index.nii"), 1e-4) << kind;
      EXPECT_EQ(*file.outside, 0U) << kind;
      EXPECT_LT(largest_difference(file, scratch / "cpp-world.nii"), 1e-4) << kind;
      EXPECT_GT(*file.outside, 0U) << kind;
    }
  }
}

TEST(NiftyRegSpline, GoesByTheSformWhereThereIsOne) {
  const Scratch scratch;
  write_one_moved(scratch / "cpp.nii", VoxelType::f64);
  std::string bytes = read_bytes(scratch / "cpp.nii");
  const AffineMap point = point_from_index(control_grid());
  const glm::dvec3 here = point(glm::dvec3(3, 2, 4));
  put(bytes, 254, std::int16_t{2});                 // sform_code: ITK takes the qform then
  put(bytes, 292, get<float>(bytes, 292) + 10.0F);  // srow_x[3]: all control points 10 mm further to the right
  write_file(scratch / "cpp.nii", bytes);
  const TransformFile file = read_transform_file(scratch / "cpp.nii");
  // Their positions did not change, so they are displaced by 10 mm to the left (LPS x) besides.
  EXPECT_LT(glm::distance(file.displacement(here - glm::dvec3(10, 0, 0)),
                          glm::dvec3(10, 0, 0) + glm::dvec3(3, 5, 7) * (8.0 / 27)),
            1e-4);
}

TEST(NiftyRegSpline, BadFilesAreRefusedByName) {
  const Scratch scratch;
  const auto path = scratch / "cpp.nii";
  write_one_moved(path, VoxelType::f32);
  const std::string good = read_bytes(path);
  const auto expect_refused = [&](const std::string& bytes, const std::string& why) {
    write_file(path, bytes);
    EXPECT_TRUE(says(refused(path), {"InputError: ", why, path.string()}));
  };
  const auto with = [&](std::size_t at, auto value) {
    std::string bytes = good;
    put(bytes, at, value);
    return bytes;
  };
  for (std::size_t n = 0; n < good.size(); n += n < 352 ? 7 : 331) expect_refused(good.substr(0, n), "");
  expect_refused(with(42, std::int16_t{32767}), "promises too much");
  expect_refused(with(352 + 4 * 9, NAN), "control point (2, 1, 0) is not finite");
  expect_refused(with(352 + 4 * 9, INFINITY), "control point (2, 1, 0) is not finite");
  expect_refused(with(352 + 4 * 9, 1e30F), "control point (2, 1, 0) is not finite, or beyond 1e9 mm");
  expect_refused(with(108, 368.0F) + std::string(16, '\0'), "header extensions");
  for (std::size_t at = 0; at < 352; ++at) {
    for (const char byte : {'9', '\x7f', '\xff'}) {
      write_file(path, with(at, byte));
      const std::string text = refused(path);
      EXPECT_TRUE(text.empty() || text.starts_with("InputError: ")) << at << ": " << text;
    }
  }
  Geometry flat = control_grid();
  flat.size.z = 3;
  write_one_moved(path, VoxelType::f32, flat);
  EXPECT_TRUE(says(refused(path), {"a grid of 7 x 6 x 3 control points", "expected at least 4 on every axis"}));
}

TEST(NiftyRegSpline, OtherKindsStayFieldsThatAreRefused) {
  const Scratch scratch;
  for (const float kind : {3.0F, 4.0F, 5.0F, 6.0F}) {
    write_one_moved(scratch / "cpp.nii", VoxelType::f32);
    std::string bytes = read_bytes(scratch / "cpp.nii");
    put(bytes, 56, kind);
    write_file(scratch / "cpp.nii", bytes);
    EXPECT_FALSE(is_transform_file(scratch / "cpp.nii")) << kind;
    EXPECT_TRUE(
        says(error_of(scratch / "cpp.nii"), {"InputError: a ", "of NiftyReg (intent_p1", "reg_transform -disp"}));
  }
  write_image(scratch / "image.nii", numbered(control_grid(), VoxelType::i16).view());
  EXPECT_FALSE(is_transform_file(scratch / "image.nii"));
  EXPECT_FALSE(is_transform_file(scratch / "none.nii"));
}

}  // namespace
}  // namespace tetwarp
