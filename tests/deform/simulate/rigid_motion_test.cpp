// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/simulate/rigid_motion.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include "tests/support/springs.h"

namespace tetwarp::simulate {
namespace {

using namespace test;

const double kPi = std::acos(-1.0);

/// A turn by an angle about a unit axis through a point (Rodrigues), then a shift.
struct Turn {
  glm::dvec3 axis{0, 0, 1};
  double angle = 0;
  glm::dvec3 about{10, 20, 30}, shift{12.5, -3, 40};

  glm::dvec3 way_of(const glm::dvec3& p) const {
    const glm::dvec3 d = p - about;
    const glm::dvec3 turned =
        std::cos(angle) * d + std::sin(angle) * glm::cross(axis, d) + (1 - std::cos(angle)) * glm::dot(axis, d) * axis;
    return about + turned + shift - p;
  }
};

glm::dvec3 random_point(Random& random, double most) {
  return {random.real(-most, most), random.real(-most, most), random.real(-most, most)};
}

Turn random_turn(Random& random, double angle) {
  return {.axis = glm::normalize(random_point(random, 1) + glm::dvec3(0, 0, 2)), .angle = angle};
}

Ways ways_of(const std::vector<glm::dvec3>& points, const std::function<glm::dvec3(const glm::dvec3&)>& way_of) {
  Ways ways;
  for (const glm::dvec3& p : points) ways.add(Ways::of(p, way_of(p)));
  return ways;
}

/// Squares that a motion leaves.
double left_by(const RigidMotion& motion, const std::vector<glm::dvec3>& points,
               const std::function<glm::dvec3(const glm::dvec3&)>& way_of) {
  double sum = 0;
  for (const glm::dvec3& p : points) {
    const glm::dvec3 left = way_of(p) - motion.way_of(p);
    sum += glm::dot(left, left);
  }
  return sum;
}

void expect_rotation(const RigidMotion& motion) {
  const glm::dmat3 r = motion.turned + glm::dmat3(1);
  EXPECT_NEAR(glm::determinant(r), 1, 1e-12);
  for (int a = 0; a < 3; ++a) {
    for (int b = 0; b < 3; ++b) EXPECT_NEAR(glm::dot(r[a], r[b]), a == b, 1e-12);
  }
}

TEST(RigidMotionOfWays, IsTheMotionThatPointsAreGiven) {
  const std::uint64_t seed = test_seed();
  for (std::uint64_t number = 0; number < test_cases(200); ++number) {
    SCOPED_TRACE(seed_text(seed) + ", case " + std::to_string(number));
    Random random(seed, 200 + number);
    const Turn turn = random_turn(random, random.real(-kPi, kPi));
    const bool is_flat = random.chance(0.5);
    std::vector<glm::dvec3> points(static_cast<std::size_t>(random.integer(10, 50)));
    for (glm::dvec3& p : points) {
      p = random_point(random, 100);
      if (is_flat) p.z = 7;
    }
    const std::optional<RigidMotion> found =
        rigid_motion(ways_of(points, [&](const glm::dvec3& p) { return turn.way_of(p); }));
    ASSERT_TRUE(found);
    expect_rotation(*found);
    for (const glm::dvec3& p : {points[0], glm::dvec3(50, -60, 70), glm::dvec3(0)}) {
      EXPECT_LT(glm::length(found->way_of(p) - turn.way_of(p)), 1e-4);
    }
  }
}

TEST(RigidMotionOfWays, NoRigidMotionNearbyLeavesLess) {
  const std::uint64_t seed = test_seed();
  for (std::uint64_t number = 0; number < test_cases(50); ++number) {
    SCOPED_TRACE(seed_text(seed) + ", case " + std::to_string(number));
    Random random(seed, 500 + number);
    const Turn turn = random_turn(random, random.real(0.5, 3));
    std::vector<glm::dvec3> points(20), noise;
    for (glm::dvec3& p : points) p = random_point(random, 100), noise.push_back(random_point(random, 3));
    const auto way_of = [&](const glm::dvec3& p) {
      return turn.way_of(p) + noise[static_cast<std::size_t>(&p - points.data())];
    };
    const std::optional<RigidMotion> found = rigid_motion(ways_of(points, way_of));
    ASSERT_TRUE(found);
    expect_rotation(*found);
    const double least = left_by(*found, points, way_of);
    EXPECT_GT(least, 1);
    for (int trial = 0; trial < 20; ++trial) {
      const Turn nudge{.axis = random_turn(random, 0).axis,
                       .angle = random.real(-1e-2, 1e-2),
                       .about = found->about + found->way,
                       .shift = random_point(random, 0.1)};
      const auto left = [&](const glm::dvec3& p) {
        const glm::dvec3 carried = p + found->way_of(p);
        return way_of(p) - found->way_of(p) - nudge.way_of(carried);
      };
      double sum = 0;
      for (const glm::dvec3& p : points) sum += glm::dot(left(p), left(p));
      EXPECT_GE(sum, least * (1 - 1e-12));
    }
  }
}

TEST(RigidMotionOfWays, PointsOnALineTakeTheLeastTurn) {
  Random random(test_seed(), 12);
  SCOPED_TRACE(seed_text(test_seed()));
  const Turn turn = random_turn(random, 2);
  const glm::dvec3 across = glm::normalize(glm::cross(turn.axis, glm::dvec3(0.3, 1, 0.2)));  // so that it is the least
  for (const int count : {2, 3, 7}) {
    std::vector<glm::dvec3> points;
    for (int n = 0; n < count; ++n) points.push_back(glm::dvec3(4, 5, 6) + 6.0 * n * across);
    const auto found = rigid_motion(ways_of(points, [&](const glm::dvec3& p) { return turn.way_of(p); }));
    ASSERT_TRUE(found);
    expect_rotation(*found);
    const glm::dvec3 beside(50, -60, 70);
    EXPECT_LT(glm::length(found->way_of(beside) - turn.way_of(beside)), 1e-3) << count << " points";
  }
}

TEST(RigidMotionOfWays, OnePointDoesNotTurn) {
  const auto found = rigid_motion(Ways::of({100, 200, -300}, {1, 2, 3}));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->way_of({5, 6, 7}), glm::dvec3(1, 2, 3));
  std::vector<glm::dvec3> points(5, {100.1, 200.2, -300.3});  // where sums round
  const auto of_all = rigid_motion(ways_of(points, [](const glm::dvec3&) { return glm::dvec3(1, 2, 3); }));
  ASSERT_TRUE(of_all);
  EXPECT_LT(glm::length(of_all->way_of({5, 6, 7}) - glm::dvec3(1, 2, 3)), 1e-12);
}

TEST(RigidMotionOfWays, IsNoneWhereItLeavesAQuarter) {
  EXPECT_FALSE(rigid_motion(Ways{}));
  EXPECT_FALSE(rigid_motion(Ways::of({1, 2, 3}, {0, 0, 0})));
  const auto found = [](double stretch, double shift) {
    std::vector<glm::dvec3> points;
    for (int corner = 0; corner < 8; ++corner) points.emplace_back(corner & 1, corner >> 1 & 1, corner >> 2);
    const auto way_of = [&](const glm::dvec3& p) { return glm::dvec3(stretch * (2 * p.x - 1), shift, 0); };
    return rigid_motion(ways_of(points, way_of)).has_value();
  };
  EXPECT_FALSE(found(0.1, 0));  // squares s^2 of stretching are left of s^2 + t^2
  EXPECT_FALSE(found(0.1, 0.172));
  EXPECT_TRUE(found(0.1, 0.174));
  EXPECT_TRUE(found(0, 1));
}

class RigidHandles : public testing::TestWithParam<SpringMethod> {
 protected:
  void SetUp() override {
    if (!GetParam().cannot_run.empty()) GTEST_SKIP() << GetParam().name << ": " << GetParam().cannot_run;
  }
  /// How far nodes are from where a motion of the placed ones takes them.
  double off_by(const Model& model, const std::vector<std::size_t>& placed, const Turn& turn) const {
    const auto moved = [&](std::size_t n) { return turn.way_of(rest_of(model, n)); };
    Loads loads = free_loads(model);
    for (const std::size_t n : placed) place(loads, n, moved(n));
    const auto simulation = GetParam().make(model);
    simulation->set_loads(loads);
    const Convergence convergence = simulation->advance(1, {});
    EXPECT_TRUE(convergence.reached) << convergence.steps << " steps, " << convergence.motion_mm << ", "
                                     << convergence.residual;
    return furthest(displacement(*simulation), moved);
  }
};

INSTANTIATE_TEST_SUITE_P(Methods, RigidHandles, testing::ValuesIn(methods()),
                         [](const testing::TestParamInfo<SpringMethod>& method) { return method.param.name; });

TEST_P(RigidHandles, TakeAllNodesAlongByAnyAngle) {
  SCOPED_TRACE(seed_text(test_seed()));
  for (const double degrees : {60.0, 170.0, 180.0}) {
    Random random(test_seed(), static_cast<std::uint64_t>(degrees));
    const Model model = random_model(lattice({7, 8, 6}), random, 3);
    std::vector<std::size_t> placed;
    for (std::size_t n = 0; n < model.nodes(); ++n) {
      if (place_of(model, n).z == 0 || random.chance(0.1)) placed.push_back(n);
    }
    EXPECT_LT(off_by(model, placed, random_turn(random, degrees / 180 * kPi)), 1e-4) << degrees << " degrees";
  }
}

/// What they leave open costs no energy: the least turn is one of the answers, and the one that is found.
TEST_P(RigidHandles, TakeAllNodesAlongWhereTheyAreFew) {
  SCOPED_TRACE(seed_text(test_seed()));
  Random random(test_seed(), 13);
  const Model model = random_model(lattice({7, 8, 6}), random, 3);
  const auto node = [](std::size_t x, std::size_t y, std::size_t z) { return x + 7 * (y + 8 * z); };
  const Turn shift, turn{.angle = 2};  // the turn is about z
  EXPECT_LT(off_by(model, {node(2, 3, 1)}, shift), 1e-4);
  EXPECT_LT(off_by(model, {node(0, 3, 1), node(6, 3, 1)}, turn), 1e-4);
  EXPECT_LT(off_by(model, {node(5, 0, 4), node(5, 3, 4), node(5, 7, 4)}, turn), 1e-4);
  EXPECT_LT(off_by(model, {node(5, 0, 4), node(5, 3, 0), node(1, 7, 4)}, {.axis = {0.6, 0, 0.8}, .angle = 2}), 1e-4);
}

/// Placed nodes take the others along from wherever they are: what was strained stays strained as it was.
TEST_P(RigidHandles, TakeAlongWhatIsAlreadyStrained) {
  SCOPED_TRACE(seed_text(test_seed()));
  Random random(test_seed(), 14);
  const Model model = random_model(lattice({5, 6, 5}), random, 2);
  Loads loads = pressed(model, {1, -0.5, 2});
  const auto simulation = GetParam().make(model);
  simulation->set_loads(loads);
  EXPECT_TRUE(simulation->advance(1, kTight).reached);
  const std::vector<glm::vec3> before = displacement(*simulation);
  const Turn turn = random_turn(random, 2.5);
  const auto moved = [&](std::size_t n) {
    const glm::dvec3 u(double{before[n].x}, double{before[n].y}, double{before[n].z});
    return u + turn.way_of(rest_of(model, n) + u);
  };
  for (std::size_t n = 0; n < model.nodes(); ++n) {
    if (loads.constraint[n] == Constraint::placed) place(loads, n, moved(n));
  }
  simulation->set_loads(loads);
  EXPECT_TRUE(simulation->advance(1, kTight).reached);
  EXPECT_LT(furthest(displacement(*simulation), moved), 1e-4);
}

TEST_P(RigidHandles, LeaveNodesThatNothingTiesWhereTheyAre) {
  const std::vector<std::uint32_t> copies{13};  // a second node at the middle, without any link
  const Model model = make_model(lattice({3, 3, 3}), std::vector<std::uint8_t>(8, 0), tissues(), copies);
  Loads loads = free_loads(model);
  for (std::size_t n = 0; n < 9; ++n) place(loads, n, Turn{.angle = 1}.way_of(rest_of(model, n)));
  const auto simulation = GetParam().make(model);
  simulation->set_loads(loads);
  EXPECT_TRUE(simulation->advance(1, {}).reached);
  EXPECT_EQ(displacement(*simulation)[27], glm::vec3(0));
}

}  // namespace
}  // namespace tetwarp::simulate
