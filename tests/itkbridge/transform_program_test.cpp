// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Transforms through the program: -f, --pull-field, field, info; and what it refuses.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>
#include <nlohmann/json.hpp>

#include "io/field_file.h"
#include "io/image_file.h"
#include "tests/itkbridge/itk_transforms.h"
#include "tests/support/image_samples.h"
#include "tests/support/program.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace {

using namespace tetwarp;

/// 16 x 15 x 14 voxels in most of `spline_grid`'s domain, on axes of its own.
Geometry volume_grid() {
  Geometry grid = oblique_grid();
  grid.size = {16, 15, 14};
  grid.spacing = {2.2, 1.6, 2.2};
  grid.origin = point_from_index(spline_grid())(glm::dvec3(1.2, 1.1, 1.3));
  return grid;
}

glm::dvec3 middle_of(const Geometry& grid) {
  return point_from_index(grid)(glm::dvec3(grid.size - std::int64_t{1}) / 2.0);
}

/// A value that says where it was: linear in x, y, z, so that trilinear sampling is exact.
double value_at(const glm::dvec3& x) { return 2 * x.x + 3 * x.y - 5 * x.z; }

void write_ramp(const std::filesystem::path& path, const Geometry& grid) {
  AnyVolume volume(grid, VoxelType::f32);
  const AffineMap place = point_from_index(grid);
  std::size_t n = 0;
  for (std::int64_t k = 0; k < grid.size.z; ++k) {
    for (std::int64_t j = 0; j < grid.size.y; ++j) {
      for (std::int64_t i = 0; i < grid.size.x; ++i)
        volume.as<float>()[n++] = static_cast<float>(value_at(place(glm::dvec3(i, j, k))));
    }
  }
  write_image(path, volume.view());
}

/// The largest difference between the samples of a field and T(x) - x.
double largest_difference(const Geometry& grid, const std::vector<glm::vec3>& displacement, const ItkTransform& of) {
  const AffineMap place = point_from_index(grid);
  double largest = 0;
  std::size_t n = 0;
  for (std::int64_t k = 0; k < grid.size.z; ++k) {
    for (std::int64_t j = 0; j < grid.size.y; ++j) {
      for (std::int64_t i = 0; i < grid.size.x; ++i) {
        const glm::dvec3 x = place(glm::dvec3(i, j, k));
        const double off = glm::distance(x + glm::dvec3(displacement.at(n++)), of(x));
        largest = off <= largest ? largest : (off > largest ? off : INFINITY);
      }
    }
  }
  return largest;
}

TEST(TransformProgram, ForwardEveryVertexGoesToT) {
  const Scratch scratch;
  write_ramp(scratch / "in.mha", volume_grid());
  const std::vector<std::pair<std::string, ItkTransform>> all = {
      {"affine.tfm", sheared_about(middle_of(volume_grid()))},
      {"spline.h5", one_bump()},
      {"corner.txt", one_corner(spline_grid())}};
  for (const auto& [name, transform] : all) {
    transform.write(scratch / name);
    const Outcome run =
        run_tetwarp(scratch.path(), "field " + name + " --like in.mha -o " + name + ".mha --cell-size 2");
    ASSERT_EQ(run.status, 0) << run.err;
    EXPECT_TRUE(says(run.err, {name + " does not say its direction: taken as forward"}));
    const VertexField field = read_forward_field(scratch / (name + ".mha"));
    EXPECT_EQ(field.lattice.size, lattice_over(volume_grid(), 2).size);
    EXPECT_LT(largest_difference(field.lattice, field.displacement, transform), 1e-5) << name;
  }
}

TEST(TransformProgram, ForwardsComposeInTheOrderOfTheCommandLine) {
  const Scratch scratch;
  write_ramp(scratch / "in.mha", volume_grid());
  const ItkTransform turn("Euler3DTransform_double_3_3", {0, 0, 0, 0}, {0, 0, 0.5, 0, 0, 0});
  const ItkTransform shift("TranslationTransform_double_3_3", {}, {100, 0, 0});
  turn.write(scratch / "turn.tfm");
  shift.write(scratch / "shift.h5");
  const Outcome run = run_tetwarp(scratch.path(), "field shift.h5 turn.tfm --like in.mha -o both.mha --cell-size 3");
  ASSERT_EQ(run.status, 0) << run.err;
  const VertexField field = read_forward_field(scratch / "both.mha");
  // ITK's composite applies the last added first.
  const ItkTransform both(std::vector<ItkTransform>{turn, shift});
  EXPECT_LT(largest_difference(field.lattice, field.displacement, both), 3e-5);
}

/// The deformed ramp, and that as many of its voxels as `least` hold `expected(p)`.
template <class Expected>
void expect_ramp(const std::filesystem::path& path, const std::filesystem::path& coverage, std::int64_t least,
                 Expected&& expected) {
  const AnyVolume out = read_image(path), covered = read_image(coverage);
  const AffineMap place = point_from_index(out.geometry()), index = index_from_point(volume_grid());
  std::int64_t seen = 0;
  std::size_t n = 0;
  for (std::int64_t k = 0; k < out.geometry().size.z; ++k) {
    for (std::int64_t j = 0; j < out.geometry().size.y; ++j) {
      for (std::int64_t i = 0; i < out.geometry().size.x; ++i, ++n) {
        const glm::dvec3 from = expected(place(glm::dvec3(i, j, k))), at = index(from);
        const bool inside = glm::all(glm::greaterThan(at, glm::dvec3(0.01))) &&
                            glm::all(glm::lessThan(at, glm::dvec3(volume_grid().size) - 1.01));
        if (!inside || covered.as<std::uint8_t>()[n] == 0) continue;
        ++seen;
        ASSERT_NEAR(out.as<float>()[n], value_at(from), 5e-3) << i << " " << j << " " << k;
      }
    }
  }
  EXPECT_GT(seen, least);
}

TEST(TransformProgram, ForwardAndPullAreOppositeDirections) {
  const Scratch scratch;
  write_ramp(scratch / "in.mha", volume_grid());
  const glm::dvec3 by(3, 5, 7);
  const ItkTransform shift("TranslationTransform_double_3_3", {}, {by.x, by.y, by.z});
  for (const std::string name : {"shift.tfm", "shift.h5"}) {
    shift.write(scratch / name);
    const Outcome forward = run_tetwarp(scratch.path(), "deform in.mha --backend cpu --overwrite -f " + name +
                                                            " -o forward.mha --coverage covered.mha");
    ASSERT_EQ(forward.status, 0) << forward.err;
    expect_ramp(scratch / "forward.mha", scratch / "covered.mha", 500, [&](const glm::dvec3& p) { return p - by; });
    const Outcome pull = run_tetwarp(scratch.path(), "deform in.mha --backend cpu --overwrite --pull-field " + name +
                                                         " -o pull.mha --coverage covered.mha");
    ASSERT_EQ(pull.status, 0) << pull.err;
    EXPECT_TRUE(says(pull.err, {"taken as output to input"}));
    expect_ramp(scratch / "pull.mha", scratch / "covered.mha", 500, [&](const glm::dvec3& p) { return p + by; });
  }
}

TEST(TransformProgram, PullTakesEveryVoxelFromTOfItsCentre) {
  const Scratch scratch;
  write_ramp(scratch / "in.mha", volume_grid());
  const std::vector<std::pair<std::string, ItkTransform>> all = {
      {"affine.tfm", sheared_about(middle_of(volume_grid()))},
      {"spline.h5", one_bump()},
      {"corner.txt", one_corner(spline_grid())},
      {"both.h5", ItkTransform(std::vector<ItkTransform>{one_bump(), one_corner(spline_grid())})}};
  for (const auto& [name, transform] : all) {
    transform.write(scratch / name);
    const Outcome run = run_tetwarp(scratch.path(), "deform in.mha --backend cpu --overwrite --pull-field " + name +
                                                        " -o out.mha --coverage c.mha");
    ASSERT_EQ(run.status, 0) << run.err;
    expect_ramp(scratch / "out.mha", scratch / "c.mha", 300, transform);
  }
}

TEST(TransformProgram, SaysHowManyVerticesLieOutsideTheDomain) {
  const Scratch scratch;
  write_ramp(scratch / "in.mha", volume_grid());
  one_bump().write(scratch / "spline.h5");
  const Outcome inside = run_tetwarp(scratch.path(), "field spline.h5 --like in.mha -o a.mha");
  EXPECT_EQ(inside.err.find("outside"), std::string::npos) << inside.err;
  Geometry far = volume_grid();
  far.origin += far.direction[0] * 5000.0;
  write_ramp(scratch / "far.mha", far);
  const Outcome outside = run_tetwarp(scratch.path(), "field spline.h5 --like far.mha -o b.mha");
  ASSERT_EQ(outside.status, 0) << outside.err;
  EXPECT_TRUE(says(outside.err, {"spline.h5: 3360 vertices lie outside its domain"}));
  const Outcome pull =
      run_tetwarp(scratch.path(), "deform far.mha --backend cpu --pull-field spline.h5 -o c.mha --report r.json");
  ASSERT_EQ(pull.status, 0) << pull.err;
  const nlohmann::json report = nlohmann::json::parse(read_text(scratch / "r.json"));
  EXPECT_TRUE(says(report["field"]["notes"].dump(), {"3360 voxels lie outside its domain"}));
}

TEST(TransformProgram, ResultIsIndependentOfThreadCount) {
  const Scratch scratch;
  write_ramp(scratch / "in.mha", volume_grid());
  ItkTransform(std::vector<ItkTransform>{one_bump(), one_corner(spline_grid())}).write(scratch / "t.h5");
  std::vector<std::string> bytes;
  for (const std::string threads : {"1", "2", "8"}) {
    ASSERT_EQ(
        run_tetwarp(scratch.path(), "field t.h5 --like in.mha -o f" + threads + ".mha --threads " + threads).status, 0);
    bytes.push_back(read_bytes(scratch / ("f" + threads + ".mha")));
  }
  EXPECT_TRUE(bytes[0] == bytes[1]);
  EXPECT_TRUE(bytes[0] == bytes[2]);
}

TEST(TransformProgram, InfoTellsWhatATransformIs) {
  const Scratch scratch;
  ItkTransform(std::vector<ItkTransform>{sheared_about(middle_of(volume_grid())), one_bump()}).write(scratch / "t.h5");
  const Outcome run = run_tetwarp(scratch.path(), "info t.h5 --json");
  ASSERT_EQ(run.status, 0) << run.err;
  const nlohmann::json document = nlohmann::json::parse(run.out);
  EXPECT_EQ(document["kind"], "transform");
  EXPECT_EQ(document["tool"], "ITK");
  EXPECT_EQ(document["classes"],
            (std::vector<std::string>{"AffineTransform_double_3_3", "BSplineTransform_double_3_3"}));
  EXPECT_EQ(document["parameters"], 12 + 3 * 7 * 6 * 8);
  EXPECT_EQ(document["frame"], "LPS");
  EXPECT_EQ(document["units"], "mm");
  EXPECT_EQ(document["absolute"], true);
  EXPECT_TRUE(says(run_tetwarp(scratch.path(), "info t.h5").out,
                   {"t.h5: transform", "written by   ITK", "BSplineTransform_double_3_3", "as the option says"}));
}

TEST(TransformProgram, ElastixIsPullByNatureAndSaysSoWithF) {
  const Scratch scratch;
  write_ramp(scratch / "in.mha", volume_grid());
  write_file(scratch / "TransformParameters.0.txt",
             "(Transform \"TranslationTransform\")\n(NumberOfParameters 3)\n(TransformParameters 3 5 7)\n"
             "(InitialTransformParametersFileName \"NoInitialTransform\")\n(HowToCombineTransforms \"Compose\")\n");
  const Outcome pull = run_tetwarp(scratch.path(),
                                   "deform in.mha --backend cpu --pull-field TransformParameters.0.txt -o "
                                   "pull.mha --coverage covered.mha");
  ASSERT_EQ(pull.status, 0) << pull.err;
  EXPECT_EQ(pull.err.find("direction"), std::string::npos) << pull.err;
  expect_ramp(scratch / "pull.mha", scratch / "covered.mha", 500,
              [](const glm::dvec3& p) { return p + glm::dvec3(3, 5, 7); });
  const Outcome forward = run_tetwarp(scratch.path(), "field TransformParameters.0.txt --like in.mha -o f.mha");
  EXPECT_TRUE(says(forward.err, {"transforms of elastix map output to input; taken as forward"}));
  EXPECT_TRUE(says(run_tetwarp(scratch.path(), "info TransformParameters.0.txt").out, {"output to input", "elastix"}));
}

TEST(TransformProgram, BadTransformsAreRefusedAndNothingIsWritten) {
  const Scratch scratch;
  write_ramp(scratch / "in.mha", volume_grid());
  write_file(scratch / "bad.tfm", "no transform");
  for (const std::string command :
       {"deform in.mha -f bad.tfm -o out.mha", "deform in.mha --pull-field bad.tfm -o out.mha",
        "deform in.mha -f bad.tfm -o out.mha --dry-run", "field bad.tfm --like in.mha -o out.mha", "info bad.tfm"}) {
    const Outcome run = run_tetwarp(scratch.path(), command);
    EXPECT_EQ(run.status, 4) << command << run.err;
    EXPECT_TRUE(says(run.err, {"tetwarp: error: not a transform file, bad.tfm"}));
    EXPECT_FALSE(std::filesystem::exists(scratch / "out.mha"));
  }
  sheared_about(middle_of(volume_grid())).write(scratch / "good.tfm");
  EXPECT_EQ(run_tetwarp(scratch.path(), "deform in.mha --pull-field good.tfm --cell-size 2 -o out.mha").status, 2);
  EXPECT_EQ(run_tetwarp(scratch.path(), "deform in.mha --pull-field absent.tfm -o out.mha").status, 4);
}

}  // namespace
