// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// `tetwarp invert`: the inverse of a forward field, as other programs want it.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>

#include "deform/fields/formula.h"
#include "io/field_file.h"
#include "io/image_file.h"
#include "tests/support/program.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace {

using namespace tetwarp;

TEST(Invert, WritesTheKnownInverseOfATwist) {
  const Scratch scratch;
  ASSERT_EQ(run_tetwarp(scratch.path(), "phantom --size 40,36,24 --spacing 3,3,4 --quiet -o in.mha").status, 0);
  const Outcome run =
      run_tetwarp(scratch.path(), "invert twist:angle=30 --like in.mha -o inverse.mha --report report.json");
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_NE(run.err.find("forward after inverse"), std::string::npos) << run.err;
  EXPECT_TRUE(read_field_header(scratch / "inverse.mha").direction == Direction::pull);
  const AnyVolume inverse = read_image(scratch / "inverse.mha");
  const Geometry& grid = inverse.geometry();
  const PointMap known = parse_formula("twist:angle=-30", grid);
  std::uint64_t empty = 0;
  for (std::int64_t n = 0; n < voxel_count(grid); ++n) {
    const float* by = inverse.as<float>().data() + 3 * n;
    empty += std::isnan(by[0]);
    if (std::isnan(by[0])) continue;
    const glm::dvec3 index(n % 40, n / 40 % 36, n / (40 * 36));
    const glm::dvec3 expected = known(point_from_index(grid)(index));
    for (int axis = 0; axis < 3; ++axis) ASSERT_NEAR(by[axis], expected[axis], 2e-3) << n;
  }
  const nlohmann::json report = nlohmann::json::parse(read_text(scratch / "report.json"));
  EXPECT_EQ(report["uncovered"], empty);
  EXPECT_GT(empty, 0U);
  EXPECT_LT(report["forward_after_inverse"]["largest_mm"], 1e-4);
  EXPECT_LT(report["inverse_after_forward"]["largest_mm"], 5e-3);
  EXPECT_GT(report["inverse_after_forward"]["points"], 10000);
}

TEST(Invert, SaysWhereTheFieldFolds) {
  const Scratch scratch;
  ASSERT_EQ(run_tetwarp(scratch.path(), "phantom --size 20,18,12 --spacing 3,3,4 --quiet -o in.mha").status, 0);
  const Outcome run =
      run_tetwarp(scratch.path(), "invert wave:amplitude=40,wavelength=60,along=x --like in.mha -o inverse.nii.gz");
  EXPECT_EQ(run.status, 0);
  EXPECT_NE(run.err.find("folds"), std::string::npos) << run.err;
  EXPECT_EQ(run_tetwarp(scratch.path(), "invert identity --like in.mha -o inverse.txt").status, 2);
  EXPECT_EQ(run_tetwarp(scratch.path(), "invert identity --like in.mha -o in.mha --overwrite").status, 2);
}

/// A smooth pull field of up to 9 mm on a turned and coarser grid that overhangs a phantom of 40 x 36 x 24 voxels.
PullField smooth_pull(const Geometry& volume) {
  Geometry grid;
  grid.size = {34, 34, 28};
  grid.spacing = {7, 6, 6.5};
  grid.direction = glm::dmat3(0.8, 0.6, 0, -0.6, 0.8, 0, 0, 0, 1);
  grid.origin = centre(volume) - grid.direction * (grid.spacing * glm::dvec3(16.5, 16.5, 13.5));
  PullField field{grid, {}};
  const AffineMap point = point_from_index(grid);
  for (int n = 0; n < 34 * 34 * 28; ++n) {
    const glm::dvec3 x = point(glm::dvec3(n % 34, n / 34 % 34, n / (34 * 34))) - centre(volume);
    field.displacement.emplace_back(6 * std::sin(x.y / 20), 5 * std::sin(x.z / 15), 4 * std::sin(x.x / 18) + 2);
  }
  return field;
}

/// Mean and largest difference of two volumes where both are covered.
struct Difference {
  double mean = 0, largest = 0;
  std::size_t voxels = 0;
};

Difference difference(const Scratch& scratch, const std::string& a, const std::string& b) {
  const AnyVolume one = read_image(scratch / (a + ".mha")), other = read_image(scratch / (b + ".mha")),
                  one_covered = read_image(scratch / (a + "-c.mha")),
                  other_covered = read_image(scratch / (b + "-c.mha"));
  Difference result;
  for (std::size_t n = 0; n < one.as<std::int16_t>().size(); ++n) {
    if (!one_covered.as<std::uint8_t>()[n] || !other_covered.as<std::uint8_t>()[n]) continue;
    const double off = std::abs(one.as<std::int16_t>()[n] - other.as<std::int16_t>()[n]);
    result.largest = std::max(result.largest, off);
    result.mean += off;
    ++result.voxels;
  }
  result.mean /= static_cast<double>(result.voxels);
  return result;
}

TEST(Invert, InverseOfAPullFieldIsTheForwardFieldThatDoesTheSame) {
  const Scratch scratch;
  ASSERT_EQ(run_tetwarp(scratch.path(), "phantom --size 40,36,24 --spacing 3,3,4 --quiet -o in.mha").status, 0);
  const Geometry volume = read_image_header(scratch / "in.mha").geometry;
  write_field_file(scratch / "pull.mha", smooth_pull(volume));
  const Outcome run =
      run_tetwarp(scratch.path(), "invert --pull-field pull.mha --like in.mha -o f.mha --report r.json");
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_NE(run.err.find("wrote f.mha: forward field, 40 x 36 x 24 vertices"), std::string::npos) << run.err;
  EXPECT_EQ(run.err.find("beyond"), std::string::npos) << run.err;
  EXPECT_TRUE(read_field_header(scratch / "f.mha").direction == Direction::forward);
  const nlohmann::json report = nlohmann::json::parse(read_text(scratch / "r.json"));
  EXPECT_EQ(report["uncovered"], 0);
  EXPECT_EQ(report["output"]["direction"], "forward");
  EXPECT_LT(report["forward_after_inverse"]["largest_mm"], 1e-4);
  for (const std::string option : {"-f f.mha -o pushed", "--pull-field pull.mha -o pulled", "-f identity -o rest"}) {
    const std::string name = option.substr(option.rfind(' ') + 1);
    ASSERT_EQ(run_tetwarp(scratch.path(), "deform in.mha " + option + ".mha --coverage " + name + "-c.mha").status, 0);
  }
  const Difference same = difference(scratch, "pushed", "pulled"), rest = difference(scratch, "pushed", "rest");
  EXPECT_GT(same.voxels, 40U * 36 * 24 * 6 / 10);
  // Trilinear here, tetrahedra there, between samples 2 voxels apart: of the second order.
  EXPECT_LT(same.mean, 0.05 * rest.mean);
  EXPECT_GT(rest.mean, 20);
}

TEST(Invert, AShiftGivenAsAPullFieldComesBackExactlyWhereItsGridEndsToo) {
  const Scratch scratch;
  ASSERT_EQ(run_tetwarp(scratch.path(), "phantom --size 40,36,24 --spacing 3,3,4 --quiet -o in.mha").status, 0);
  Geometry grid = read_image_header(scratch / "in.mha").geometry;
  grid.size = {20, 18, 12};  // an eighth of the volume
  const std::vector<glm::vec3> shift(20 * 18 * 12, glm::vec3(6, -9, 4));
  write_field_file(scratch / "pull.mha", PullField{grid, shift});
  const Outcome run = run_tetwarp(scratch.path(), "invert --pull-field pull.mha --like in.mha -o f.mha");
  ASSERT_EQ(run.status, 0) << run.err;
  // The voxels on the grid: i from 2 to 21, j from 0 to 14, k from 1 to 12.
  EXPECT_NE(
      run.err.find(std::to_string(40 * 36 * 24 - 20 * 15 * 12) + " of 34560 vertices go beyond the grid of pull.mha"),
      std::string::npos)
      << run.err;
  for (const glm::vec3& d : read_forward_field(scratch / "f.mha").displacement)
    ASSERT_LT(glm::distance(d, glm::vec3(-6, 9, -4)), 1e-5);
}

/// A rotation leads far out of the grid at its corners, where nothing may be continued.
TEST(Invert, AffinePullFieldsAreInvertedExactlyWhereverTheyLead) {
  const Scratch scratch;
  ASSERT_EQ(run_tetwarp(scratch.path(), "phantom --size 40,36,24 --spacing 3,3,4 --quiet -o in.mha").status, 0);
  write_file(scratch / "turn.mat", "0.6 -0.8 0 70\n0.8 0.6 0 -20\n0 0 1 3\n0 0 0 1\n");
  write_file(scratch / "scale.mat", "0.5 0 0 4\n0 2 0 0\n0 0 1 0\n0 0 0 1\n");
  const Outcome run = run_tetwarp(
      scratch.path(),
      "invert --pull-field turn.mat:tool=greedy --pull-field scale.mat:tool=c3d --like in.mha -o inverse.mha");
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_EQ(run.err.find("outermost samples"), std::string::npos) << run.err;
  ASSERT_EQ(run_tetwarp(scratch.path(),
                        "field scale.mat:tool=c3d,invert=yes turn.mat:tool=greedy,invert=yes --like in.mha -o "
                        "exact.mha")
                .status,
            0);
  const VertexField inverse = read_forward_field(scratch / "inverse.mha"),
                    exact = read_forward_field(scratch / "exact.mha");
  ASSERT_EQ(inverse.displacement.size(), exact.displacement.size());
  float largest = 0, length = 0;
  for (std::size_t v = 0; v < exact.displacement.size(); ++v) {
    largest = std::max(largest, glm::distance(inverse.displacement[v], exact.displacement[v]));
    length = std::max(length, glm::length(exact.displacement[v]));
  }
  EXPECT_LT(largest, 2e-3F);  // places of vertices are snapped before they are inverted, here with a factor of two
  EXPECT_GT(length, 100.0F);
}

TEST(Invert, PullFieldsThatCannotBeInvertedAreRefused) {
  const Scratch scratch;
  ASSERT_EQ(run_tetwarp(scratch.path(), "phantom --size 40,36,24 --spacing 3,3,4 --quiet -o in.mha").status, 0);
  const Geometry volume = read_image_header(scratch / "in.mha").geometry;
  PullField field = smooth_pull(volume);
  write_field_file(scratch / "pull.mha", field);
  const auto refused = [&](const std::string& arguments, int status, const std::string& why) {
    const Outcome run = run_tetwarp(scratch.path(), "invert " + arguments + " --like in.mha -o f.mha");
    EXPECT_EQ(run.status, status) << arguments << "\n" << run.err;
    EXPECT_NE(run.err.find(why), std::string::npos) << run.err;
    EXPECT_FALSE(std::filesystem::exists(scratch / "f.mha"));
  };
  refused("identity --pull-field pull.mha", 2, "excludes");
  refused("--pull-field pull.mha --cell-size 2", 2, "--cell-size");
  refused("", 2, "no field");
  refused("--pull-field none.mha", 4, "no such file");
  write_field_file(scratch / "forward.mha", VertexField{field.grid, field.displacement});
  refused("--pull-field forward.mha", 4, "a forward field where a pull field is expected");
  field.displacement[34 * 35 + 3] = glm::vec3(NAN);
  write_field_file(scratch / "gap.mha", field);
  refused("--pull-field gap.mha", 4, "no place at sample (3, 1, 1), where its inverse needs one, gap.mha");
  field = smooth_pull(volume);
  field.grid.origin += glm::dvec3(1e5, 0, 0);
  write_field_file(scratch / "far.mha", field);
  refused("--pull-field far.mha", 4, "lies far from the grid of 40 x 36 x 24 voxels");
}

}  // namespace
