// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include <array>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numbers>

#include "tests/support/backends.h"
#include "tests/support/fields.h"

namespace tetwarp {
namespace {

using test::oblique_grid;
using test::Random;
using test::seed_text;
using test::test_seed;
using test::unit_grid;

TETWARP_BACKEND_SUITE(Rendered);

/// Red, green, blue of a picture.
struct Image {
  int width = 0;
  std::vector<std::uint8_t> rgb;

  int grey(int x, int y) const {
    return rgb[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x))];
  }
  glm::ivec3 at(int x, int y) const {
    const std::uint8_t* p =
        rgb.data() + 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x));
    return {p[0], p[1], p[2]};
  }
};

Image render(Renderer& renderer, const ConstVolumeView& volume, const RenderStyle& style, const ViewPlane& plane) {
  Image image{plane.width, std::vector<std::uint8_t>(3 * static_cast<std::size_t>(plane.width * plane.height))};
  renderer.set_volume(volume);
  renderer.set_style(style);
  renderer.render(plane, image.rgb);
  return image;
}

/// White of one opacity for a mm, from `from` on; nothing below. Without light.
RenderStyle opaque_from(double from, double opacity) {
  return {
      .transfer = {
          .name = "step",
          .points = {{from - 1, glm::dvec3(1), 0}, {from, glm::dvec3(1), opacity}, {from + 1, glm::dvec3(1), opacity}},
          .gradient = 0}};
}

/// The sum of the values for each mm; `white` of them are white.
RenderStyle summed(double most, double white) {
  return {.transfer = {.name = "sum",
                       .projection = Projection::sum,
                       .points = {{0, glm::dvec3(1), 0}, {most, glm::dvec3(1), most}},
                       .white = white}};
}

RenderStyle brightest(double most) {
  return {.transfer = {.name = "most",
                       .projection = Projection::maximum,
                       .points = {{0, glm::dvec3(0), 0}, {most, glm::dvec3(1), 0}}}};
}

template <class V, class F>
Volume<V> volume_of(const Geometry& grid, F&& value) {
  Volume<V> volume{grid, {}};
  for (std::int64_t k = 0; k < grid.size.z; ++k)
    for (std::int64_t j = 0; j < grid.size.y; ++j)
      for (std::int64_t i = 0; i < grid.size.x; ++i)
        volume.voxels.push_back(static_cast<V>(value(glm::i64vec3(i, j, k))));
  return volume;
}

/// Smooth blobs here and there, and much nothing in between.
Volume<float> blobs(const Geometry& grid, Random& random) {
  std::vector<glm::dvec4> centres;
  for (int n = 0; n < 6; ++n) {
    const glm::dvec3 at = glm::dvec3(random.real(0, 1), random.real(0, 1), random.real(0, 1)) * glm::dvec3(grid.size);
    centres.emplace_back(at, random.real(2, 7));
  }
  return volume_of<float>(grid, [&](const glm::i64vec3& voxel) {
    double value = 0;
    for (const glm::dvec4& blob : centres) {
      const double r = glm::distance(glm::dvec3(voxel), glm::dvec3(blob)) / blob.w;
      if (r < 1) value += 100 * (1 - r * r) * (1 - r * r);
    }
    return value;
  });
}

TEST_P(Rendered, ASlabOfKnownOpacityLetsThroughWhatItsThicknessSays) {
  const auto renderer = GetParam().make_renderer({});
  Geometry grid = unit_grid({24, 40, 24});
  grid.spacing = {1, 0.7, 1.3};
  const Volume<std::int16_t> slab =
      volume_of<std::int16_t>(grid, [](const glm::i64vec3& v) { return v.y >= 10 && v.y < 30 ? 100 : 0; });
  const ViewPlane plane = view_plane({.width = 48, .height = 48}, grid);
  for (const double opacity : {0.02, 0.1, 0.4}) {
    // Half of the step from 0 to 100 lies on either side of the slab's voxel boundaries.
    const double thickness = 20 * 0.7;
    for (const double step : {1.0, 0.5, 0.13}) {
      RenderStyle style = opaque_from(50, opacity);
      style.step_voxels = step;
      const double through = std::pow(1 - opacity, thickness);
      EXPECT_NEAR(render(*renderer, view(slab), style, plane).grey(24, 24), 255 * (1 - through), 1.5)
          << opacity << ", " << step;
      style.background = glm::dvec3(1);
      style.transfer.points[1].colour = style.transfer.points[2].colour = glm::dvec3(0);
      style.transfer.points[0].colour = glm::dvec3(0);
      EXPECT_NEAR(render(*renderer, view(slab), style, plane).grey(24, 24), 255 * through, 1.5)
          << opacity << ", " << step;
    }
  }
}

TEST_P(Rendered, ThroughABallASumIsTheLengthOfTheChord) {
  const auto renderer = GetParam().make_renderer({});
  const Geometry grid = unit_grid({91, 91, 91});
  constexpr double kRadius = 40;
  // At the edge a voxel holds its share of the ball.
  const Volume<float> ball = volume_of<float>(grid, [&](const glm::i64vec3& v) {
    return std::clamp(kRadius - glm::distance(glm::dvec3(v), glm::dvec3(45)) + 0.5, 0.0, 1.0);
  });
  for (const auto& [angle, elevation] : {std::pair{0.0, 0.0}, {37.0, 0.0}, {-120.0, 55.0}}) {
    const ViewPlane plane =
        view_plane({.angle_deg = angle, .elevation_deg = elevation, .width = 101, .height = 101}, grid);
    const Image image = render(*renderer, view(ball), summed(1, 100), plane);
    for (int y = 0; y < 101; ++y) {
      for (int x = 0; x < 101; ++x) {
        const double r = plane.pixel_mm * glm::length(glm::dvec2(x - 50, y - 50));
        const double chord = r < kRadius ? 2 * std::sqrt(kRadius * kRadius - r * r) : 0;
        if (std::abs(r - kRadius) > 1.5) {
          ASSERT_NEAR(image.grey(x, y), 2.55 * chord, 2.5) << x << ", " << y;
        }
      }
    }
  }
}

TEST_P(Rendered, TheSumOfARampIsExact) {
  const auto renderer = GetParam().make_renderer({});
  const Geometry grid = unit_grid({32, 32, 32});
  const Volume<float> ramp = volume_of<float>(grid, [](const glm::i64vec3& v) { return static_cast<double>(v.y); });
  // Half a voxel at both ends has the outermost value: the mean is that of all voxels.
  const ViewPlane plane = view_plane({.width = 32, .height = 32}, grid);
  RenderStyle style = summed(31, 1000);
  style.step_voxels = 0.25;
  EXPECT_NEAR(render(*renderer, view(ramp), style, plane).grey(16, 16), 255 * (31.0 * 32 / 2) / 1000, 1.2);
}

TEST_P(Rendered, ASumHardlyDependsOnTheStep) {
  const auto renderer = GetParam().make_renderer({});
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  Random random(seed);
  const Geometry grid = oblique_grid({80, 70, 60});
  Volume<float> volume = blobs(grid, random);
  for (float& value : volume.voxels) value += static_cast<float>(random.real(0, 5));
  const ViewPlane plane = view_plane({.angle_deg = 33, .elevation_deg = 21, .width = 200, .height = 200}, grid);
  RenderStyle style = summed(100, 4000);
  const Image usual = render(*renderer, view(volume), style, plane);
  style.step_voxels = 0.05;
  const Image fine = render(*renderer, view(volume), style, plane);
  EXPECT_GT(*std::max_element(fine.rgb.begin(), fine.rgb.end()), 20);
  for (std::size_t n = 0; n < fine.rgb.size(); ++n) ASSERT_NEAR(usual.rgb[n], fine.rgb[n], 1) << n;
}

TEST_P(Rendered, TheMaximumIsTheLargestVoxelOnTheWay) {
  const auto renderer = GetParam().make_renderer({});
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  Random random(seed);
  const Geometry grid = unit_grid({16, 30, 16});
  const Volume<std::uint8_t> noise =
      volume_of<std::uint8_t>(grid, [&](const glm::i64vec3&) { return random.integer(0, 255); });
  ViewPlane plane = view_plane({.width = 16, .height = 16}, grid);
  plane.pixel_mm = 1;  // a ray through the centres of the voxels of a row, and a sample at each
  RenderStyle style = brightest(255);
  style.step_voxels = 0.5;
  const Image image = render(*renderer, view(noise), style, plane);
  for (int x = 0; x < 16; ++x) {
    for (int z = 0; z < 16; ++z) {
      int most = 0;
      for (int y = 0; y < 30; ++y)
        most = std::max<int>(most, noise.voxels[static_cast<std::size_t>((z * 30 + y) * 16 + x)]);
      ASSERT_NEAR(image.grey(x, 15 - z), most, 1) << x << ", " << z;
    }
  }
}

/// What is leapt over because it lies below the window changes nothing.
TEST_P(Rendered, AMaximumInAWindowIsTheMaximumThroughThatWindow) {
  const auto renderer = GetParam().make_renderer({});
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  Random random(seed);
  const Geometry grid = oblique_grid({50, 45, 37});
  Volume<float> volume = blobs(grid, random);
  for (std::size_t n = 0; n < volume.voxels.size(); ++n) {
    const double below = static_cast<double>(n) / static_cast<double>(volume.voxels.size());
    volume.voxels[n] = static_cast<float>(0.4 * volume.voxels[n] + 55 * below + random.real(0, 5));
  }
  const ViewPlane plane = view_plane({.angle_deg = 33, .elevation_deg = 21, .width = 150, .height = 150}, grid);
  RenderStyle style = brightest(100);
  style.background = {0, 0, 1};
  const Image whole = render(*renderer, view(volume), style, plane);
  style.transfer.points.front().value = 40;
  const Image image = render(*renderer, view(volume), style, plane);
  int dark = 0, bright = 0;
  for (int y = 0; y < plane.height; ++y) {
    for (int x = 0; x < plane.width; ++x) {
      const bool beside = whole.at(x, y) == glm::ivec3(0, 0, 255);  // no ray through the volume
      ASSERT_EQ(image.at(x, y) == glm::ivec3(0, 0, 255), beside) << x << ", " << y;
      if (beside) continue;
      ASSERT_NEAR(image.grey(x, y), std::clamp((whole.grey(x, y) - 0.4 * 255) / 0.6, 0.0, 255.0), 1.6)
          << x << ", " << y;
      ++(image.grey(x, y) > 0 ? bright : dark);
    }
  }
  EXPECT_GT(dark, 1000);
  EXPECT_GT(bright, 200);
}

/// The marker of a phantom: a bright block towards the patient's left, front and head.
TEST_P(Rendered, LeftFrontAndHeadAreWhereTheyBelong) {
  const auto renderer = GetParam().make_renderer({});
  // The same bodies are rendered from grids whose axes run along other directions.
  for (const glm::dmat3& direction :
       {glm::dmat3(1), glm::dmat3({-1, 0, 0}, {0, -1, 0}, {0, 0, 1}), glm::dmat3({0, 0, 1}, {1, 0, 0}, {0, 1, 0}),
        glm::dmat3({0, 1, 0}, {0, 0, -1}, {-1, 0, 0}), test::rotation({1, 2, 3}, 0.2)}) {
    Geometry grid = unit_grid({40, 40, 40});
    grid.direction = direction;
    grid.origin = -(direction * glm::dvec3(19.5));
    const AffineMap point = point_from_index(grid);
    const Volume<std::int16_t> body = volume_of<std::int16_t>(grid, [&](const glm::i64vec3& v) {
      return glm::distance(point(glm::dvec3(v)), glm::dvec3(10, -9, 8)) < 4 ? 100 : 0;
    });
    struct Expectation {
      double angle, elevation;
      glm::dvec2 at;  ///< mm to the right and down from the middle
    };
    for (const Expectation& of :
         {Expectation{0, 0, {10, -8}}, Expectation{90, 0, {-9, -8}}, Expectation{180, 0, {-10, -8}},
          Expectation{270, 0, {9, -8}}, Expectation{0, 90, {10, 9}}, Expectation{0, -90, {10, -9}}}) {
      const ViewPlane plane =
          view_plane({.angle_deg = of.angle, .elevation_deg = of.elevation, .width = 80, .height = 80}, grid);
      const Image image = render(*renderer, view(body), opaque_from(50, 0.9), plane);
      glm::dvec2 sum(0);
      double weight = 0;
      for (int y = 0; y < 80; ++y) {
        for (int x = 0; x < 80; ++x) {
          sum += glm::dvec2(x - 39.5, y - 39.5) * static_cast<double>(image.grey(x, y));
          weight += image.grey(x, y);
        }
      }
      ASSERT_GT(weight, 0);
      EXPECT_LT(glm::distance(sum / weight * plane.pixel_mm, of.at), 0.3) << of.angle << ", " << of.elevation;
    }
  }
}

TEST_P(Rendered, WhatIsInTheMiddleOfThePictureIsWhatTheCameraLooksAt) {
  const auto renderer = GetParam().make_renderer({});
  const Geometry grid = unit_grid({60, 60, 60});
  const Volume<std::int16_t> body = volume_of<std::int16_t>(
      grid, [&](const glm::i64vec3& v) { return glm::distance(glm::dvec3(v), glm::dvec3(50, 48, 9)) < 3 ? 100 : 0; });
  for (const double angle : {0.0, 70.0, 200.0}) {
    const ViewPlane plane = view_plane({.angle_deg = angle,
                                        .elevation_deg = 30,
                                        .zoom = 8,
                                        .width = 40,
                                        .height = 40,
                                        .target = glm::dvec3(50, 48, 9)},
                                       grid);
    const Image image = render(*renderer, view(body), opaque_from(50, 0.9), plane);
    EXPECT_GT(image.grey(20, 20), 250);
    EXPECT_EQ(image.grey(2, 2), 0);
  }
}

/// Emission and absorption by small steps in double, without blocks, tables or integrals.
double marched(const Volume<float>& volume, const RenderStyle& style, const ViewPlane& plane, int x, int y) {
  const Geometry& grid = volume.geometry;
  const AffineMap index = index_from_point(grid);
  const std::vector<TransferPoint>& points = style.transfer.points;
  constexpr double kStep = 0.02, kFar = 200;
  double light = 0, through = 1;
  for (double along = -kFar; along < kFar; along += kStep) {
    const glm::dvec3 at = index(plane.at(x + 0.5, y + 0.5) + plane.forward * along);
    const glm::dvec3 last(grid.size - std::int64_t{1});
    if (glm::any(glm::lessThan(at, glm::dvec3(-0.5))) || glm::any(glm::greaterThan(at, last + 0.5))) continue;
    const glm::dvec3 inside = glm::clamp(at, glm::dvec3(0), last), low = glm::min(glm::floor(inside), last - 1.0),
                     f = inside - low;
    double value = 0;
    for (int n = 0; n < 8; ++n) {
      const glm::i64vec3 v = glm::i64vec3(low) + glm::i64vec3(n & 1, n >> 1 & 1, n >> 2 & 1);
      value +=
          static_cast<double>(volume.voxels[static_cast<std::size_t>((v.z * grid.size.y + v.y) * grid.size.x + v.x)]) *
          (n & 1 ? f.x : 1 - f.x) * (n & 2 ? f.y : 1 - f.y) * (n & 4 ? f.z : 1 - f.z);
    }
    std::size_t p = 0;
    while (p + 2 < points.size() && points[p + 1].value <= value) ++p;
    const double share = std::clamp((value - points[p].value) / (points[p + 1].value - points[p].value), 0.0, 1.0),
                 opacity = glm::mix(points[p].opacity, points[p + 1].opacity, share),
                 stopped = 1 - std::pow(1 - opacity, kStep);
    light += through * stopped * glm::mix(points[p].colour.x, points[p + 1].colour.x, share);
    through *= 1 - stopped;
  }
  return 255 * (light + through * style.background.x);
}

TEST_P(Rendered, EqualsSmallStepsWithoutSkipping) {
  const auto renderer = GetParam().make_renderer({});
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  for (std::uint64_t number = 0; number < 4; ++number) {
    Random random(seed, number);
    const Geometry grid = number % 2 ? oblique_grid({60, 45, 37}) : unit_grid({50, 70, 41});
    const Volume<float> volume = blobs(grid, random);
    RenderStyle style{.transfer = {.name = "test",
                                   .points = {{8, glm::dvec3(0.2), 0},
                                              {30, glm::dvec3(0.4), 0.1},
                                              {60, glm::dvec3(0.9), 0.02},
                                              {90, glm::dvec3(1), 0.7}},
                                   .gradient = 0},
                      .step_voxels = 0.25,
                      .background = glm::dvec3(0.3)};
    const ViewPlane plane = view_plane(
        {.angle_deg = random.real(0, 360), .elevation_deg = random.real(-90, 90), .width = 40, .height = 40}, grid);
    const Image image = render(*renderer, view(volume), style, plane);
    double sum = 0;
    constexpr int kPixels = 120;
    for (int n = 0; n < kPixels; ++n) {
      const int x = static_cast<int>(random.integer(0, 39)), y = static_cast<int>(random.integer(0, 39));
      const double difference = image.grey(x, y) - marched(volume, style, plane, x, y);
      ASSERT_LT(std::abs(difference), 4) << number << ": " << x << ", " << y;
      sum += std::abs(difference);
    }
    EXPECT_LT(sum / kPixels, 1) << number;
  }
}

/// What is leapt over changes no bit: a second volume has something faint in every block.
TEST_P(Rendered, PicturesDoNotDependOnWhichBlocksAreEmpty) {
  const auto renderer = GetParam().make_renderer({});
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  Random random(seed);
  const Geometry grid = unit_grid({61, 50, 43});
  const Volume<float> sparse = blobs(grid, random);
  RenderStyle style = opaque_from(20, 0.3);
  style.transfer.gradient = 30;
  RenderStyle full = style;  // -5 is nowhere, but each block might hold it: none is empty
  full.transfer.points.insert(full.transfer.points.begin(), {{-10, glm::dvec3(1), 0}, {-5, glm::dvec3(1), 0}});
  const ViewPlane plane = view_plane({.angle_deg = 25, .elevation_deg = 15, .width = 90, .height = 90}, grid);
  const Image image = render(*renderer, view(sparse), style, plane);
  Volume<float> crowded = sparse;
  // Below all that is seen, in every block, and of the opacity of nothing: the second function sees it, with none.
  full.transfer.points[1].opacity = 1e-12;
  for (std::int64_t k = 0; k < grid.size.z; k += 4)
    for (std::int64_t j = 0; j < grid.size.y; j += 4)
      for (std::int64_t i = 0; i < grid.size.x; i += 4) {
        float& value = crowded.voxels[static_cast<std::size_t>((k * grid.size.y + j) * grid.size.x + i)];
        if (value == 0) value = -5;
      }
  const Image other = render(*renderer, view(crowded), full, plane);
  int different = 0;
  for (std::size_t n = 0; n < image.rgb.size(); ++n) different += std::abs(image.rgb[n] - other.rgb[n]) > 3;
  EXPECT_LT(different, static_cast<int>(image.rgb.size() / 100));
  EXPECT_NE(std::count(image.rgb.begin(), image.rgb.end(), 0), static_cast<std::ptrdiff_t>(image.rgb.size()));
}

TEST_P(Rendered, HasTheSameBytesOnEveryBackendAndUnderAnyLimits) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  Random random(seed);
  const Geometry grid = oblique_grid({70, 61, 33});
  const Volume<float> volume = blobs(grid, random);
  RenderStyle lit = opaque_from(20, 0.3);
  lit.transfer.gradient = 20;
  lit.transfer.points[0].colour = {0.9, 0.1, 0.2};
  for (const RenderStyle& style : {lit, summed(100, 900), brightest(100)}) {
    const ViewPlane plane = view_plane(
        {.angle_deg = random.real(0, 360), .elevation_deg = random.real(-80, 80), .width = 130, .height = 97}, grid);
    const Image image = render(*make_cpu_renderer({.threads = 1}), view(volume), style, plane);
    for (const Limits& limits : {Limits{}, Limits{.threads = 2}, Limits{.memory = 1}}) {
      const auto renderer = GetParam().make_renderer(limits);
      EXPECT_EQ(image.rgb, render(*renderer, view(volume), style, plane).rgb)
          << style.transfer.name << ", " << limits.threads << " threads, memory " << limits.memory;
    }
  }
}

/// More of the outermost voxels beside the rays changes nothing: cells at the edges are as those within.
TEST_P(Rendered, EdgesAreAsTheVolumeContinued) {
  const auto renderer = GetParam().make_renderer({});
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  Random random(seed);
  const Geometry grid = unit_grid({9, 14, 11});
  const Volume<std::int16_t> noise =
      volume_of<std::int16_t>(grid, [&](const glm::i64vec3&) { return random.integer(0, 200); });
  constexpr std::int64_t kMore = 3;  // columns and slices on both sides
  Geometry larger = grid;
  larger.size += glm::i64vec3(2 * kMore, 0, 2 * kMore);
  larger.origin -= glm::dvec3(kMore, 0, kMore);
  const Volume<std::int16_t> continued = volume_of<std::int16_t>(larger, [&](const glm::i64vec3& voxel) {
    const glm::i64vec3 at =
        glm::clamp(voxel - glm::i64vec3(kMore, 0, kMore), glm::i64vec3(0), grid.size - std::int64_t{1});
    return noise.voxels[static_cast<std::size_t>((at.z * grid.size.y + at.y) * grid.size.x + at.x)];
  });
  RenderStyle lit = opaque_from(90, 0.2);
  lit.transfer.gradient = 30;
  ViewPlane plane = view_plane({.width = 8 * 16, .height = 10 * 16}, grid);  // from centre to centre
  plane.pixel_mm = 1.0 / 16;
  for (RenderStyle style : {lit, summed(200, 3000), brightest(200)}) {
    style.step_voxels = 0.5;
    const Image image = render(*renderer, view(noise), style, plane),
                same = render(*renderer, view(continued), style, plane);
    for (std::size_t n = 0; n < image.rgb.size(); ++n)
      ASSERT_NEAR(image.rgb[n], same.rgb[n], 1) << style.transfer.name << ", " << n;
    EXPECT_GT(*std::max_element(image.rgb.begin(), image.rgb.end()), 60) << style.transfer.name;
  }
}

TEST_P(Rendered, VoxelsOfEveryTypeLookAlike) {
  const auto renderer = GetParam().make_renderer({});
  Random random(5);
  const Geometry grid = unit_grid({30, 30, 30});
  Volume<float> smooth = blobs(grid, random);
  for (float& value : smooth.voxels) value = std::round(value);
  const ViewPlane plane = view_plane({.angle_deg = 40, .width = 60, .height = 60}, grid);
  RenderStyle style = opaque_from(20, 0.3);
  style.transfer.gradient = 20;
  const Image image = render(*renderer, view(smooth), style, plane);
  const auto as = [&](auto zero) {
    using V = decltype(zero);
    const Volume<V> volume{grid, std::vector<V>(smooth.voxels.begin(), smooth.voxels.end())};
    EXPECT_EQ(render(*renderer, view(volume), style, plane).rgb, image.rgb) << to_string(voxel_type_of<V>());
  };
  as(std::uint8_t{});
  as(std::int8_t{});
  as(std::uint16_t{});
  as(std::int16_t{});
  as(std::uint32_t{});
  as(std::int32_t{});
  as(double{});
}

TEST_P(Rendered, LightFallsFromTheUpperLeftAndShadesWhatTurnsAway) {
  const auto renderer = GetParam().make_renderer({});
  const Geometry grid = unit_grid({64, 64, 64});
  const Volume<float> ball = volume_of<float>(grid, [&](const glm::i64vec3& v) {
    return 100 * std::clamp(26 - glm::distance(glm::dvec3(v), glm::dvec3(31.5)), 0.0, 2.0) / 2;
  });
  RenderStyle style = opaque_from(50, 0.95);
  style.transfer.points[0].colour = style.transfer.points[1].colour = style.transfer.points[2].colour = glm::dvec3(0.6);
  style.transfer.gradient = 10;
  for (const double angle : {0.0, 130.0}) {
    const ViewPlane plane = view_plane({.angle_deg = angle, .width = 100, .height = 100}, grid);
    const Image image = render(*renderer, view(ball), style, plane);
    EXPECT_GT(image.grey(38, 32), image.grey(62, 68) + 20);
    EXPECT_GT(image.grey(38, 32), image.grey(80, 50) + 40);
    EXPECT_EQ(image.grey(2, 2), 0);
  }
}

TEST_P(Rendered, MoreOpacityHidesMoreOfTheBackground) {
  const auto renderer = GetParam().make_renderer({});
  Random random(11);
  const Geometry grid = unit_grid({40, 40, 40});
  const Volume<float> volume = blobs(grid, random);
  const ViewPlane plane = view_plane({.width = 50, .height = 50}, grid);
  std::vector<std::uint8_t> before(3 * 50 * 50, 0);
  for (const double opacity : {0.01, 0.05, 0.2, 0.6, 0.99}) {
    const Image image = render(*renderer, view(volume), opaque_from(15, opacity), plane);
    for (std::size_t n = 0; n < before.size(); ++n) ASSERT_GE(image.rgb[n] + 1, before[n]) << opacity;
    EXPECT_NE(image.rgb, before);
    before = image.rgb;
  }
}

TEST_P(Rendered, VoxelsThatAreNoNumberAreNotSeen) {
  const auto renderer = GetParam().make_renderer({});
  const Geometry grid = unit_grid({40, 40, 40});
  Volume<float> volume = volume_of<float>(grid, [](const glm::i64vec3& v) { return v.x < 20 ? NAN : 100.0; });
  const ViewPlane plane = view_plane({.width = 40, .height = 40}, grid);
  for (const RenderStyle& style : {opaque_from(50, 0.9), brightest(100), summed(100, 3000)}) {
    const Image image = render(*renderer, view(volume), style, plane);
    EXPECT_EQ(image.grey(8, 20), 0) << style.transfer.name;
    EXPECT_GT(image.grey(32, 20), 200) << style.transfer.name;
  }
}

TEST_P(Rendered, TintsColourTheVoxelsThatHaveThem) {
  const auto renderer = GetParam().make_renderer({});
  const Geometry grid = unit_grid({40, 40, 40});
  const Volume<std::int16_t> body =
      volume_of<std::int16_t>(grid, [](const glm::i64vec3& v) { return v.y > 10 ? 100 : 0; });
  const Volume<std::uint8_t> numbers =
      volume_of<std::uint8_t>(grid, [](const glm::i64vec3& v) { return v.x < 20 ? 0 : 3; });
  const ViewPlane plane = view_plane({.width = 40, .height = 40}, grid);
  const Image plain = render(*renderer, view(body), opaque_from(50, 0.99), plane);
  Tints tints{view(numbers), std::vector<glm::vec4>(4)};
  tints.colours[3] = {1, 0, 0, 0.5};
  renderer->set_tints(tints);
  Image tinted = plain;
  renderer->render(plane, tinted.rgb);
  EXPECT_EQ(tinted.at(8, 20), plain.at(8, 20));
  EXPECT_NEAR(tinted.at(32, 20).x, 255, 3);
  EXPECT_NEAR(tinted.at(32, 20).y, 127, 3);
  EXPECT_EQ(render(*renderer, view(body), opaque_from(50, 0.99), plane).rgb, plain.rgb);  // a new volume has none
}

TEST_P(Rendered, AShearedStackStandsAsItIs) {
  const auto renderer = GetParam().make_renderer({});
  Geometry sheared = unit_grid({40, 40, 40});
  sheared.direction[2] = glm::normalize(glm::dvec3(0, 0.4, 1));
  const AffineMap point = point_from_index(sheared);
  const glm::dvec3 middle = centre(sheared);
  const Volume<std::int16_t> ball = volume_of<std::int16_t>(
      sheared, [&](const glm::i64vec3& v) { return glm::distance(point(glm::dvec3(v)), middle) < 12 ? 100 : 0; });
  for (const auto& [angle, elevation] : {std::pair{0.0, 0.0}, {90.0, 0.0}, {30.0, 60.0}}) {
    const ViewPlane plane =
        view_plane({.angle_deg = angle, .elevation_deg = elevation, .width = 80, .height = 80}, sheared);
    const Image image = render(*renderer, view(ball), opaque_from(50, 0.9), plane);
    for (int y = 0; y < 80; ++y) {
      for (int x = 0; x < 80; ++x) {
        const double r = plane.pixel_mm * glm::length(glm::dvec2(x - 39.5, y - 39.5));
        if (r < 10.5) {
          ASSERT_GT(image.grey(x, y), 200) << x << ", " << y;
        }
        if (r > 13.5) {
          ASSERT_EQ(image.grey(x, y), 0) << x << ", " << y;
        }
      }
    }
  }
}

TEST_P(Rendered, AVolumeOfOneSliceIsAPicture) {
  const auto renderer = GetParam().make_renderer({});
  const Volume<std::int16_t> slice =
      volume_of<std::int16_t>(unit_grid({20, 20, 1}), [](const glm::i64vec3&) { return 100; });
  const ViewPlane plane = view_plane({.elevation_deg = 90, .width = 20, .height = 20}, slice.geometry);
  EXPECT_NEAR(render(*renderer, view(slice), opaque_from(50, 0.5), plane).grey(10, 10), 127.5, 1);
}

Region random_region(Random& random, const glm::i64vec3& size) {
  Region region;
  for (int axis = 0; axis < 3; ++axis) {
    region.begin[axis] = random.integer(0, size[axis] - 1);
    region.end[axis] = random.integer(region.begin[axis] + 1, size[axis]);
  }
  return region;
}

TEST_P(Rendered, ShowsWhatWasChangedAsIfItWereSetAnew) {
  SCOPED_TRACE(seed_text(test_seed()));
  Random random(test_seed(), 8200);
  Volume<std::int16_t> volume{unit_grid({70, 61, 52}), {}};
  volume.voxels.assign(static_cast<std::size_t>(voxel_count(volume.geometry)), -1000);
  const ViewPlane plane = view_plane({.angle_deg = 25, .width = 80, .height = 64}, volume.geometry);
  const RenderStyle style = opaque_from(200, 0.2);
  const auto renderer = GetParam().make_renderer({}), anew = GetParam().make_renderer({});
  Image found = render(*renderer, view(std::as_const(volume)), style, plane);
  EXPECT_EQ(*std::max_element(found.rgb.begin(), found.rgb.end()), 0);
  for (int n = 0; n < 8; ++n) {
    std::vector<Region> changed;
    for (int r = 0; r < n % 3; ++r) changed.push_back(random_region(random, volume.geometry.size));
    for (const Region& region : changed) {
      const auto value = static_cast<std::int16_t>(random.integer(-1000, 1500));
      for (std::int64_t k = region.begin.z; k < region.end.z; ++k) {
        for (std::int64_t j = region.begin.y; j < region.end.y; ++j) {
          for (std::int64_t i = region.begin.x; i < region.end.x; ++i)
            volume.voxels[static_cast<std::size_t>((k * 61 + j) * 70 + i)] = value;
        }
      }
    }
    renderer->update_volume(changed);
    renderer->render(plane, found.rgb);
    EXPECT_EQ(found.rgb, render(*anew, view(std::as_const(volume)), style, plane).rgb) << n;
  }
}

/// A renderer that is told what has changed, beside one that sees the whole volume anew each time.
class WatchedVolume {
 public:
  WatchedVolume(const test::Backend& backend, Geometry grid, Random& random)
      : random_(random),
        volume_(blobs(grid, random)),
        renderer_(backend.make_renderer({})),
        anew_(backend.make_renderer({})) {
    renderer_->set_volume(seen());
  }

  Renderer& renderer() { return *renderer_; }
  const Geometry& grid() const { return volume_.geometry; }
  void set_style(const RenderStyle& style) {
    style_ = style;
    renderer_->set_style(style);
  }
  /// Changes up to `count` boxes of up to `most` voxels along each axis.
  void change(int count, int most) {
    std::vector<Region> changed(static_cast<std::size_t>(random_.integer(0, count)));
    for (Region& region : changed) {
      const auto value = static_cast<float>(random_.real(-20, 120));
      for (int axis = 0; axis < 3; ++axis) {
        region.begin[axis] = random_.integer(0, grid().size[axis] - 1);
        region.end[axis] = std::min(region.begin[axis] + random_.integer(1, most), grid().size[axis]);
      }
      fill(region, value);
    }
    renderer_->update_volume(changed);
  }
  /// Gives a box of voxels a value, or nothing where it lies outside.
  void put(Region region, float value) {
    region = intersection(region, whole(grid()));
    fill(region, value);
    renderer_->update_volume({&region, 1});
  }
  void expect_picture(const ViewPlane& plane) {
    std::vector<std::uint8_t> found(3 * static_cast<std::size_t>(plane.width * plane.height));
    renderer_->render(plane, found);
    EXPECT_EQ(found, render(*anew_, seen(), style_, plane).rgb);
  }

 private:
  ConstVolumeView seen() const { return view(volume_); }
  void fill(const Region& region, float value) {
    for (std::int64_t k = region.begin.z; k < region.end.z; ++k)
      for (std::int64_t j = region.begin.y; j < region.end.y; ++j)
        for (std::int64_t i = region.begin.x; i < region.end.x; ++i)
          volume_.voxels[static_cast<std::size_t>((k * grid().size.y + j) * grid().size.x + i)] = value;
  }

  Random& random_;
  Volume<float> volume_;
  RenderStyle style_;
  std::unique_ptr<Renderer> renderer_, anew_;
};

Camera random_camera(Random& random) {
  return {.angle_deg = random.real(0, 360),
          .elevation_deg = random.real(-90, 90),
          .zoom = random.chance(0.3) ? random.real(2, 40) : random.real(0.3, 1.5),
          .width = static_cast<int>(random.integer(1, 90)),
          .height = static_cast<int>(random.integer(1, 90))};
}

TEST_P(Rendered, ShowsSmallChangesInOnePictureAfterAnother) {
  SCOPED_TRACE(seed_text(test_seed()));
  RenderStyle lit = opaque_from(40, 0.3), hazy = opaque_from(15, 0.01);
  lit.transfer.gradient = 5;
  hazy.transfer.gradient = 2;
  const RenderStyle styles[] = {lit, hazy, brightest(100), summed(100, 4000)};
  for (std::uint64_t n = 0; n < test::test_cases(24); ++n) {
    SCOPED_TRACE("case " + std::to_string(n));
    Random random(test_seed(), 8300 + n);
    Geometry grid = oblique_grid({random.integer(2, 50), random.integer(2, 50), random.integer(2, 50)});
    if (random.chance(0.3)) grid.direction[2] = glm::normalize(grid.direction[2] + 0.4 * grid.direction[1]);
    WatchedVolume watched(GetParam(), grid, random);
    watched.set_style(random.one_of(styles));
    const ViewPlane plane = view_plane(random_camera(random), grid);
    for (int picture = 0; picture < 12; ++picture) {
      for (int update = 0; update < 2; ++update) watched.change(3, picture % 4 == 3 ? 30 : 3);
      if (random.chance(0.15)) watched.set_style(random.one_of(styles));
      if (random.chance(0.15)) watched.expect_picture(view_plane(random_camera(random), grid));
      watched.expect_picture(plane);
    }
  }
}

/// A few voxels come and go where else nothing is to be seen, and around them voxels change that are not seen, but make
/// others look different.
TEST_P(Rendered, ShowsWhatComesAndGoesInEmptySpace) {
  SCOPED_TRACE(seed_text(test_seed()));
  RenderStyle lit = opaque_from(200, 0.3);
  lit.transfer.gradient = 5;
  const RenderStyle styles[] = {lit, lit, summed(100, 4000), brightest(300)};
  for (std::uint64_t n = 0; n < test::test_cases(40); ++n) {
    SCOPED_TRACE("case " + std::to_string(n));
    Random random(test_seed(), 8600 + n);
    WatchedVolume watched(GetParam(), unit_grid({40, 40, 40}), random);
    watched.put(whole(watched.grid()), random.one_of({-1000.0f, NAN}));
    RenderStyle style = random.one_of(styles);
    style.step_voxels = 1;
    watched.set_style(style);
    const ViewPlane plane =
        view_plane({.angle_deg = random.real(0, 360), .elevation_deg = random.real(-90, 90), .width = 50, .height = 50},
                   watched.grid());
    const auto near = [&](const glm::i64vec3& voxel, int apart) {
      return voxel +
             glm::i64vec3(random.integer(-apart, apart), random.integer(-apart, apart), random.integer(-apart, apart));
    };
    for (int thing = 0; thing < 3; ++thing) {
      const glm::i64vec3 at = near(glm::i64vec3(20), 12), size(random.integer(1, 4));
      watched.put({at, at + size}, 600);
      watched.expect_picture(plane);
      for (int change = 0; change < 6; ++change) {
        const glm::i64vec3 voxel = near(at, 5);
        watched.put({voxel, voxel + std::int64_t{1}}, static_cast<float>(random.integer(-1000, 190)));
        watched.expect_picture(plane);
      }
      watched.put({at, at + size}, -1000);
      watched.expect_picture(plane);
    }
  }
}

TEST_P(Rendered, ShowsAChangeAfterAPictureThatWasStopped) {
  SCOPED_TRACE(seed_text(test_seed()));
  Random random(test_seed(), 8400);
  WatchedVolume watched(GetParam(), unit_grid({40, 40, 40}), random);
  watched.set_style(opaque_from(40, 0.3));
  const ViewPlane plane = view_plane({.width = 60, .height = 50}, watched.grid());
  std::stop_source source;
  source.request_stop();
  for (int n = 0; n < 3; ++n) {
    watched.change(3, 9);
    watched.expect_picture(plane);
    watched.change(3, 9);
    std::vector<std::uint8_t> rgb(3 * 60 * 50);
    EXPECT_THROW(watched.renderer().render(plane, rgb, {.stop = source.get_token()}), Cancelled);
    watched.expect_picture(plane);
  }
}

TEST_P(Rendered, ShowsTintsThatAreSetAfterAPictureWithout) {
  const auto renderer = GetParam().make_renderer({});
  const Volume<std::int16_t> body =
      volume_of<std::int16_t>(unit_grid({20, 20, 20}), [](const glm::i64vec3&) { return 100; });
  const ViewPlane plane = view_plane({.width = 30, .height = 30}, body.geometry);
  Image image = render(*renderer, view(body), opaque_from(50, 0.9), plane);
  const Region corner{{0, 0, 0}, {1, 1, 1}};
  const auto expect_middle = [&](const glm::ivec3& colour) {
    for (int n = 0; n < 2; ++n) {
      renderer->update_volume({&corner, 1});
      renderer->render(plane, image.rgb);
      for (int channel = 0; channel < 3; ++channel) EXPECT_NEAR(image.at(15, 15)[channel], colour[channel], 1);
    }
  };
  const std::vector<glm::vec4> colours{glm::vec4(0), glm::vec4(1, 0, 0, 1), glm::vec4(0, 1, 0, 1)};
  expect_middle({255, 255, 255});
  for (const std::uint8_t number : {std::uint8_t{1}, std::uint8_t{2}}) {
    const Volume<std::uint8_t> numbers =
        volume_of<std::uint8_t>(body.geometry, [&](const glm::i64vec3&) { return number; });
    renderer->set_tints({view(numbers), colours});
    expect_middle(255 * glm::ivec3(number == 1, number == 2, 0));
    renderer->set_tints({});
    expect_middle({255, 255, 255});
  }
}

TEST_P(Rendered, RefusesWhatItCannotShow) {
  EXPECT_THROW(GetParam().make_renderer({})->update_volume({}), InputError);
  const auto renderer = GetParam().make_renderer({});
  Volume<std::int16_t> body = volume_of<std::int16_t>(unit_grid({8, 8, 8}), [](const glm::i64vec3&) { return 1; });
  const ViewPlane plane = view_plane({.width = 20, .height = 20}, body.geometry);
  std::vector<std::uint8_t> rgb(3 * 20 * 20);
  EXPECT_THROW(renderer->render(plane, rgb), InputError);  // no volume yet
  renderer->set_volume(view(std::as_const(body)));
  EXPECT_THROW(renderer->render(plane, rgb), InputError);  // no style yet
  renderer->set_style(opaque_from(50, 0.5));
  EXPECT_NO_THROW(renderer->render(plane, rgb));
  EXPECT_THROW(renderer->render(plane, std::span(rgb).first(30)), InputError);
  RenderStyle style = opaque_from(50, 0.5);
  style.step_voxels = 2;
  EXPECT_THROW(renderer->set_style(style), InputError);
  style = opaque_from(50, 0.5);
  style.background.x = 2;
  EXPECT_THROW(renderer->set_style(style), InputError);
  ConstVolumeView part = view(std::as_const(body));
  part.buffered.end.z = 4;
  EXPECT_THROW(renderer->set_volume(part), InputError);
  ConstVolumeView vectors = view(std::as_const(body));
  vectors.components = 3;
  EXPECT_THROW(renderer->set_volume(vectors), InputError);
  body.geometry.slices = {0, 1, 2, 3.5, 4, 5, 6, 7};
  EXPECT_THROW(renderer->set_volume(view(std::as_const(body))), InputError);
  const Volume<std::uint8_t> small =
      volume_of<std::uint8_t>(unit_grid({4, 8, 8}), [](const glm::i64vec3&) { return 1; });
  EXPECT_THROW(renderer->set_tints({view(small), {}}), InputError);
}

TEST_P(Rendered, StopsWhenItIsAskedTo) {
  const auto renderer = GetParam().make_renderer({});
  const Volume<std::int16_t> body =
      volume_of<std::int16_t>(unit_grid({8, 8, 8}), [](const glm::i64vec3&) { return 1; });
  const ViewPlane plane = view_plane({.width = 20, .height = 20}, body.geometry);
  std::vector<std::uint8_t> rgb(3 * 20 * 20);
  renderer->set_volume(view(body));
  renderer->set_style(opaque_from(50, 0.5));
  std::stop_source source;
  source.request_stop();
  EXPECT_THROW(renderer->render(plane, rgb, {.stop = source.get_token()}), Cancelled);
}

}  // namespace
}  // namespace tetwarp
