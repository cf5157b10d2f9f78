// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// elastix parameter files: beside what they mean on paper, and beside transformix where it is installed.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <glm/geometric.hpp>

#include "io/transform_file.h"
#include "tests/itkbridge/itk_transforms.h"
#include "tests/support/image_samples.h"
#include "tests/support/program.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace tetwarp {
namespace {

const std::string kImage =
    "// what every transform of elastix says of the fixed image\n(FixedImageDimension 3)\n(MovingImageDimension 3)\n"
    "(FixedInternalImagePixelType \"float\")\n(MovingInternalImagePixelType \"float\")\n(Size 20 18 12)\n(Index 0 0 "
    "0)\n"
    "(Spacing 3 3 4)\n(Origin -30 -27 -22)\n(Direction 1 0 0 0 1 0 0 0 1)\n(UseDirectionCosines \"true\")\n"
    "(ResampleInterpolator \"FinalBSplineInterpolator\")\n(FinalBSplineInterpolationOrder 1)\n(Resampler "
    "\"DefaultResampler\")\n(DefaultPixelValue 0)\n"
    "(ResultImageFormat \"mhd\")\n(ResultImagePixelType \"float\")\n(CompressResultImage \"false\")\n";

std::string parameters(const std::string& name, int count, const std::string& values, const std::string& more = "",
                       const std::string& initial = "NoInitialTransform", const std::string& combine = "Compose") {
  return "(Transform \"" + name + "\")\n(NumberOfParameters " + std::to_string(count) + ")\n(TransformParameters " +
         values + ")\n(InitialTransformParametersFileName \"" + initial + "\")\n(HowToCombineTransforms \"" + combine +
         "\")\n" + kImage + more;
}

const std::string kCentre = "(CenterOfRotationPoint 10 -20 30)\n";

std::string affine() {
  return parameters("AffineTransform", 12, "1.1 0.2 -0.1 0.05 0.9 0.15 -0.2 0.1 1.05 3 5 7", kCentre);
}

/// 6 x 5 x 7 coefficients on a turned grid that is counted from (1, 2, -1); one is moved by (3, 5, 7) mm.
std::string spline(const std::string& initial = "NoInitialTransform") {
  std::string values;
  for (int axis = 0; axis < 3; ++axis) {
    for (int n = 0; n < 6 * 5 * 7; ++n)
      values += (n == 2 + 6 * (2 + 5 * 3) ? std::to_string(3 + 2 * axis) : std::string("0")) + " ";
  }
  return parameters("BSplineTransform", 3 * 6 * 5 * 7, values,
                    "(GridSize 6 5 7)\n(GridIndex 1 2 -1)\n(GridSpacing 15 14 13)\n(GridOrigin -60 -50 -26)\n"
                    "(GridDirection 0.96 0.28 0 -0.28 0.96 0 0 0 1)\n(BSplineTransformSplineOrder 3)\n"
                    "(UseCyclicTransform \"false\")\n",
                    initial);
}

std::vector<glm::dvec3> image_points() {
  std::vector<glm::dvec3> points;
  for (int k = 0; k < 12; k += 2) {
    for (int j = 0; j < 18; j += 3) {
      for (int i = 0; i < 20; i += 3) points.emplace_back(-30 + 3 * i, -27 + 3 * j, -22 + 4 * k);
    }
  }
  return points;
}

TEST(ElastixParameters, AffineTurnsAboutItsCentre) {
  const Scratch scratch;
  write_file(scratch / "TransformParameters.0.txt", affine());
  const TransformFile file = read_transform_file(scratch / "TransformParameters.0.txt");
  EXPECT_EQ(file.tool, "elastix");
  EXPECT_EQ(file.direction, Direction::pull);
  for (const glm::dvec3& x : image_points())
    EXPECT_LT(glm::distance(x + file.displacement(x), sheared_about()(x)), 1e-12);
}

TEST(ElastixParameters, EulerSimilarityAndTranslationAreThoseOfItk) {
  const Scratch scratch;
  const std::vector<std::pair<std::string, ItkTransform>> cases = {
      {parameters("EulerTransform", 6, "0.1 0.2 0.3 3 5 7", kCentre + "(ComputeZYX \"false\")\n"),
       {"Euler3DTransform_double_3_3", {10, -20, 30, 0}, {0.1, 0.2, 0.3, 3, 5, 7}}},
      {parameters("EulerTransform", 6, "0.1 0.2 0.3 3 5 7", kCentre + "(ComputeZYX \"true\")\n"),
       {"Euler3DTransform_double_3_3", {10, -20, 30, 1}, {0.1, 0.2, 0.3, 3, 5, 7}}},
      {parameters("SimilarityTransform", 7, "0.1 0.2 0.3 3 5 7 1.25", kCentre),
       {"Similarity3DTransform_double_3_3", {10, -20, 30}, {0.1, 0.2, 0.3, 3, 5, 7, 1.25}}},
      {parameters("TranslationTransform", 3, "3 5 7"), {"TranslationTransform_double_3_3", {}, {3, 5, 7}}}};
  for (const auto& [text, expected] : cases) {
    write_file(scratch / "t.txt", text);
    const TransformFile file = read_transform_file(scratch / "t.txt");
    for (const glm::dvec3& x : image_points())
      ASSERT_LT(glm::distance(x + file.displacement(x), expected(x)), 1e-12) << text.substr(0, 40);
  }
}

TEST(ElastixParameters, TheMovedCoefficientOfASplineIsWhereGridIndexAndDirectionSay) {
  const Scratch scratch;
  write_file(scratch / "t.txt", spline());
  const TransformFile file = read_transform_file(scratch / "t.txt");
  // Coefficient (2, 2, 3) of the grid counted from (1, 2, -1) is sample (3, 4, 2); direction column by column.
  const glm::dvec3 centre = glm::dvec3(-60, -50, -26) + glm::dvec3(0.96, 0.28, 0) * (3 * 15.0) +
                            glm::dvec3(-0.28, 0.96, 0) * (4 * 14.0) + glm::dvec3(0, 0, 1) * (2 * 13.0);
  // There the cubic B-spline is 2/3 along each axis.
  EXPECT_LT(glm::distance(file.displacement(centre), glm::dvec3(3, 5, 7) * (8.0 / 27)), 1e-9);
  EXPECT_LT(
      glm::distance(file.displacement(centre + glm::dvec3(0.96, 0.28, 0) * 15.0), glm::dvec3(3, 5, 7) * (2.0 / 27)),
      1e-9);
}

TEST(ElastixParameters, InitialTransformIsAppliedFirstAndFoundBesideTheFile) {
  const Scratch scratch;
  std::filesystem::create_directory(scratch / "first");
  write_file(scratch / "TransformParameters.0.txt", parameters("TranslationTransform", 3, "100 0 0"));
  write_file(scratch / "TransformParameters.1.txt",
             parameters("EulerTransform", 6, "0 0 1.5 0 0 0", "(CenterOfRotationPoint 0 0 0)\n",
                        "/somewhere/else/TransformParameters.0.txt"));
  const TransformFile file = read_transform_file(scratch / "TransformParameters.1.txt");
  EXPECT_EQ(file.classes, (std::vector<std::string>{"Euler3DTransform_double_3_3", "TranslationTransform_double_3_3"}));
  EXPECT_LT(glm::distance(file.displacement(glm::dvec3(0)), glm::dvec3(100 * std::cos(1.5), 100 * std::sin(1.5), 0)),
            1e-9);
}

TEST(ElastixParameters, CirclesAndOtherBadFilesAreRefused) {
  const Scratch scratch;
  const std::vector<std::pair<std::string, std::string>> cases = {
      {parameters("TranslationTransform", 3, "3 5 7", "", "bad.txt"), "circle"},
      {parameters("TranslationTransform", 3, "3 5 7", "", "second.txt"), "circle"},
      {parameters("TranslationTransform", 3, "3 5 7", "", "absent.txt"),
       "the initial transform absent.txt is not there"},
      {parameters("TranslationTransform", 3, "3 5 7", "", std::string(300, 'x')), "is not there"},
      {parameters("TranslationTransform", 3, "3 5 7", "", "other.txt"), "not an elastix parameter file"},
      {parameters("TranslationTransform", 3, "3 5 7", "", "good.txt", "Add"), "HowToCombineTransforms Add"},
      {parameters("TranslationTransform", 4, "3 5 7"), "NumberOfParameters says 4"},
      {parameters("TranslationTransform", 2, "3 5"), "2 parameters"},
      {parameters("TranslationTransform", 3, "3 nan 7"), "parameter 1 is nan"},
      {parameters("TranslationTransform", 3, "3 five 7"), "\"five\" where a number is expected"},
      {parameters("SplineKernelTransform", 3, "3 5 7"), "the transform \"SplineKernelTransform\" of elastix"},
      {parameters("AffineTransform", 12, "1 0 0 0 1 0 0 0 1 0 0 0"), "no CenterOfRotationPoint"},
      {parameters("TranslationTransform", 3, "3 5 7", "(Spacing 1 1 1)\n"), "a second time"},
      {parameters("TranslationTransform", 3, "3 5 7", "(UseBinaryFormatForTransformationParameters \"true\")\n"),
       "UseBinaryFormatForTransformationParameters true"},
      {parameters("TranslationTransform", 3, "3 5 7").substr(0, 70), "truncated"},
      {spline().substr(0, spline().find("(GridSize")), "no GridSize"},
      {parameters("BSplineTransform", 3, "1 2 3",
                  "(GridSize 100000 100000 100000)\n(GridIndex 0 0 0)\n(GridSpacing 1 1 1)\n(GridOrigin 0 0 0)\n"),
       "its grid needs"},
      {parameters("BSplineTransform", 3, "1 2 3", "(BSplineTransformSplineOrder 2)\n"), "BSplineTransformSplineOrder"},
      {"(Transform \"TranslationTransform\")\n", "no TransformParameters"}};
  write_file(scratch / "good.txt", parameters("TranslationTransform", 3, "3 5 7"));
  write_file(scratch / "other.txt", "#Insight Transform File V1.0\n");
  write_file(scratch / "second.txt", parameters("TranslationTransform", 3, "3 5 7", "", "bad.txt"));
  for (const auto& [text, why] : cases) {
    write_file(scratch / "bad.txt", text);
    EXPECT_TRUE(says(refusal([&] { read_transform_file(scratch / "bad.txt"); }), {"InputError", "bad.txt", why}));
  }
}

TEST(ElastixParameters, WordsOfTomlAreNoNumbers) {
  const Scratch scratch;
  const std::string good =
      "NumberOfParameters = 3\nTransform = \"TranslationTransform\"\nTransformParameters = [3, 5, 7]\n"
      "FixedImageDimension = 3\nMovingImageDimension = 3\nInitialTransformParameterFileName = \"NoInitialTransform\"\n"
      "HowToCombineTransforms = \"Compose\"\n";
  const auto read = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    text.replace(text.find(from), from.size(), to);
    write_file(scratch / "a.toml", text);
    return refusal([&] { read_transform_file(scratch / "a.toml"); });
  };
  EXPECT_EQ(read("[3, 5, 7]", "[3.0, 5, 7]"), "");
  EXPECT_TRUE(says(read("[3, 5, 7]", "[\"three\", 5, 7]"), {"where a number is expected", "a.toml"}));
  EXPECT_TRUE(says(read("[3, 5, 7]", "1979-05-27"), {"where a number is expected", "a.toml"}));
  EXPECT_TRUE(says(read("[3, 5, 7]", "[3, [0.05], 7]"), {"where a number is expected", "a.toml"}));
}

TEST(ElastixParameters, CharactersBeyondAsciiStandInStringsAndCommentsAlone) {
  const Scratch scratch;
  const auto read = [&](const std::string& text) {
    write_file(scratch / "a.toml", "\xEF\xBB\xBFSize = [3, 5, 7]  # \xC3\xA9 '\n" + text);
    return refusal([&] { read_transform_file(scratch / "a.toml"); });
  };
  const std::string no_transform = read("");
  EXPECT_TRUE(says(no_transform, {"a.toml"}));
  for (const char* taken :
       {"a = \"\xC3\xA9\"\n", "a = '\xC3\xA9'\n", "a = \"\\\"\xC3\xA9\"\n", "a = \"\"\"b\n\xC3\xA9\"\"\"\n"})
    EXPECT_EQ(read(taken), no_transform) << taken;
  for (const char* refused : {"\xC5\x96 = 3\n", "a = \xEF\xB3\xBF\n", "a = \"\" \xC3\xA9\n", "a = \"\\\\\" \xC3\xA9\n"})
    EXPECT_TRUE(says(read(refused), {"line 2", "a.toml", "no TOML"})) << refused;
}

TEST(ElastixParameters, NamesInTomlMayHaveAnyCharacter) {
  const Scratch scratch;
  const auto read = [&](const std::string& name) {
    write_file(scratch / "a.toml",
               "NumberOfParameters = 3\nTransform = \"TranslationTransform\"\nTransformParameters = [3, 5, 7]\n"
               "FixedImageDimension = 3\nMovingImageDimension = 3\nHowToCombineTransforms = \"Compose\"\n"
               "InitialTransformParameterFileName = \"" +
                   name + "\"\n");
    return refusal([&] { read_transform_file(scratch / "a.toml"); });
  };
  for (const std::string name : {"\xC3\xA9.toml", "~7E~.toml", "\xE2\x80\x83.toml"}) {
    EXPECT_TRUE(says(read(name), {"InputError", name}));
    std::filesystem::copy_file(scratch / "a.toml", scratch / name);
    EXPECT_TRUE(says(read(name), {"circle"})) << "it begins with itself";
  }
  EXPECT_TRUE(says(read("\\u007eC3~A9.toml"), {"InputError", "an escaped ~"}));
}

/// Where transformix moves points, or nothing where it is not installed.
std::vector<glm::dvec3> transformix(const std::filesystem::path& folder, const std::string& file,
                                    const std::vector<glm::dvec3>& points) {
  std::string text = "point\n" + std::to_string(points.size()) + "\n";
  for (const glm::dvec3& x : points)
    text += std::to_string(x.x) + " " + std::to_string(x.y) + " " + std::to_string(x.z) + "\n";
  write_file(folder / "points.txt", text);
  const std::string command =
      "cd '" + folder.string() + "' && transformix -def points.txt -tp " + file + " -out . > transformix.out 2>&1";
  if (std::system(command.c_str()) != 0) return {};
  std::vector<glm::dvec3> moved;
  std::istringstream lines(read_text(folder / "outputpoints.txt"));
  for (std::string line; std::getline(lines, line);) {
    const auto at = line.find("OutputPoint = [ ");
    glm::dvec3 x;
    if (at != std::string::npos && std::sscanf(line.c_str() + at + 16, "%lf %lf %lf", &x.x, &x.y, &x.z) == 3)
      moved.push_back(x);
  }
  return moved;
}

TEST(ElastixParameters, TransformixMovesPointsToTheSamePlaces) {
  if (std::system("command -v transformix > /dev/null") != 0) GTEST_SKIP() << "transformix (elastix) is not installed";
  const Scratch scratch;
  write_file(scratch / "affine.txt", affine());
  // Debian's elastix has no SimilarityTransform.
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"affine.txt", affine()},
      {"euler.txt", parameters("EulerTransform", 6, "0.1 0.2 0.3 3 5 7", kCentre + "(ComputeZYX \"false\")\n")},
      {"zyx.txt", parameters("EulerTransform", 6, "0.1 0.2 0.3 3 5 7", kCentre + "(ComputeZYX \"true\")\n")},
      {"translation.txt", parameters("TranslationTransform", 3, "3 5 7")},
      {"spline.txt", spline()},
      {"chain.txt", spline("affine.txt")}};
  for (const auto& [name, text] : cases) {
    write_file(scratch / name, text);
    const std::vector<glm::dvec3> points = image_points(), moved = transformix(scratch.path(), name, points);
    ASSERT_EQ(moved.size(), points.size()) << name << ": " << read_text(scratch / "transformix.out");
    const TransformFile file = read_transform_file(scratch / name);
    double furthest = 0;
    for (std::size_t n = 0; n < points.size(); ++n) {
      ASSERT_LT(glm::distance(points[n] + file.displacement(points[n]), moved[n]), 2e-6)  // six digits are printed
          << name << " at point " << n;
      furthest = std::max(furthest, glm::distance(points[n], moved[n]));
    }
    EXPECT_GT(furthest, 1) << name;
  }
}

}  // namespace
}  // namespace tetwarp
