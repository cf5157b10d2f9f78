// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/simulate/mass_spring.h"

#include <gtest/gtest.h>
#include <bit>
#include <glm/geometric.hpp>

#include "tests/support/dense_springs.h"
#include "tests/support/instruction_set.h"
#include "tests/support/says.h"
#include "tests/support/springs.h"

namespace tetwarp::simulate {
namespace {

using namespace test;

class MassSpring : public testing::TestWithParam<SpringMethod> {
 protected:
  void SetUp() override {
    if (!GetParam().cannot_run.empty()) GTEST_SKIP() << GetParam().name << ": " << GetParam().cannot_run;
  }
  std::unique_ptr<Simulation> make(const Model& model) const { return GetParam().make(model); }
};

std::string method_name(const testing::TestParamInfo<SpringMethod>& method) { return method.param.name; }

INSTANTIATE_TEST_SUITE_P(Methods, MassSpring, testing::ValuesIn(methods()), method_name);

TEST_P(MassSpring, WithoutLoadNothingMovesAtAll) {
  Random random(test_seed());
  SCOPED_TRACE(seed_text(test_seed()));
  const Model model = random_model(lattice({6, 5, 7}), random, 3);
  Loads loads = free_loads(model);
  for (std::size_t n = 0; n < 30; ++n) place(loads, n, glm::dvec3(0));
  const auto simulation = make(model);
  simulation->set_loads(loads);
  const Convergence convergence = simulation->advance(1, {});
  EXPECT_TRUE(convergence.reached);
  EXPECT_EQ(convergence.residual, 0);
  for (const glm::vec3& u : displacement(*simulation)) EXPECT_EQ(u, glm::vec3(0));
}

TEST_P(MassSpring, RigidMotionOfHandlesIsRigidMotionOfAllNodes) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE(seed_text(seed));
  for (const bool turns : {false, true}) {
    for (const int kinds : {1, 3}) {
      Random random(seed, static_cast<std::uint64_t>(kinds));
      const Model model = random_model(lattice({7, 8, 6}), random, kinds);
      const double angle = turns ? std::acos(-1.0) / 6 : 0;
      const glm::dvec3 about(10, 20, 30), shift(12.5, -3, 40);
      const auto moved = [&](std::size_t n) {
        const glm::dvec3 p = rest_of(model, n), d = p - about;
        const glm::dvec3 turned(std::cos(angle) * d.x - std::sin(angle) * d.y,
                                std::sin(angle) * d.x + std::cos(angle) * d.y, d.z);
        return about + turned + shift - p;
      };
      Loads loads = free_loads(model);
      for (std::size_t n = 0; n < model.nodes(); ++n) {
        if (place_of(model, n).z == 0 || random.chance(0.1)) place(loads, n, moved(n));
      }
      const auto simulation = make(model);
      simulation->set_loads(loads);
      const Convergence convergence = simulation->advance(1, {});
      EXPECT_TRUE(convergence.reached) << convergence.steps << " steps, " << convergence.motion_mm << ", "
                                       << convergence.residual;
      EXPECT_LT(furthest(displacement(*simulation), moved), 1e-4) << kinds << " tissues, turns: " << turns;
    }
  }
}

/// A dense solve from the place that was found must stay there, and the second derivative of the energy there must have
/// no negative direction. There may be several such minima (once in some hundred fields), so that a dense solve from
/// rest may end at another; mostly it does not.
TEST_P(MassSpring, EndsAtAMinimumThatADenseSolveConfirms) {
  const std::uint64_t seed = test_seed(), cases = test_cases(6);
  std::uint64_t reached_from_rest = 0;
  for (std::uint64_t number = 0; number < cases; ++number) {
    SCOPED_TRACE(seed_text(seed) + ", case " + std::to_string(number));
    Random random(seed, 100 + number);
    const int kinds = number % 2 == 0 ? 1 : 2;
    const Model model =
        random_model(lattice({random.integer(3, 5), random.integer(2, 4), random.integer(3, 5)}), random, kinds);
    Loads loads = pressed(model, glm::dvec3(random.real(-1, 1), random.real(-1, 1), random.real(-1, 2)));
    loads.force.assign(model.nodes(), glm::vec3(0));
    loads.force.back() = {0.01f, 0.02f, -0.015f};
    const auto simulation = make(model);
    simulation->set_loads(loads);
    const Convergence convergence = simulation->advance(1, kTight);
    EXPECT_TRUE(convergence.reached) << convergence.steps << " steps, " << convergence.motion_mm << ", "
                                     << convergence.residual;
    EXPECT_LE(convergence.motion_mm, kTight.motion_mm);
    EXPECT_LE(convergence.residual, kTight.residual);
    const std::vector<glm::vec3> found = displacement(*simulation);
    std::vector<glm::dvec3> expected;
    for (const glm::vec3& u : found) expected.push_back({double{u.x}, double{u.y}, double{u.z}});
    find_equilibrium(model, loads, 1, expected);
    EXPECT_LT(furthest(found, [&](std::size_t n) { return expected[n]; }), 2e-6);
    const std::vector<glm::dvec3> from_rest = dense_equilibrium(model, loads);
    reached_from_rest += furthest(found, [&](std::size_t n) { return from_rest[n]; }) < 2e-6;
    const DenseSprings springs = dense_springs(model, loads, 1, expected);
    const Eigen::VectorXd curvatures =
        Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(springs.matrix, Eigen::EigenvaluesOnly).eigenvalues();
    EXPECT_GT(curvatures.minCoeff(), -1e-9 * curvatures.maxCoeff());
    double most = 0;
    for (const glm::dvec3& u : expected) most = std::max(most, glm::length(u));
    EXPECT_GT(most, 0.05);
  }
  EXPECT_GE(reached_from_rest + 2, cases) << seed_text(seed);
}

TEST_P(MassSpring, TheUsualRuleEndsCloseToTheEquilibrium) {
  Random random(test_seed(), 3);
  SCOPED_TRACE(seed_text(test_seed()));
  const Model model = random_model(lattice({6, 5, 6}), random, 2);
  const Loads loads = pressed(model, {1, -0.5, -3});
  const auto usual = make(model), tight = make(model);
  usual->set_loads(loads);
  tight->set_loads(loads);
  EXPECT_TRUE(usual->advance(1, {}).reached);
  EXPECT_TRUE(tight->advance(1, kTight).reached);
  EXPECT_LT(furthest(displacement(*usual), displacement(*tight)), 0.01);
}

TEST_P(MassSpring, EnergyFallsInEveryStep) {
  Random random(test_seed(), 4);
  SCOPED_TRACE(seed_text(test_seed()));
  const Model model = random_model(lattice({8, 7, 9}), random, 3);
  const auto simulation = make(model);
  simulation->set_loads(pressed(model, {6, 0, -15}));
  double before = INFINITY;
  int falls = 0;
  for (int step = 0; step < 40; ++step) {
    simulation->advance(1, {.motion_mm = 1e-6, .residual = 1e-8, .steps = 1});
    const double now = energy(model, displacement(*simulation));
    EXPECT_LE(now, before * (1 + 1e-6)) << "step " << step;  // displacements are shown in float
    falls += now < before * (1 - 1e-6);
    before = now;
  }
  EXPECT_GT(falls, 3);
  EXPECT_GT(before, 0);
}

/// A bar whose ends are drawn apart while its sides are free to shrink. Nodes of its ends slide on rollers in effect:
/// the bar is long, and the stress is taken in the middle.
TEST_P(MassSpring, StretchedBarHasTheStressOfYoungsModulus) {
  const Geometry grid = lattice({7, 7, 31}, glm::dvec3(4));
  const std::vector<std::uint8_t> soft(6 * 6 * 30, 0);
  const Model model = make_model(grid, soft, tissues());
  Loads loads = free_loads(model);
  for (std::size_t n = 0; n < model.nodes(); ++n) {
    const std::int64_t z = place_of(model, n).z;
    if (z == 0) place(loads, n, glm::dvec3(0));
    if (z == 30) place(loads, n, {0, 0, 1.2});  // 1 %
  }
  const auto simulation = make(model);
  simulation->set_loads(loads);
  EXPECT_TRUE(simulation->advance(1, kTight).reached);
  const std::vector<glm::vec3> u = displacement(*simulation);
  double pull = 0;
  const std::vector<glm::dvec3> force = net_forces(model, u);
  for (std::size_t n = 0; n < model.nodes(); ++n) {
    if (place_of(model, n).z == 30) pull -= force[n].z;
  }
  const auto node = [](int x, int y, int z) { return static_cast<std::size_t>(x + 7 * (y + 7 * z)); };
  const double strain = (double{u[node(3, 3, 20)].z} - double{u[node(3, 3, 10)].z}) / 40;
  const double shrink = (double{u[node(6, 3, 15)].x} - double{u[node(0, 3, 15)].x}) / 24;
  EXPECT_NEAR(pull / (24 * 24) / strain, 0.01, 0.01 * 0.04);  // N/mm2, Young's modulus
  EXPECT_NEAR(-shrink / strain, 0.25, 0.01);                  // Poisson's ratio
}

TEST_P(MassSpring, ReactionsOfALoadedLatticeBearTheLoad) {
  Random random(test_seed(), 5);
  SCOPED_TRACE(seed_text(test_seed()));
  const Model model = random_model(lattice({5, 6, 5}), random, 2);
  Loads loads = free_loads(model);
  loads.force.assign(model.nodes(), glm::vec3(0));
  glm::dvec3 load(0), reaction(0);
  for (std::size_t n = 0; n < model.nodes(); ++n) {
    const bool is_bottom = place_of(model, n).z == 0;
    if (is_bottom) place(loads, n, glm::dvec3(0));
    loads.force[n] = {1e-3f, -2e-3f, static_cast<float>(random.real(0, 3e-3))};
    if (is_bottom) continue;  // forces on placed nodes do nothing
    for (int axis = 0; axis < 3; ++axis) load[axis] += double{loads.force[n][axis]};
  }
  const auto simulation = make(model);
  simulation->set_loads(loads);
  for (const double part : {0.5, 1.0}) {
    EXPECT_TRUE(simulation->advance(part, kTight).reached);
    const std::vector<glm::dvec3> force = net_forces(model, displacement(*simulation));
    reaction = glm::dvec3(0);
    for (std::size_t n = 0; n < model.nodes(); ++n) {
      if (loads.constraint[n] == Constraint::placed) reaction += force[n];
    }
    for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(reaction[axis], part * load[axis], 1e-3 * glm::length(load));
  }
}

TEST_P(MassSpring, NewForcesBeginWhereTheOldOnesAre) {
  const Model model = make_model(lattice({3, 3, 3}), std::vector<std::uint8_t>(8, 0), tissues());
  Loads loads = free_loads(model);
  for (std::size_t n = 0; n < 9; ++n) place(loads, n, glm::dvec3(0));
  const auto simulation = make(model);
  const auto reaction = [&](float force, double part) {
    loads.force.assign(model.nodes(), glm::vec3(0));
    loads.force[22].x = force;  // middle of the top
    simulation->set_loads(loads);
    EXPECT_TRUE(simulation->advance(part, kTight).reached);
    const std::vector<glm::dvec3> forces = net_forces(model, displacement(*simulation));
    double sum = 0;
    for (std::size_t n = 0; n < 9; ++n) sum += forces[n].x;
    return sum;
  };
  EXPECT_NEAR(reaction(0.04f, 1), 0.04, 1e-5);
  EXPECT_NEAR(reaction(0.02f, 0.5), 0.03, 1e-5);
  EXPECT_NEAR(reaction(0, 1), 0, 1e-5);
}

TEST_P(MassSpring, NodesThatNothingTiesStayWhereTheyAre) {
  const Geometry grid = lattice({3, 3, 3});
  std::vector<std::uint32_t> copies{13};  // a second node at the middle, without any link
  const Model model = make_model(grid, std::vector<std::uint8_t>(8, 0), tissues(), copies);
  ASSERT_EQ(model.nodes(), 28u);
  const auto simulation = make(model);
  simulation->set_loads(pressed(model, {2, 0, 1}));
  const Convergence convergence = simulation->advance(1, {});
  EXPECT_TRUE(convergence.reached);
  EXPECT_GT(convergence.steps, 0);
  EXPECT_EQ(displacement(*simulation)[27], glm::vec3(0));
}

/// The cells of a lattice of 3 x 3 x 3 vertices above the middle layer get a middle layer of their own.
Model cut_model() {
  std::vector<std::uint32_t> copies;
  for (std::uint32_t v = 9; v < 18; ++v) copies.push_back(v);
  std::vector<CellPiece> pieces;
  for (std::uint64_t cell = 4; cell < 8; ++cell) {
    CellPiece piece{.cell = cell, .node = {}, .volume = 1};
    for (std::uint32_t c = 0; c < 8; ++c) {
      const std::uint32_t x = (cell & 1) + (c & 1), y = (cell >> 1 & 1) + (c >> 1 & 1), z = 1 + (c >> 2);
      piece.node[c] = z == 1 ? 27 + x + 3 * y : x + 3 * y + 9 * z;
    }
    pieces.push_back(piece);
  }
  return make_model(lattice({3, 3, 3}), std::vector<std::uint8_t>(8, 0), tissues(), copies, pieces);
}

TEST_P(MassSpring, NothingPullsAcrossACut) {
  const Model model = cut_model();
  Loads loads = free_loads(model);
  for (std::size_t n = 0; n < 9; ++n) place(loads, n, glm::dvec3(0));
  for (std::size_t n = 18; n < 27; ++n) place(loads, n, {0.5 * static_cast<double>(n % 3), 1, 9});
  const auto simulation = make(model);
  simulation->set_loads(loads);
  EXPECT_TRUE(simulation->advance(1, kTight).reached);
  const std::vector<glm::vec3> found = displacement(*simulation);
  for (std::size_t n = 9; n < 18; ++n) EXPECT_EQ(found[n], glm::vec3(0));
  for (std::size_t n = 27; n < 36; ++n) EXPECT_GT(found[n].z, 8);  // goes with its own side
  const std::vector<glm::dvec3> expected = dense_equilibrium(model, loads);
  EXPECT_LT(furthest(found, [&](std::size_t n) { return expected[n]; }), 2e-6);
}

TEST_P(MassSpring, PartsOfTheWayLeadToTheSameEnd) {
  Random random(test_seed(), 7);
  SCOPED_TRACE(seed_text(test_seed()));
  const Model model = random_model(lattice({5, 6, 7}), random, 1);
  const Loads loads = pressed(model, {2, 1, -4});
  const auto at_once = make(model), bit_by_bit = make(model);
  at_once->set_loads(loads);
  bit_by_bit->set_loads(loads);
  EXPECT_TRUE(at_once->advance(1, kTight).reached);
  for (const double part : {0.25, 0.5, 1.0}) {
    EXPECT_TRUE(bit_by_bit->advance(part, kTight).reached);
    const std::size_t handle = model.nodes() - 5;  // x = 0, y and z last
    EXPECT_EQ(displacement(*bit_by_bit)[handle], static_cast<float>(part) * glm::vec3(2, 1, -4));
  }
  EXPECT_LT(furthest(displacement(*at_once), displacement(*bit_by_bit)), 2e-6);
}

TEST_P(MassSpring, RunsAgainGiveTheSameBits) {
  Random random(test_seed(), 8);
  SCOPED_TRACE(seed_text(test_seed()));
  const Model model = random_model(lattice({14, 13, 12}), random, 2);
  const auto run = [&] {
    const auto simulation = make(model);
    simulation->set_loads(pressed(model, {3, 2, -6}));
    simulation->advance(1, {.steps = 12});
    return displacement(*simulation);
  };
  EXPECT_EQ(run(), run());
}

TEST_P(MassSpring, GivenDisplacementsAreTheStart) {
  const Model model = make_model(lattice({3, 3, 4}), std::vector<std::uint8_t>(12, 0), tissues());
  const auto simulation = make(model);
  std::vector<glm::vec3> start(model.nodes(), glm::vec3(1, 2, 3));
  simulation->set_displacement(start);
  EXPECT_EQ(displacement(*simulation), start);
  Loads loads = free_loads(model);
  for (std::size_t n = 0; n < 9; ++n) place(loads, n, {1, 2, 3});
  simulation->set_loads(loads);
  EXPECT_TRUE(simulation->advance(1, {}).reached);
  EXPECT_EQ(displacement(*simulation), start);
  for (std::size_t n = 0; n < 9; ++n) place(loads, n, {0, 0, 0});
  simulation->set_loads(loads);
  EXPECT_TRUE(simulation->advance(0.5, {}).reached);
  EXPECT_LT(furthest(displacement(*simulation), std::vector<glm::vec3>(model.nodes(), {0.5f, 1, 1.5f})), 1e-4);
}

TEST_P(MassSpring, AStopEndsIt) {
  const Model model = make_model(lattice({9, 9, 9}), std::vector<std::uint8_t>(512, 0), tissues());
  const auto simulation = make(model);
  simulation->set_loads(pressed(model, {0, 0, -10}));
  std::stop_source stop;
  Control control{.progress = [&](double) { stop.request_stop(); }, .stop = stop.get_token()};
  EXPECT_THROW(simulation->advance(1, kTight, control), Cancelled);
  for (const glm::vec3& u : displacement(*simulation)) EXPECT_TRUE(std::isfinite(u.x + u.y + u.z));
  EXPECT_TRUE(simulation->advance(1, {}).reached);
}

TEST_P(MassSpring, LoadsThatDoNotFitAreRefused) {
  const Model model = make_model(lattice({3, 3, 3}), std::vector<std::uint8_t>(8, 0), tissues());
  const auto simulation = make(model);
  const auto refused = [&](const std::function<void(Loads&)>& change) {
    Loads loads = pressed(model, {1, 0, 0});
    change(loads);
    try {
      simulation->set_loads(loads);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(refused([](Loads&) {}), "");
  EXPECT_TRUE(says(refused([](Loads& loads) { loads.constraint.pop_back(); }), {"one hold a node", "27", "found 26"}));
  EXPECT_TRUE(says(refused([](Loads& loads) { loads.goal.pop_back(); }), {"one goal a node", "27", "found 26"}));
  EXPECT_TRUE(says(refused([](Loads& loads) { loads.force.resize(3); }), {"one force a node", "27", "found 3"}));
  EXPECT_TRUE(says(refused([](Loads& loads) { loads.goal[2].y = NAN; }), {"goal of node 2", "nan"}));
  EXPECT_TRUE(says(refused([](Loads& loads) { loads.goal[2].y = 2e6f; }), {"goal of node 2", "2000000", "at most"}));
  EXPECT_TRUE(says(refused([](Loads& loads) {
                     loads.force.assign(27, glm::vec3(0));
                     loads.force[13].z = INFINITY;
                   }),
                   {"force of node 13", "inf"}));
  EXPECT_TRUE(says(refused([](Loads& loads) {
                     loads.constraint.assign(27, Constraint::free);
                     loads.force.assign(27, glm::vec3(0));
                     loads.force[4].x = 1;
                   }),
                   {"force on node 4", "no placed node"}));
  EXPECT_EQ(refused([](Loads& loads) { loads.constraint.assign(27, Constraint::free); }), "");
  EXPECT_TRUE(simulation->advance(1, {}).reached);
  EXPECT_EQ(displacement(*simulation), std::vector<glm::vec3>(27, glm::vec3(0)));
  EXPECT_THROW(simulation->advance(1.5, {}), InputError);
  EXPECT_THROW(simulation->advance(1, {.steps = 0}), InputError);
  EXPECT_THROW(simulation->set_displacement(std::vector<glm::vec3>(26)), InputError);
  Model broken = model;
  broken.stiffness.pop_back();
  EXPECT_THROW(make(broken), InputError);
}

TEST(MassSpringOnCpu, ResultIsIndependentOfThreadCount) {
  Random random(test_seed(), 9);
  SCOPED_TRACE(seed_text(test_seed()));
  const Model model = random_model(lattice({17, 16, 15}), random, 3);  // several blocks
  std::vector<glm::vec3> first;
  for (const int threads : {1, 2, 5}) {
    const auto simulation = make_cpu_mass_spring(model, {.threads = threads});
    simulation->set_loads(pressed(model, {3, 2, -9}));
    simulation->advance(1, {.steps = 8});
    if (first.empty()) first = displacement(*simulation);
    EXPECT_EQ(displacement(*simulation), first) << threads << " threads";
  }
}

/// Plays loads on a simulation: handles that turn, forces, new loads on the way, and a start from given displacements.
/// @return the bits of all that it shows and says
std::vector<std::uint32_t> played(const Model& model, Simulation& simulation, Random random) {
  std::vector<std::uint32_t> bits;
  const auto advance = [&](double part, int steps) {
    const Convergence convergence = simulation.advance(part, {.steps = steps});
    for (const glm::vec3& u : displacement(simulation)) {
      for (int axis = 0; axis < 3; ++axis) bits.push_back(std::bit_cast<std::uint32_t>(u[axis]));
    }
    bits.push_back(static_cast<std::uint32_t>(convergence.steps));
    for (const double number : {convergence.motion_mm, convergence.residual}) {
      const auto of_number = std::bit_cast<std::array<std::uint32_t, 2>>(number);
      bits.insert(bits.end(), of_number.begin(), of_number.end());
    }
  };
  Loads loads = pressed(model, {random.real(-2, 2), random.real(-2, 2), random.real(-3, 3)});
  simulation.set_loads(loads);
  advance(0.5, 3);
  advance(1, 12);
  loads.force.assign(model.nodes(), glm::vec3(0));
  for (std::size_t n = 0; n < model.nodes(); ++n) {
    if (random.chance(0.1)) place(loads, n, {random.real(-1, 1), random.real(-1, 1), -0.0});
    if (random.chance(0.2)) loads.force[n] = {static_cast<float>(random.real(-1e-2, 1e-2)), -0.0f, 1e-3f};
  }
  simulation.set_loads(loads);
  advance(0.3, 4);
  simulation.set_displacement(std::vector<glm::vec3>(model.nodes(), {0.25f, -0.0f, 1}));
  advance(1, 40);
  return bits;
}

/// Sums of doubles show their order: by halves, 2^53 + 1 + 1 is 2^53 + 2 if the ones meet first, else 2^53.
TEST(MassSpringSums, AreMadeInTheOrderThatIsStated) {
  constexpr double kLarge = 0x1p53;
  const auto of_block = [](std::initializer_list<std::pair<std::size_t, double>> given) {
    Products terms[kSumBlock];
    for (const auto& [place, value] : given) terms[place].rz = value;
    return tree_sum(terms).rz;
  };
  EXPECT_EQ(of_block({{0, kLarge}, {1, 1}, {129, 1}}), kLarge + 2);
  EXPECT_EQ(of_block({{0, kLarge}, {1, 1}, {128, 1}}), kLarge);
  EXPECT_EQ(of_block({{0, kLarge}, {2, 1}, {3, 1}}), kLarge);
  EXPECT_EQ(of_block({{0, kLarge}, {1, 1}, {3, 1}}), kLarge + 2);
  const auto of_blocks = [](std::initializer_list<std::pair<std::size_t, double>> given) {
    std::vector<Products> blocks(3 * kSumBlock + 5);
    for (const auto& [place, value] : given) blocks[place].rz = value;
    return sum_of_blocks(std::span<const Products>(blocks)).rz;
  };
  EXPECT_EQ(of_blocks({{0, kLarge}, {1, 1}, {129, 1}}), kLarge + 2);
  EXPECT_EQ(of_blocks({{256, kLarge}, {512, 1}, {768, 1}}), kLarge);
  EXPECT_EQ(of_blocks({{512, kLarge}, {0, 1}, {256, 1}}), kLarge + 2);
}

TEST(MassSpringBits, OfKeptMatricesAreTheUpperHalfOfFloats) {
  const auto kept = [](double number) { return float{Bfloat16(number)}; };
  for (const double exact : {0.0, 1.0, -1.5, 0x1.fep100, -0x1.02p-120}) EXPECT_EQ(kept(exact), exact);
  EXPECT_EQ(kept(1 + 0x1p-8), 1);            // ties go to the even neighbour: down,
  EXPECT_EQ(kept(1 + 0x3p-8), 1 + 0x1p-6f);  // and up
  EXPECT_EQ(kept(-1 - 0x1.01p-8), -1 - 0x1p-7f);
  EXPECT_EQ(kept(1 + 0x1p-8 - 0x1p-20), 1);
  EXPECT_EQ(kept(0x1.ffp3), 16);  // carries into the exponent
}

TEST(MassSpringBits, AreThoseOfOneNodeAfterTheOther) {
  for (std::uint64_t number = 0; number < test_cases(4); ++number) {
    SCOPED_TRACE(seed_text(test_seed()) + ", case " + std::to_string(number));
    Random random(test_seed(), 200 + number);
    // Several blocks of sums; links that do not lead to the next vertex; cells that are no cubes.
    const Model models[] = {random_model(lattice({12, 11, 13}), random, 2), cut_model(),
                            random_model(lattice({9, 4, 3}, {3.1, 0.7, 12}), random, 3)};
    for (const Model& model : models) {
      SCOPED_TRACE(std::to_string(model.nodes()) + " nodes");
      const Random loads(test_seed(), 300 + number);
      const auto one_by_one = make_mass_spring(model, std::make_unique<SpringSolver<PlainMachine>>(model));
      const std::vector<std::uint32_t> expected = played(model, *one_by_one, loads);
      for (const SpringMethod& method : methods()) {
        if (!method.cannot_run.empty()) continue;
        EXPECT_TRUE(played(model, *method.make(model), loads) == expected) << method.name;
      }
      for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
        const OnInstructionSet on(target);
        EXPECT_TRUE(played(model, *make_cpu_mass_spring(model), loads) == expected) << hwy::TargetName(target);
      }
    }
  }
}

}  // namespace
}  // namespace tetwarp::simulate
