// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// `tetwarp deform --with` and `--grid`: other volumes, and other grids of the output.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include "deform/fields/formula.h"
#include "io/image_file.h"
#include "tests/support/program.h"
#include "tests/support/scratch.h"

namespace {

using namespace tetwarp;

void expect_run(const Scratch& scratch, const std::string& arguments) {
  const Outcome run = run_tetwarp(scratch.path(), arguments);
  ASSERT_EQ(run.status, 0) << arguments << "\n" << run.err;
}

std::vector<std::byte> voxels_of(const std::filesystem::path& path) {
  const AnyVolume volume = read_image(path);
  return {volume.data(), volume.data() + volume.size_bytes()};
}

/// Along axes of its own, its values those of a plane in space: exact between voxels too.
void write_plane(const std::filesystem::path& path, const Geometry& grid) {
  Volume<float> volume{grid, {}};
  const AffineMap point = point_from_index(grid);
  for (std::int64_t k = 0; k < grid.size.z; ++k) {
    for (std::int64_t j = 0; j < grid.size.y; ++j) {
      for (std::int64_t i = 0; i < grid.size.x; ++i) {
        volume.voxels.push_back(static_cast<float>(glm::dot(point(glm::dvec3(i, j, k)), glm::dvec3(0.5, -1, 2)) + 300));
      }
    }
  }
  write_image(path, view(std::as_const(volume)));
}

Geometry turned_grid() {
  const double c = 0.8, s = 0.6;
  return {{11, 9, 7}, {2.5, 3.5, 4.5}, {-12, -8, -9}, glm::dmat3(c, s, 0, -s, c, 0, 0, 0, 1)};
}

Geometry grid_about(const glm::dvec3& middle, const glm::i64vec3& size, const glm::dvec3& spacing,
                    const glm::dmat3& direction) {
  Geometry grid{size, spacing, {0, 0, 0}, direction};
  grid.origin = middle - centre(grid);
  return grid;
}

TEST(Along, AVolumeComesOutAsItDoesAlone) {
  const Scratch scratch;
  expect_run(scratch, "phantom --size 40,36,24 --spacing 3,3,4 --quiet -o ct.mha");
  expect_run(scratch, "phantom --size 22,19,17 --spacing 5,6,5 --seed 7 --quiet -o pet.nrrd");
  const std::string field = " -f twist:angle=20 -f translate:by=2/3/1 --outside background ";
  expect_run(scratch, "deform ct.mha" + field +
                          "-o out.mha --with ct.mha=again.nii --with pet.nrrd=onto.mha:cubic:background=-500 --with "
                          "pet.nrrd=back.nii.gz:own:nearest");
  EXPECT_EQ(voxels_of(scratch / "out.mha"), voxels_of(scratch / "again.nii"));
  // The lattice stays that of ct.mha.
  expect_run(scratch, "field twist:angle=20 translate:by=2/3/1 --like ct.mha -o field.mha");
  const std::string alone = " -f field.mha --outside background ";
  expect_run(scratch, "deform pet.nrrd" + alone + "--grid ct.mha --interpolation cubic --background -500 -o a.mha");
  expect_run(scratch, "deform pet.nrrd" + alone + "--interpolation nearest -o b.mha");
  EXPECT_EQ(voxels_of(scratch / "onto.mha"), voxels_of(scratch / "a.mha"));
  EXPECT_EQ(voxels_of(scratch / "back.nii.gz"), voxels_of(scratch / "b.mha"));
  EXPECT_EQ(read_image_header(scratch / "onto.mha").geometry.size, glm::i64vec3(40, 36, 24));
  EXPECT_TRUE(same_grid(read_image_header(scratch / "back.nii.gz").geometry,
                        read_image_header(scratch / "pet.nrrd").geometry, 1e-4));

  const nlohmann::json with = nlohmann::json::parse(read_text(scratch / "out.mha.json"))["with"];
  ASSERT_EQ(with.size(), 3U);
  EXPECT_EQ(with[1]["interpolation"], "cubic");
  EXPECT_EQ(with[1]["background"], -500.0);
  EXPECT_EQ(with[2]["grid"], "own");
}

TEST(Grid, AnyVolumeMayLendItsGrid) {
  const Scratch scratch;
  write_plane(scratch / "in.mha", {{40, 36, 24}, {3, 2.5, 4}, {-58, -44, -46}, glm::dmat3(1)});
  write_plane(scratch / "turned.mha", turned_grid());
  expect_run(scratch, "deform in.mha -f identity --grid turned.mha -o out.mha");
  const AnyVolume expected = read_image(scratch / "turned.mha"), found = read_image(scratch / "out.mha");
  EXPECT_TRUE(same_grid(found.geometry(), expected.geometry(), 1e-6));
  for (std::size_t n = 0; n < expected.as<float>().size(); ++n) {
    ASSERT_NEAR(found.as<float>()[n], expected.as<float>()[n], 2e-3) << n;
  }
  // Moved by (3, -4, 2) mm, the plane is lower by its slope times that.
  expect_run(scratch, "deform in.mha -f translate:by=3/-4/2 --grid turned.mha -o moved.mha --preview look.png");
  const AnyVolume moved = read_image(scratch / "moved.mha");
  for (std::size_t n = 0; n < expected.as<float>().size(); ++n) {
    ASSERT_NEAR(moved.as<float>()[n], expected.as<float>()[n] - 9.5, 5e-3) << n;
  }
  EXPECT_GT(std::filesystem::file_size(scratch / "look.png"), 1000U);
  EXPECT_EQ(nlohmann::json::parse(read_text(scratch / "moved.mha.json"))["options"]["grid"], "turned.mha");
}

constexpr double kSlope = 2.2913;  ///< change of `write_plane` in a mm: |(0.5, -1, 2)|

double plane(const glm::dvec3& point) { return glm::dot(point, glm::dvec3(0.5, -1, 2)) + 300; }

/// How far inside a grid a place is, or outside (negative), in its voxels.
double depth_in(const Geometry& grid, const glm::dvec3& point) {
  const glm::dvec3 index = index_from_point(grid)(point),
                   room = glm::min(index, glm::dvec3(grid.size - std::int64_t{1}) - index);
  return std::min({room.x, room.y, room.z});
}

/// Whether a file on `expected_grid` shows what the plane of `source` is deformed into by the inverse of `undo`.
/// @param reach  of the field, undeformed
void expect_plane(const std::filesystem::path& path, const Geometry& expected_grid, const Geometry& source,
                  const Geometry& reach, const PointMap& undo, double tolerance, float background) {
  SCOPED_TRACE(path.string());
  const AnyVolume found = read_image(path);
  ASSERT_TRUE(same_grid(found.geometry(), expected_grid, 1e-4));
  const AffineMap point = point_from_index(expected_grid);
  const glm::i64vec3 size = expected_grid.size;
  int inside = 0, outside = 0;
  for (std::int64_t n = 0; n < voxel_count(expected_grid); ++n) {
    const glm::dvec3 at = point(glm::dvec3(n % size.x, n / size.x % size.y, n / (size.x * size.y))), x = at + undo(at);
    // Nearer to a border than the field is exact, and in the half voxel beyond it: other tests.
    const double known = std::min(depth_in(source, x), depth_in(reach, x));
    const float value = found.as<float>()[static_cast<std::size_t>(n)];
    if (known > 0.05) {
      ++inside;
      ASSERT_NEAR(value, plane(x), tolerance) << n;
    } else if (depth_in(source, x) < -0.55 || depth_in(reach, x) < -0.05) {
      ++outside;
      ASSERT_EQ(value, background) << n;
    }
  }
  EXPECT_GT(inside, 300);
  EXPECT_GT(inside + outside, voxel_count(expected_grid) / 2);
}

TEST(Grid, LargerSmallerTurnedAndFinerGridsShowTheSameDeformedPlane) {
  const Scratch scratch;
  const Geometry in{{40, 36, 24}, {3, 2.5, 4}, {-58, -44, -46}, glm::dmat3(1)}, pet = turned_grid();
  // No axis of it is one of the patient's.
  const glm::dmat3 about_x(1, 0, 0, 0, 0.28, 0.96, 0, -0.96, 0.28), about_z(0.8, 0.6, 0, -0.6, 0.8, 0, 0, 0, 1);
  const glm::dmat3 mirror(-1, 0, 0, 0, 1, 0, 0, 0, 1);
  const std::pair<std::string, Geometry> grids[] = {
      {"larger", grid_about(centre(in), {50, 44, 30}, {3, 2.5, 4}, glm::dmat3(1))},
      {"smaller", grid_about(centre(in), {20, 15, 10}, {3, 2.5, 4}, glm::dmat3(1))},
      {"turned", grid_about(centre(in), {21, 30, 19}, {3, 2.5, 4}, about_z * about_x)},
      {"anisotropic", grid_about(centre(in), {70, 9, 31}, {1.1, 7.3, 2.3}, glm::dmat3(1))},
      {"mirrored", grid_about(centre(in), {35, 13, 28}, {2.1, 5.7, 1.9}, about_z * about_x * mirror)}};
  write_plane(scratch / "in.nii.gz", in);
  write_plane(scratch / "pet.mha", pet);
  const PointMap undo = parse_formula("twist:angle=-25", in);
  // Between slices 4 mm apart the twist bends by h^2/8 of its curvature, 90 mm from its axis: 0.016 mm; twice, for
  // the inverse is not affine there either, and 2^-13 voxel an axis.
  constexpr double kTolerance = 0.04 * kSlope;
  for (const auto& [name, grid] : grids) {
    write_plane(scratch / (name + ".nrrd"), grid);
    expect_run(scratch, "deform in.nii.gz -f twist:angle=25 --outside background --background -3000 --grid " + name +
                            ".nrrd -o " + name + ".mha --with pet.mha=" + name + "_pet.nii:background=-4000");
    expect_plane(scratch / (name + ".mha"), grid, in, in, undo, kTolerance, -3000);
    expect_plane(scratch / (name + "_pet.nii"), grid, pet, in, undo, kTolerance, -4000);
  }
  // A volume back onto its own turned grid, whatever the output's.
  expect_run(scratch,
             "deform in.nii.gz -f twist:angle=25 --outside background --grid turned.nrrd -o again.mha --with "
             "pet.mha=own.nrrd:own:background=-4000");
  expect_plane(scratch / "own.nrrd", pet, pet, in, undo, kTolerance, -4000);
}

TEST(Grid, FitHoldsWhateverTheFieldMovesAway) {
  const Scratch scratch;
  expect_run(scratch, "phantom --size 20,18,12 --spacing 3,3,4 --quiet -o in.mha");
  expect_run(scratch, "deform in.mha -f translate:by=-6/9/8 --grid fit -o out.mha");
  const AnyVolume in = read_image(scratch / "in.mha"), out = read_image(scratch / "out.mha");
  ASSERT_EQ(out.geometry().size, glm::i64vec3(22, 21, 14));
  EXPECT_NEAR(glm::distance(out.geometry().origin, in.geometry().origin - glm::dvec3(6, 0, 0)), 0, 1e-4);
  const auto source = in.as<std::int16_t>(), moved = out.as<std::int16_t>();
  const std::int16_t background = *std::min_element(source.begin(), source.end());
  for (std::size_t k = 0; k < 14; ++k) {
    for (std::size_t j = 0; j < 21; ++j) {
      for (std::size_t i = 0; i < 22; ++i) {
        const bool inside = i < 20 && j >= 3 && k >= 2;
        const std::int16_t expected = inside ? source[((k - 2) * 18 + j - 3) * 20 + i] : background;
        ASSERT_EQ(moved[(k * 21 + j) * 22 + i], expected) << i << " " << j << " " << k;
      }
    }
  }
  expect_run(scratch, "deform in.mha -f identity --grid fit -o same.mha");
  EXPECT_EQ(voxels_of(scratch / "in.mha"), voxels_of(scratch / "same.mha"));
  expect_run(scratch, "field identity --like out.mha --cell-size 4 -o wide.mha");  // overhangs, so it grows
  expect_run(scratch, "deform in.mha -f wide.mha --grid fit -o wide_out.mha");
  EXPECT_EQ(read_image_header(scratch / "wide_out.mha").geometry.size, glm::i64vec3(25, 21, 17));
  // A field that leaves out part of the volume is refused, whatever the grid.
  EXPECT_EQ(run_tetwarp(scratch.path(), "deform out.mha -f in.mha --grid fit -o x.mha").status, 4);
}

/// Sum of the density, HU + 1000, of a volume's voxels.
double sum_of(const std::filesystem::path& path) {
  const AnyVolume volume = read_image(path);
  double sum = 0;
  for (const std::int16_t hu : volume.as<std::int16_t>()) sum += hu + 1000;
  return sum;
}

TEST(Preserve, MassIsKeptWhereAllOfItIsCovered) {
  const Scratch scratch;
  expect_run(scratch, "phantom --size 96,90,60 --spacing 3,3,4 --quiet -o in.mha");
  for (const std::string strength : {"0.6", "-0.5"}) {
    const std::string field = "deform in.mha --overwrite -f bubble:radius=90,strength=" + strength;
    expect_run(scratch, field + " -o plain.mha");
    expect_run(scratch, field + " --preserve mass -o kept.mha");
    const double before = sum_of(scratch / "in.mha");
    EXPECT_GT(std::abs(sum_of(scratch / "plain.mha") / before - 1), 5e-3);
    EXPECT_LT(std::abs(sum_of(scratch / "kept.mha") / before - 1), 2e-3);
  }
  EXPECT_EQ(nlohmann::json::parse(read_text(scratch / "kept.mha.json"))["options"]["preserve"], "mass");
  expect_run(scratch, "deform in.mha -f identity --preserve mass -o same.mha");
  EXPECT_EQ(voxels_of(scratch / "in.mha"), voxels_of(scratch / "same.mha"));
  EXPECT_EQ(run_tetwarp(scratch.path(), "deform in.mha --pull-field in.mha --preserve mass -o x.mha").status, 2);
}

}  // namespace
