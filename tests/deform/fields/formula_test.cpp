// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/fields/formula.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <future>
#include <glm/geometric.hpp>
#include <numbers>

#include "tests/support/fields.h"

namespace tetwarp {
namespace {

using namespace test;

constexpr double kPi = std::numbers::pi;

/// 101 x 81 x 61 voxels of 2 x 3 x 5 mm, axial, centre at (10, -20, 30).
Geometry axial() {
  Geometry grid = unit_grid({101, 81, 61});
  grid.spacing = {2, 3, 5};
  grid.origin = glm::dvec3(10, -20, 30) - grid.spacing * glm::dvec3(50, 40, 30);
  return grid;
}
const glm::dvec3 kCentre(10, -20, 30);

/// The geometry of the volume when it is stored as coronal slices: i along x, j along -z, k along y.
Geometry coronal() {
  Geometry grid = axial();
  grid.size = {101, 61, 81};
  grid.spacing = {2, 5, 3};
  grid.direction = glm::dmat3(glm::dvec3(1, 0, 0), glm::dvec3(0, 0, -1), glm::dvec3(0, 1, 0));
  grid.origin = kCentre - grid.direction * (grid.spacing * glm::dvec3(50, 30, 40));
  return grid;
}

void expect_moves(const std::string& formula, const Geometry& grid, const glm::dvec3& from, const glm::dvec3& by) {
  const glm::dvec3 found = parse_formula(formula, grid)(from);
  EXPECT_LE(glm::length(found - by), 1e-10) << formula << ": found " << found.x << " " << found.y << " " << found.z
                                            << ", expected " << by.x << " " << by.y << " " << by.z;
}

TEST(Formula, IdentityAndTranslationMoveEveryPointAlike) {
  expect_moves("identity", axial(), {1, 2, 3}, {0, 0, 0});
  expect_moves("translate:by=1.5/-2/300", axial(), {1, 2, 3}, {1.5, -2, 300});
  expect_moves("translate:by=1vox/2vox/-3vox", axial(), {1, 2, 3}, {2, 6, -15});
  expect_moves("translate:by=1vox/2vox/-3vox", coronal(), {1, 2, 3}, {2, -9, -10});
}

TEST(Formula, WaveIsASineThroughTheCentre) {
  expect_moves("wave:amplitude=8,wavelength=64", axial(), kCentre, {0, 0, 0});
  expect_moves("wave:amplitude=8,wavelength=64", axial(), kCentre + glm::dvec3(7, 9, 16), {8, 0, 0});
  expect_moves("wave:amplitude=8,wavelength=64", axial(), kCentre + glm::dvec3(7, 9, -16), {-8, 0, 0});
  expect_moves("wave:amplitude=8,wavelength=64,phase=90", axial(), kCentre, {8, 0, 0});
  expect_moves("wave:wavelength=64,amplitude=-8,phase=30", axial(), kCentre, {-4, 0, 0});
  expect_moves("wave:amplitude=8,wavelength=48,axis=z,along=y", axial(), kCentre + glm::dvec3(0, 4, 0), {0, 0, 4});
}

TEST(Formula, WaveVoxelsAreThoseOfTheAxisMeant) {
  // amplitude along x (2 mm a voxel), wavelength along z (5 mm), however the slices are stored
  for (const Geometry& grid : {axial(), coronal()}) {
    expect_moves("wave:amplitude=3vox,wavelength=16vox", grid, kCentre + glm::dvec3(0, 0, 20), {6, 0, 0});
    expect_moves("wave:amplitude=2vox,wavelength=8vox,axis=y,along=x", grid, kCentre + glm::dvec3(4, 0, 0), {0, 6, 0});
  }
}

TEST(Formula, TwistTurnsFromXTowardsYByItsAngleAtEitherEnd) {
  const double s = std::sin(kPi / 6), c = std::cos(kPi / 6);
  const glm::dvec3 d(40, 0, 0);
  for (const Geometry& grid : {axial(), coronal()}) {  // h = 150 mm
    expect_moves("twist:angle=30", grid, kCentre + d, {0, 0, 0});
    expect_moves("twist:angle=30", grid, kCentre + d + glm::dvec3(0, 0, 150), {40 * c - 40, 40 * s, 0});
    expect_moves("twist:angle=30", grid, kCentre + d + glm::dvec3(0, 0, -150), {40 * c - 40, -40 * s, 0});
    expect_moves("twist:angle=60", grid, kCentre + d + glm::dvec3(0, 0, 75), {40 * c - 40, 40 * s, 0});
    // about x: from y towards z, h = 100 mm; about y: from z towards x, h = 120 mm
    expect_moves("twist:angle=30,axis=x", grid, kCentre + glm::dvec3(100, 40, 0), {0, 40 * c - 40, 40 * s});
    expect_moves("twist:angle=30,axis=y", grid, kCentre + glm::dvec3(0, 120, 40), {40 * s, 0, 40 * c - 40});
  }
}

TEST(Formula, TwistReachesItsAngleAtTheFarthestCornerOfAnObliqueGrid) {
  const Geometry grid = oblique_grid({20, 30, 40});
  const AffineMap point = point_from_index(grid);
  double h = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 index = glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2) * glm::dvec3(19, 29, 39);
    h = std::max(h, std::abs(point(index).z - centre(grid).z));
  }
  EXPECT_NEAR(half_length(grid, 2), h, 1e-12 * h);
  expect_moves("twist:angle=90", grid, centre(grid) + glm::dvec3(10, 0, h), {-10, 10, 0});
}

TEST(Formula, TwistFunctionIsTheFormulaOnALatticeOverTheVolume) {
  const Geometry grid = axial();
  const VertexField field = twist(grid, kPi / 6, 7);
  const PointMap map = parse_formula("twist:angle=30", grid);
  ASSERT_EQ(field.lattice, lattice_over(grid, 7));
  const AffineMap point = point_from_index(field.lattice);
  for (const glm::i64vec3& vertex : {glm::i64vec3(0), glm::i64vec3(3, 11, 2), field.lattice.size - std::int64_t{1}}) {
    const glm::i64vec3& size = field.lattice.size;
    const auto n = static_cast<std::size_t>(vertex.x + size.x * (vertex.y + size.y * vertex.z));
    EXPECT_LE(glm::length(glm::dvec3(field.displacement[n]) - map(point(glm::dvec3(vertex)))), 1e-5);
  }
}

TEST(Formula, BubbleGrowsInsideItsRadiusAndRestsOutside) {
  const std::string bubble = "bubble:radius=60,strength=0.3";
  expect_moves(bubble, axial(), kCentre, {0, 0, 0});
  expect_moves(bubble, axial(), kCentre + glm::dvec3(0, 30, 0), {0, 30 * 0.3 * 0.25, 0});
  expect_moves(bubble, axial(), kCentre + glm::dvec3(12, 0, 16), {12 * 0.3 * 4 / 9, 0, 16 * 0.3 * 4 / 9});
  expect_moves(bubble, axial(), kCentre + glm::dvec3(0, 0, 60), {0, 0, 0});
  expect_moves(bubble, axial(), kCentre + glm::dvec3(0, 0, 61), {0, 0, 0});
  expect_moves("bubble:radius=30vox,strength=-0.5", axial(), kCentre + glm::dvec3(30, 0, 0), {-3.75, 0, 0});
  expect_moves(bubble + ",center=1/2/3", axial(), {1, 2, 33}, {0, 0, 2.25});
}

TEST(Formula, ThePapersBubbleShiftsEveryPointButTheCentreByTheSame) {
  expect_moves("bubble-paper:shift=10", axial(), kCentre, {0, 0, 0});
  expect_moves("bubble-paper:shift=10", axial(), kCentre + glm::dvec3(3, 0, 4), {6, 0, 8});
  expect_moves("bubble-paper:shift=-10", axial(), kCentre + glm::dvec3(0, 0.5, 0), {0, -10, 0});
  expect_moves("bubble-paper:shift=3vox,center=0/0/-5", axial(), {0, 0, 100}, {0, 0, 6});
}

TEST(Formula, MisspeltFormulasAreRefusedWithWhatIsWrong) {
  const std::pair<const char*, const char*> cases[] = {
      {"wobble:amplitude=3", "wobble"},
      {"", "unknown"},
      {"wave", "amplitude"},
      {"wave:amplitude=3", "wavelength"},
      {"wave:amplitude=3,wavelength=0", "wavelength"},
      {"wave:amplitude=3,wavelength=-4", "wavelength"},
      {"wave:amplitude=3,wavelength=9,speed=2", "speed"},
      {"wave:amplitude=3,amplitude=4,wavelength=9", "twice"},
      {"wave:amplitude=3mm,wavelength=9", "3mm"},
      {"wave:amplitude=,wavelength=9", "amplitude"},
      {"wave:amplitude=nan,wavelength=9", "amplitude"},
      {"wave:amplitude=1e999,wavelength=9", "amplitude"},
      {"wave:amplitude=3,wavelength=9,axis=w", "axis"},
      {"wave:amplitude=3,,wavelength=9", "key=value"},
      {"wave:", "key=value"},
      {"twist", "angle"},
      {"twist:angle=30deg", "30deg"},
      {"twist:angle=3vox", "3vox"},
      {"bubble:radius=10", "strength"},
      {"bubble:radius=0,strength=1", "radius"},
      {"bubble:radius=10,strength=1,center=1/2", "center"},
      {"bubble-paper:radius=10", "shift"},
      {"translate", "by"},
      {"translate:by=1/2", "by"},
      {"translate:by=1vox/2/3", "mix"},
      {"identity:angle=3", "angle"},
  };
  for (const auto& [formula, named] : cases) {
    try {
      parse_formula(formula, axial());
      ADD_FAILURE() << "accepted: " << formula;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(named), std::string::npos) << error.what();
    }
  }
}

TEST(PointMap, OfARowHasTheBitsOfOnePointAfterTheOther) {
  SCOPED_TRACE(seed_text(test_seed()));
  Random random(test_seed(), 20);
  const Geometry volume{.size = {60, 50, 40}, .spacing = {0.7, 0.8, 1.9}, .origin = {-20, 11, 3}};
  const char* const formulas[] = {"identity",
                                  "translate:by=1/2/3",
                                  "wave:amplitude=4,wavelength=30,phase=20",
                                  "wave:amplitude=4,wavelength=17,axis=y,along=x",
                                  "twist:angle=30",
                                  "twist:angle=-70,axis=x",
                                  "bubble:radius=25,strength=0.7",
                                  "bubble-paper:shift=4",
                                  "elastic:amplitude=3,spacing=4,seed=5",
                                  "elastic:amplitude=9,spacing=40,seed=6"};
  for (const char* formula : formulas) {
    SCOPED_TRACE(formula);
    const PointMap map = parse_formula(formula, volume);
    for (int row = 0; row < 60; ++row) {
      // Along an axis up or down, in a general direction, or with leaps; from anywhere, the centre included.
      glm::dvec3 step(0);
      const int kind = static_cast<int>(random.integer(0, 3));
      for (int axis = 0; axis < 3; ++axis) step[axis] = random.real(-1, 1);
      if (kind < 2) step = glm::dvec3(kind == 0 ? 0.7 : -0.7, 0, 0);
      if (kind == 3) step *= 10.0;
      const glm::dvec3 from =
          random.chance(0.1) ? centre(volume) : glm::dvec3(random.real(-30, 30), random.real(0, 60), 9);
      std::vector<glm::dvec3> points, found(100);
      for (int n = 0; n < 100; ++n) points.push_back(from + (row % 7 == 0 ? std::floor(n / 3.0) : n) * step);
      map.of_row(points, found.data());
      for (std::size_t n = 0; n < points.size(); ++n) {
        const glm::dvec3 alone = map(points[n]);
        ASSERT_EQ(std::memcmp(&found[n], &alone, sizeof alone), 0) << "point " << n << " of row " << row;
      }
    }
  }
}

/// The map refuses two vertices, and that which comes first in the field comes last in time, where there are threads.
TEST(PointMap, OfSeveralVerticesThatAreRefusedTheFirstIsNamed) {
  constexpr std::int64_t kFirst = 5, kLast = 35;
  std::promise<void> refused;
  const std::shared_future<void> is_refused = refused.get_future().share();
  bool waits = true;
  const PointMap map = [&](const glm::dvec3& point) {
    if (point.x > 0 || point.y > 0) return glm::dvec3(0);
    if (point.z == kLast) {
      if (waits) refused.set_value();
      throw InputError("the last");
    }
    if (point.z == kFirst) {
      if (waits) is_refused.wait_for(std::chrono::seconds(2));
      throw InputError("the first");
    }
    return glm::dvec3(0);
  };
  const auto refusal_of = [](const auto& work) -> std::string {
    try {
      work();
    } catch (const InputError& error) {
      return error.what();
    }
    return "none";
  };
  const Geometry lattice = unit_grid({64, 64, 40});
  EXPECT_EQ(refusal_of([&] { sample_on(lattice, map); }), "the first");
  waits = false;
  VertexField mesh{lattice, {}};
  for (std::int64_t z = 0; z < 40; ++z) {
    for (int n = 0; n < 4096; ++n) mesh.mesh.rest.emplace_back(n % 64, n / 64, z);
  }
  mesh.mesh.displacement.resize(mesh.mesh.rest.size());
  mesh.mesh.tetrahedra = {{0, 1, 64, 4096}};
  for (int n = 0; n < 20; ++n) EXPECT_EQ(refusal_of([&] { compose(mesh, map); }), "the first");
}

TEST(Formula, FileNamesAreNoFormulas) {
  EXPECT_TRUE(is_formula("wave:amplitude=3,wavelength=9"));
  EXPECT_TRUE(is_formula("identity"));
  EXPECT_FALSE(is_formula("wave.nrrd"));
  EXPECT_FALSE(is_formula("folder/twist.mha"));
}

}  // namespace
}  // namespace tetwarp
