// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Transform files that ITK wrote, read by the library, beside ITK's own TransformPoint.
#include "io/transform_file.h"

#include <gtest/gtest.h>

#include <zlib.h>

#include <algorithm>
#include <glm/geometric.hpp>
#include <random>

#include "tests/itkbridge/itk_transforms.h"
#include "tests/support/image_samples.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace tetwarp {
namespace {

const std::vector<std::string> kNames = {"t.h5", "t.tfm", "t.txt"};

/// Points in and around a grid: the samples, and as many between and beyond them.
std::vector<glm::dvec3> points_around(const Geometry& grid) {
  std::vector<glm::dvec3> points;
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> share(-0.3, 1.3);
  const AffineMap place = point_from_index(grid);
  for (std::int64_t k = 0; k < grid.size.z; ++k) {
    for (std::int64_t j = 0; j < grid.size.y; ++j) {
      for (std::int64_t i = 0; i < grid.size.x; ++i) {
        points.push_back(place(glm::dvec3(i, j, k)));
        points.push_back(place(glm::dvec3(share(random), share(random), share(random)) * glm::dvec3(grid.size)));
      }
    }
  }
  return points;
}

/// The largest distance between where the file and ITK's own transform move points; NaN counts as infinite.
double largest_difference(const TransformFile& file, const ItkTransform& expected,
                          const std::vector<glm::dvec3>& points) {
  double largest = 0;
  for (const glm::dvec3& point : points) {
    const double off = glm::distance(point + file.displacement(point), expected(point));
    largest = off <= largest ? largest : (off > largest ? off : INFINITY);
  }
  return largest;
}

TEST(TransformFile, AffineAboutACentreIsItksOwn) {
  const Scratch scratch;
  for (const std::string& name : kNames) {
    sheared_about().write(scratch / name);
    const TransformFile file = read_transform_file(scratch / name);
    EXPECT_EQ(file.classes, std::vector<std::string>{"AffineTransform_double_3_3"});
    EXPECT_EQ(file.parameters, 12U);
    EXPECT_EQ(file.tool, "ITK");
    EXPECT_FALSE(file.direction.has_value());
    EXPECT_LT(largest_difference(file, sheared_about(), points_around(oblique_grid())), 1e-12) << name;
    EXPECT_EQ(*file.outside, 0U);
  }
}

TEST(TransformFile, EveryAffineLikeClassIsItksOwn) {
  const Scratch scratch;
  const std::vector<double> centre = {10, -20, 30};
  const std::vector<ItkTransform> all = {
      {"IdentityTransform_double_3_3", {}, {}},
      {"TranslationTransform_double_3_3", {}, {3, 5, 7}},
      {"Euler3DTransform_double_3_3", {10, -20, 30, 0}, {0.1, 0.2, 0.3, 3, 5, 7}},
      {"Euler3DTransform_double_3_3", {10, -20, 30, 1}, {0.1, 0.2, 0.3, 3, 5, 7}},
      {"VersorTransform_double_3_3", centre, {0.1, 0.2, 0.3}},
      {"VersorRigid3DTransform_double_3_3", centre, {0.1, 0.2, 0.3, 3, 5, 7}},
      {"QuaternionRigidTransform_double_3_3", centre, {0.1, 0.2, 0.3, 0.9, 3, 5, 7}},
      {"Similarity3DTransform_double_3_3", centre, {0.1, 0.2, 0.3, 3, 5, 7, 1.25}},
      {"ScaleTransform_double_3_3", centre, {1.1, 0.9, 1.3}},
      {"ScaleVersor3DTransform_double_3_3", centre, {0.1, 0.2, 0.3, 3, 5, 7, 1.1, 0.9, 1.3}}};
  for (const ItkTransform& transform : all) {
    for (const std::string& name : kNames) {
      transform.write(scratch / name);
      const TransformFile file = read_transform_file(scratch / name);
      EXPECT_LT(largest_difference(file, transform, points_around(oblique_grid())), 1e-12) << file.classes.front();
    }
  }
}

TEST(TransformFile, TheBaseClassOfAntsAndOfInversesIsAnAffineTransform) {
  const Scratch scratch;
  // The order of rotations, which files of the inverse of an Euler3DTransform have, too.
  for (const char* order : {"", " 0", " 1"}) {
    write_file(
        scratch / "t.txt",
        std::string("#Insight Transform File V1.0\n#Transform 0\nTransform: MatrixOffsetTransformBase_double_3_3\n"
                    "Parameters: 1.1 0.2 -0.1 0.05 0.9 0.15 -0.2 0.1 1.05 3 5 7\nFixedParameters: 10 -20 30") +
            order + "\n");
    EXPECT_LT(
        largest_difference(read_transform_file(scratch / "t.txt"), sheared_about(), points_around(oblique_grid())),
        1e-12);
  }
}

TEST(TransformFile, SplineWithOneMovedCoefficientIsItksOwnInsideAndOutside) {
  const Scratch scratch;
  const std::vector<glm::dvec3> points = points_around(spline_grid());
  std::uint64_t unmoved = 0;
  for (const std::string& name : kNames) {
    one_bump().write(scratch / name);
    const TransformFile file = read_transform_file(scratch / name);
    EXPECT_EQ(largest_difference(file, one_bump(), points), 0) << name;
    double furthest = 0;
    for (const glm::dvec3& point : points) furthest = std::max(furthest, glm::length(file.displacement(point)));
    EXPECT_GT(furthest, 2) << "the coefficient moves something";
    // The domain is one sample narrower than the grid on each side.
    const AffineMap index = index_from_point(spline_grid());
    unmoved = 0;
    for (const glm::dvec3& point : points) {
      const glm::dvec3 at = index(point);
      bool inside = true;
      for (int axis = 0; axis < 3; ++axis) {
        inside = inside && at[axis] > 1 - 1e-9 && at[axis] < static_cast<double>(spline_grid().size[axis] - 2) + 1e-9;
      }
      unmoved += !inside;
    }
    EXPECT_GT(unmoved, 0U);
    // Twice through all points. At the very edge ITK decides by the last bits.
    EXPECT_NEAR(static_cast<double>(*file.outside), 2.0 * static_cast<double>(unmoved), 2 * 4 * 5 * 5) << name;
  }
}

TEST(TransformFile, AsymmetricCornerOfADisplacementFieldLandsWhereItBelongs) {
  const Scratch scratch;
  for (const Geometry& grid : {oblique_grid(), all_orientations()[5], all_orientations()[42]}) {
    for (const std::string& name : kNames) {
      one_corner(grid).write(scratch / name);
      const TransformFile file = read_transform_file(scratch / name);
      EXPECT_EQ(largest_difference(file, one_corner(grid), points_around(grid)), 0) << name;
      const glm::dvec3 by = file.displacement(point_from_index(grid)(glm::dvec3(3, 1, 2)));
      EXPECT_LT(glm::distance(by, glm::dvec3(3, 5, 7)), 1e-9) << name;
      EXPECT_LT(glm::length(file.displacement(point_from_index(grid)(glm::dvec3(0, 1, 2)))), 1e-9) << name;
    }
  }
}

TEST(TransformFile, CompositeAppliesTheLastAddedFirst) {
  const Scratch scratch;
  const ItkTransform turn("Euler3DTransform_double_3_3", {0, 0, 0, 0}, {0, 0, 1.5, 0, 0, 0});
  const ItkTransform shift("TranslationTransform_double_3_3", {}, {100, 0, 0});
  const ItkTransform both(std::vector<ItkTransform>{turn, shift, one_corner(oblique_grid())});
  for (const std::string& name : kNames) {
    both.write(scratch / name);
    const TransformFile file = read_transform_file(scratch / name);
    EXPECT_EQ(file.classes.size(), 3U);
    EXPECT_EQ(file.parameters, 6U + 3U + 180U);
    EXPECT_LT(largest_difference(file, both, points_around(oblique_grid())), 1e-12) << name;
    const glm::dvec3 origin = file.displacement(glm::dvec3(0));  // shifted to (100, 0, 0), then turned about z
    EXPECT_LT(glm::distance(origin, glm::dvec3(100 * std::cos(1.5), 100 * std::sin(1.5), 0)), 1e-9) << name;
  }
}

TEST(TransformFile, FloatTransformsAreRead) {
  const Scratch scratch;
  write_file(scratch / "t.tfm",
             "#Insight Transform File V1.0\n#Transform 0\nTransform: TranslationTransform_float_3_3\nParameters: 3 5 "
             "7\nFixedParameters: \n");
  EXPECT_EQ(read_transform_file(scratch / "t.tfm").displacement(glm::dvec3(1, 2, 3)), glm::dvec3(3, 5, 7));
}

// ---- bad input ----

const std::string kMagic = "#Insight Transform File V1.0\n";

std::string affine_text(const std::string& parameters, const std::string& fixed = "0 0 0") {
  return kMagic + "Transform: AffineTransform_double_3_3\nParameters: " + parameters + "\nFixedParameters: " + fixed +
         "\n";
}

std::string grid_text(const std::string& type, const std::string& size, const std::string& spacing = "1 1 1",
                      const std::string& direction = "1 0 0 0 1 0 0 0 1") {
  return kMagic + "Transform: " + type + "\nParameters: 1 2 3\nFixedParameters: " + size + " 0 0 0 " + spacing + " " +
         direction + "\n";
}

TEST(TransformFile, BadTextIsRefusedWithTheFilesName) {
  const Scratch scratch;
  const std::string spline = "BSplineTransform_double_3_3", good = "1 0 0 0 1 0 0 0 1 0 0 0";
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"", "not a transform file"},
      {"hello", "not a transform file"},
      {kMagic, "no transform"},
      {kMagic + "Transform: AffineTransform_double_3_3\n", "truncated"},
      {kMagic + "Transform: AffineTransform_double_3_3\nParameters: " + good + "\n", "no FixedParameters"},
      {kMagic + "Parameters: 1\n", "without a transform"},
      {affine_text(good) + affine_text(good), "2 transforms and no composite"},
      {affine_text("1 0 0 0 1"), "5 parameters of AffineTransform"},
      {affine_text(good + " 9"), "13 parameters of AffineTransform"},
      {affine_text(good, "0 0"), "2 fixed parameters of AffineTransform"},
      {affine_text("nan 0 0 0 1 0 0 0 1 0 0 0"), "parameter 0 is nan"},
      {affine_text("1 0 0 0 inf 0 0 0 1 0 0 0"), "parameter 4 is inf"},
      {affine_text("1 0 0 0 1 0 0 zero 1 0 0 0"), "\"zero\" where a number is expected"},
      {affine_text("1 0 0 0 1e999 0 0 0 1 0 0 0"), "\"1e999\" where a number is expected"},
      {kMagic + "ComponentTransformFile: t.tfm\n", "\"ComponentTransformFile\" in line 2"},
      {kMagic + "Transform: CompositeTransform_double_3_3\n", "no transform"},
      {kMagic + "Transform: CompositeTransform_double_3_3\nTransform: CompositeTransform_double_3_3\n",
       "a composite inside a composite"},
      {kMagic + "Transform: WarpDrive_double_3_3\nParameters: 1\nFixedParameters:\n", "ITK knows no transform"},
      {kMagic + "Transform: Euler2DTransform_double_2_2\nParameters: 1 2 3\nFixedParameters: 0 0\n", "3 dimensions"},
      {kMagic + "Transform: BSplineTransform_double_3_3_2\nParameters: 1\nFixedParameters:\n", "order 3"},
      {kMagic + "Transform: Euler3DTransform_double_3_3\nParameters: 1 2\nFixedParameters: 0 0 0\n", "2 parameters"},
      {grid_text(spline, "100000 100000 100000"), "its grid needs 3000000000000000"},
      {grid_text(spline, "1e300 4 4"), "a grid of"},
      {grid_text(spline, "3 4 4"), "expected a whole number from 4"},
      {grid_text(spline, "4.5 4 4"), "a grid of 4.5"},
      {grid_text(spline, "-4 4 4"), "a grid of -4"},
      {grid_text("DisplacementFieldTransform_double_3_3", "2147483647 2147483647 2147483647"), "its grid needs"},
      {grid_text("DisplacementFieldTransform_double_3_3", "1 1 1", "1 0 1"), "a grid spacing of 0"},
      {grid_text("DisplacementFieldTransform_double_3_3", "1 1 1", "1 1 1", "1 0 0 1 0 0 0 0 1"), "without an inverse"},
      {grid_text("DisplacementFieldTransform_double_3_3", "0 0 0", "0 0 0", "0 0 0 0 0 0 0 0 0"), "a grid of 0"},
      {grid_text("ConstantVelocityFieldTransform_double_3_3", "1 1 1"), "expected an affine one"}};
  for (const auto& [text, why] : cases) {
    write_file(scratch / "t.tfm", text);
    EXPECT_TRUE(says(refusal([&] { read_transform_file(scratch / "t.tfm"); }), {"InputError", "t.tfm", why})) << text;
  }
  EXPECT_TRUE(says(refusal([&] { read_transform_file(scratch / "absent.h5"); }), {"InputError", "absent.h5"}));
}

TEST(TransformFile, EveryTruncationOfAnHdf5FileIsRefused) {
  const Scratch scratch;
  one_corner(oblique_grid()).write(scratch / "whole.h5");
  const std::string bytes = read_bytes(scratch / "whole.h5");
  for (std::size_t size = 0; size < bytes.size(); size += 1 + bytes.size() / 97) {
    write_file(scratch / "t.h5", bytes.substr(0, size));
    EXPECT_TRUE(says(refusal([&] { read_transform_file(scratch / "t.h5"); }), {"InputError", "t.h5"})) << size;
  }
}

TEST(TransformFile, AnyDamagedByteOfCompressedParametersIsRefused) {
  const Scratch scratch;
  one_bump().write(scratch / "whole.h5", true);
  const std::string bytes = read_bytes(scratch / "whole.h5");
  std::vector<std::pair<std::size_t, std::size_t>> streams;  // streams of zlib in the file, and where each ends
  for (std::size_t at = 0; at + 2 < bytes.size(); ++at) {
    if (bytes[at] != '\x78' ||
        (static_cast<unsigned char>(bytes[at]) << 8 | static_cast<unsigned char>(bytes[at + 1])) % 31 != 0)
      continue;
    std::string plain(1 << 20, '\0');
    z_stream stream{};
    ASSERT_EQ(inflateInit(&stream), Z_OK);
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data() + at));
    stream.avail_in = static_cast<uInt>(bytes.size() - at);
    stream.next_out = reinterpret_cast<Bytef*>(plain.data());
    stream.avail_out = static_cast<uInt>(plain.size());
    constexpr std::size_t kNoText = 200;  // bytes: what is shorter is a text of HDF5's, which nobody reads
    if (inflate(&stream, Z_FINISH) == Z_STREAM_END && stream.total_out > kNoText)
      streams.emplace_back(at, at + stream.total_in);
    inflateEnd(&stream);
  }
  ASSERT_FALSE(streams.empty());
  const std::vector<glm::dvec3> points = points_around(spline_grid());
  std::size_t refused = 0, all = 0;
  for (const auto& stream : streams) {
    const std::size_t begin = stream.first, end = stream.second;
    const std::size_t step = std::max<std::size_t>(1, (end - begin) / 40);
    for (std::size_t at = begin; at < end; at += step) {
      std::string damaged = bytes;
      damaged[at] = static_cast<char>(damaged[at] ^ 1 << at % 8);
      write_file(scratch / "t.h5", damaged);
      // A bit that inflating does not look at may be anything; the numbers are then those that were written.
      const std::string why = refusal([&] {
        const TransformFile file = read_transform_file(scratch / "t.h5");
        EXPECT_EQ(largest_difference(file, one_bump(), points), 0) << at - begin << " of " << end - begin;
      });
      EXPECT_TRUE(why.empty() || says(why, {"InputError", "t.h5"})) << why;
      refused += !why.empty();
      ++all;
    }
  }
  EXPECT_GT(10 * refused, 8 * all);
}

TEST(TransformFile, DamagedBytesGiveAnErrorOrNumbersButNeverMore) {
  const Scratch scratch;
  one_corner(oblique_grid()).write(scratch / "whole.h5");
  const std::string bytes = read_bytes(scratch / "whole.h5");
  std::mt19937_64 random(3);
  int refused = 0;
  for (int trial = 0; trial < 300; ++trial) {
    std::string damaged = bytes;
    for (int n = 0; n < 4; ++n) damaged[random() % damaged.size()] = static_cast<char>(random());
    write_file(scratch / "t.h5", damaged);
    const std::string why = refusal([&] { read_transform_file(scratch / "t.h5"); });
    refused += !why.empty();
    if (!why.empty()) {
      EXPECT_TRUE(says(why, {"InputError", "t.h5"})) << trial;
    }
  }
  EXPECT_GT(refused, 30);
}

}  // namespace
}  // namespace tetwarp
