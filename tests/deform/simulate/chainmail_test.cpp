// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/simulate/chainmail.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <glm/matrix.hpp>

#include "backend/devices.h"
#include "backend/factories.h"
#include "tests/support/random.h"
#include "tests/support/says.h"

namespace tetwarp::simulate {
namespace {

using test::Random;
using Field = std::vector<glm::vec3>;

struct Backend {
  std::string name, cannot_run;
  std::function<std::unique_ptr<Simulation>(const Model& model, int threads)> make;
};

std::vector<Backend> backends() {
  const std::string no_cuda = !has_cuda()           ? "CUDA is not in this build"
                              : device_count() == 0 ? "no CUDA device on this machine"
                                                    : "";
  return {{"cpu", "", [](const Model& model, int threads) { return make_cpu_chainmail(model, {.threads = threads}); }},
          {"cuda", no_cuda, [](const Model& model, int) {
             return make_simulation(BackendKind::cuda, simulate::Method::chainmail, model);
           }}};
}

class Chainmail : public testing::TestWithParam<Backend> {
 protected:
  void SetUp() override {
    if (!GetParam().cannot_run.empty()) GTEST_SKIP() << GetParam().cannot_run;
  }
  static std::unique_ptr<Simulation> make(const Model& model, int threads = 0) {
    return GetParam().make(model, threads);
  }
};
INSTANTIATE_TEST_SUITE_P(Backends, Chainmail, testing::ValuesIn(backends()),
                         [](const auto& of) { return of.param.name; });

Geometry lattice(const glm::i64vec3& size, const glm::dvec3& spacing = glm::dvec3(8)) {
  return {.size = size, .spacing = spacing};
}

std::size_t vertex_at(const Geometry& grid, std::int64_t i, std::int64_t j, std::int64_t k) {
  return static_cast<std::size_t>(i + grid.size.x * (j + grid.size.y * k));
}

/// Few of the first tissue.
std::vector<std::uint8_t> random_cells(const Geometry& grid, Random& random, std::int64_t tissues) {
  std::vector<std::uint8_t> cells(static_cast<std::size_t>((grid.size.x - 1) * (grid.size.y - 1) * (grid.size.z - 1)));
  for (std::uint8_t& cell : cells) {
    cell = static_cast<std::uint8_t>(random.chance(0.04) ? 0 : random.integer(1, tissues - 1));
  }
  return cells;
}

std::vector<Tissue> random_tissues(Random& random) {
  std::vector<Tissue> tissues{{.name = "rigid", .compression = 0, .stretch = 0, .shear = 0}};
  for (int n = 0; n < 3; ++n) {
    tissues.push_back({.name = "soft",
                       .compression = random.real(0, 0.5),
                       .stretch = random.real(0, 0.5),
                       .shear = random.real(0, 0.5)});
  }
  return tissues;
}

Geometry random_lattice(Random& random) {
  return lattice({random.integer(2, 11), random.integer(2, 13), random.integer(2, 10)},
                 {random.real(2, 9), random.real(2, 9), random.real(2, 9)});
}

Model random_model(const Geometry& grid, Random& random) {
  const std::vector<Tissue> tissues = random_tissues(random);
  return make_model(grid, random_cells(grid, random, 4), tissues);
}

Field random_field(std::size_t nodes, Random& random, double most) {
  Field field(nodes);
  for (glm::vec3& u : field) {
    for (int c = 0; c < 3; ++c) u[c] = static_cast<float>(random.real(-most, most));
  }
  return field;
}

Loads no_loads(const Model& model) {
  return {.constraint = std::vector<Constraint>(model.nodes(), Constraint::free),
          .goal = Field(model.nodes()),
          .force = {}};
}

void place(Loads& loads, std::size_t node, const glm::vec3& goal) {
  loads.constraint[node] = Constraint::placed;
  loads.goal[node] = goal;
}

/// Places some nodes where a state within the limits has them.
Loads loads_within_limits(const Model& model, Random& random) {
  const auto simulation = make_cpu_chainmail(model);
  simulation->set_displacement(random_field(model.nodes(), random, 30));
  const Field within = simulation->displacement_on_host();
  Loads loads = no_loads(model);
  for (std::size_t n = 0; n < model.nodes(); ++n) {
    if (random.chance(0.03)) place(loads, n, within[n]);
  }
  return loads;
}

TEST_P(Chainmail, AllLinksStayWithinTheirLimitsAndPlacedNodesAreAtTheirGoals) {
  const std::uint64_t seed = test::test_seed();
  for (std::uint64_t number = 0; number < test::test_cases(40) && !HasFailure(); ++number) {
    SCOPED_TRACE(test::seed_text(seed) + ", model " + std::to_string(number));
    Random random(seed, 7'000'000 + number);
    const Geometry grid = random_lattice(random);
    const Model model = random_model(grid, random);
    const Loads loads = loads_within_limits(model, random);
    const auto simulation = make(model);
    simulation->set_loads(loads);
    for (const int steps : {0, 1, 7, 60}) {
      simulation->advance(1, {.motion_mm = 0, .steps = steps});
      const Field found = simulation->displacement_on_host();
      EXPECT_TRUE(links_beyond_limits(model, found, 0).empty()) << "after " << steps << " steps";
      for (std::size_t n = 0; n < model.nodes(); ++n) {
        if (loads.constraint[n] == Constraint::placed) {
          EXPECT_EQ(found[n], loads.goal[n]);
        }
      }
    }
  }
}

TEST_P(Chainmail, AnObliqueLatticeGivesTheTurnedResult) {
  Random random(test::test_seed(), 7'100'000);
  const Geometry straight = lattice({6, 7, 5}, {3, 4, 5});
  const std::vector<Tissue> tissues = random_tissues(random);
  const std::vector<std::uint8_t> cells = random_cells(straight, random, 4);
  const Model model = make_model(straight, cells, tissues);
  Geometry oblique = straight;
  oblique.direction = {{0.6, 0, 0.8}, {-0.8, 0, 0.6}, {0, -1, 0}};
  const Model turned = make_model(oblique, cells, tissues);
  const auto turn = [&](const glm::vec3& u) {
    glm::vec3 result;
    for (int a = 0; a < 3; ++a) {
      result[a] = static_cast<float>(oblique.direction[0][a] * double{u.x} + oblique.direction[1][a] * double{u.y} +
                                     oblique.direction[2][a] * double{u.z});
    }
    return result;
  };
  const Loads loads = loads_within_limits(model, random);
  Loads loads_turned = loads;
  for (glm::vec3& goal : loads_turned.goal) goal = turn(goal);
  const auto first = make(model), second = make(turned);
  first->set_loads(loads);
  second->set_loads(loads_turned);
  first->advance(1, {.motion_mm = 0, .steps = 20});
  second->advance(1, {.motion_mm = 0, .steps = 20});
  const Field expected = first->displacement_on_host(), found = second->displacement_on_host();
  EXPECT_TRUE(links_beyond_limits(turned, found, 1e-3).empty());
  for (std::size_t n = 0; n < found.size(); ++n) {
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(found[n][c], turn(expected[n])[c], 2e-3);
  }
}

TEST_P(Chainmail, HandlesThatContradictEachOtherBreakOnlyTheirOwnLinks) {
  const Geometry grid = lattice({9, 7, 7});
  const std::vector<Tissue> soft{{.name = "soft", .compression = 0.25, .stretch = 0.125, .shear = 0.25}};
  const Model model = make_model(grid, std::vector<std::uint8_t>(8 * 6 * 6), soft);
  const std::size_t held = vertex_at(grid, 3, 3, 3), pulled = vertex_at(grid, 4, 3, 3);
  Loads loads = no_loads(model);
  place(loads, held, {});
  place(loads, pulled, {10, 0, 0});
  const auto simulation = make(model);
  simulation->set_loads(loads);
  simulation->advance(1, {.steps = 20});
  const Field found = simulation->displacement_on_host();
  EXPECT_EQ(found[held], glm::vec3(0));
  EXPECT_EQ(found[pulled], glm::vec3(10, 0, 0));
  const std::vector<BrokenLink> broken = links_beyond_limits(model, found, 0);
  EXPECT_NE(std::find(broken.begin(), broken.end(), BrokenLink{static_cast<std::uint32_t>(held), 0, 9}), broken.end());
  std::vector<BrokenLink> expected;  // found by a walk over the two nodes' links, in whole 2^-16 mm
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t n = 0; n < model.nodes(); ++n) {
      const std::int32_t up = model.neighbour[model.link(direction_up(axis), n)];
      if (up < 0) continue;
      const auto other = static_cast<std::size_t>(up);
      double beyond = 0;
      for (int c = 0; c < 3; ++c) {
        const double apart = double{found[other][c]} - double{found[n][c]};
        beyond = std::max({beyond, apart - (c == axis ? 1 : 2), -2 - apart});
      }
      if (beyond > 0) {
        expected.push_back({static_cast<std::uint32_t>(n), axis, beyond});
        EXPECT_TRUE(n == held || n == pulled || other == held || other == pulled) << "axis " << axis << " node " << n;
      }
    }
  }
  EXPECT_EQ(broken, expected);
}

/// Smallest determinant of the tetrahedra of both five-fold splits of all cells, over that at rest.
double smallest_volume(const Geometry& grid, const Field& found) {
  double smallest = INFINITY;
  const auto place = [&](const glm::ivec3& at) {
    const glm::vec3 u = found[vertex_at(grid, at.x, at.y, at.z)];
    return grid.spacing * glm::dvec3(at) + glm::dvec3(double{u.x}, double{u.y}, double{u.z});
  };
  const auto look = [&](const glm::ivec3& a, const glm::ivec3& b, const glm::ivec3& c, const glm::ivec3& d) {
    const glm::dvec3 p = place(a);
    const glm::dmat3 rest(glm::dvec3(b - a), glm::dvec3(c - a), glm::dvec3(d - a)),
        deformed(place(b) - p, place(c) - p, place(d) - p);
    smallest = std::min(smallest, glm::determinant(deformed) / glm::determinant(rest));
  };
  for (int k = 0; k + 1 < grid.size.z; ++k) {
    for (int j = 0; j + 1 < grid.size.y; ++j) {
      for (int i = 0; i + 1 < grid.size.x; ++i) {
        const glm::ivec3 first(i, j, k);
        const auto corner = [&](int c) { return first + glm::ivec3(c & 1, c >> 1 & 1, c >> 2); };
        for (int c = 0; c < 8; ++c) look(corner(c), corner(c ^ 1), corner(c ^ 2), corner(c ^ 4));
        look(corner(0), corner(3), corner(5), corner(6));
        look(corner(7), corner(4), corner(2), corner(1));
      }
    }
  }
  return smallest;
}

TEST_P(Chainmail, LimitsWithDominantDiagonalsKeepTetrahedraFromTurningOver) {
  const std::uint64_t seed = test::test_seed();
  for (std::uint64_t number = 0; number < test::test_cases(20) && !HasFailure(); ++number) {
    SCOPED_TRACE(test::seed_text(seed) + ", model " + std::to_string(number));
    Random random(seed, 7'150'000 + number);
    const Geometry grid = lattice({6, 6, 6}, {random.real(3, 9), random.real(3, 9), random.real(3, 9)});
    const auto tissue = [&](double compression, double below_bound) {
      double shear = INFINITY;
      for (int a = 0; a < 3; ++a) {
        const double others = grid.spacing.x + grid.spacing.y + grid.spacing.z - grid.spacing[a];
        shear = std::min(shear, below_bound * (1 - compression) * grid.spacing[a] / others);
      }
      return Tissue{.name = "soft", .compression = compression, .stretch = random.real(0, 2), .shear = shear};
    };
    const std::vector<Tissue> tissues{tissue(random.real(0, 0.9), 0.99), tissue(random.real(0, 0.9), 0.99)};
    const Model model = make_model(grid, random_cells(grid, random, 2), tissues);
    const auto simulation = make(model);
    simulation->set_displacement(random_field(model.nodes(), random, 80));
    EXPECT_GT(smallest_volume(grid, simulation->displacement_on_host()), 0);
  }
}

TEST_P(Chainmail, RestStaysRest) {
  Random random(test::test_seed(), 7'200'000);
  const Geometry grid = lattice({6, 9, 5});
  const Model model = random_model(grid, random);
  Loads loads = no_loads(model);
  for (std::size_t n = 0; n < model.nodes(); n += 17) place(loads, n, {});
  const auto simulation = make(model);
  simulation->set_loads(loads);
  const Convergence convergence = simulation->advance(1, {});
  EXPECT_EQ(convergence.steps, 1);
  EXPECT_EQ(convergence.motion_mm, 0);
  EXPECT_TRUE(convergence.reached);
  for (const glm::vec3& u : simulation->displacement_on_host()) EXPECT_EQ(u, glm::vec3(0));
}

TEST_P(Chainmail, APulledVertexDragsTheOthersJustAsFarAsGibsonsRuleSays) {
  const Geometry grid = lattice({15, 13, 11});
  const std::vector<Tissue> soft{{.name = "soft", .compression = 0.25, .stretch = 0.125, .shear = 0.5}};
  const Model model = make_model(grid, std::vector<std::uint8_t>(14 * 12 * 10), soft);
  const glm::ivec3 at(6, 5, 4);
  const glm::vec3 goal(7, -6, 9.5);
  Loads loads = no_loads(model);
  place(loads, vertex_at(grid, at.x, at.y, at.z), goal);
  const auto simulation = make(model);
  simulation->set_loads(loads);
  const Convergence convergence = simulation->advance(1, {.steps = 0});
  EXPECT_EQ(convergence.steps, 0);
  const Field found = simulation->displacement_on_host();
  for (int k = 0; k < 11; ++k) {
    for (int j = 0; j < 13; ++j) {
      for (int i = 0; i < 15; ++i) {
        const glm::ivec3 steps = glm::ivec3(i, j, k) - at;
        glm::vec3 expected(0);
        for (int c = 0; c < 3; ++c) {
          const float sign = goal[c] < 0 ? -1.0f : 1.0f;
          float slack =
              0;  // ahead of the pulled vertex links shrink by 2 mm, behind it they grow by 1; across, shift by 4
          for (int a = 0; a < 3; ++a) {
            const bool ahead = static_cast<float>(steps[a]) * sign > 0;
            slack += static_cast<float>(std::abs(steps[a])) * (a == c ? (ahead ? 2.0f : 1.0f) : 4.0f);
          }
          expected[c] = sign * std::max(0.0f, std::abs(goal[c]) - slack);
        }
        EXPECT_EQ(found[vertex_at(grid, i, j, k)], expected) << i << " " << j << " " << k;
      }
    }
  }
}

Field settle(Simulation& simulation, const Loads& loads, int steps) {
  simulation.set_loads(loads);
  for (const double part : {0.3, 1.0}) simulation.advance(part, {.motion_mm = 0, .steps = steps});
  return simulation.displacement_on_host();
}

TEST_P(Chainmail, AnyNumberOfThreadsAndAnyBackendGiveTheSameBits) {
  const std::uint64_t seed = test::test_seed();
  for (std::uint64_t number = 0; number < test::test_cases(20) && !HasFailure(); ++number) {
    SCOPED_TRACE(test::seed_text(seed) + ", model " + std::to_string(number));
    Random random(seed, 7'300'000 + number);
    const Model model = random_model(random_lattice(random), random);
    Loads loads = loads_within_limits(model, random);
    if (random.chance(0.5)) place(loads, 0, {20, -30, 40});  // contradicts some
    const int steps = static_cast<int>(random.integer(0, 90));
    const Field expected = settle(*make_cpu_chainmail(model, {.threads = 1}), loads, steps);
    for (const int threads : {1, 2, 5}) EXPECT_EQ(settle(*make(model, threads), loads, steps), expected) << threads;
    const StoppingRule rule{.motion_mm = 0.02, .steps = 500};
    const auto first = make_cpu_chainmail(model, {.threads = 1}), second = make(model);
    first->set_loads(loads);
    second->set_loads(loads);
    const Convergence on_cpu = first->advance(0.7, rule), here = second->advance(0.7, rule);
    EXPECT_EQ(on_cpu.steps, here.steps);
    EXPECT_EQ(on_cpu.motion_mm, here.motion_mm);
    EXPECT_EQ(on_cpu.reached, here.reached);
  }
}

TEST_P(Chainmail, SecondAdvancesGoWhereTheFirstWould) {
  // From rest, a way of no length changes nothing but that paths of sets of placed nodes are kept from then on.
  for (std::uint64_t number = 0; number < test::test_cases(40); ++number) {
    Random random(test::test_seed(), 4000 + number);
    SCOPED_TRACE(test::seed_text(test::test_seed()) + ", case " + std::to_string(number));
    const Model model = random_model(random_lattice(random), random);
    Loads loads = no_loads(model);
    const std::int64_t sets = random.integer(0, 10);  // of more than eight no paths are kept
    std::vector<glm::vec3> goals;
    for (std::int64_t n = 0; n < sets; ++n) goals.push_back(n == 0 ? glm::vec3(0) : random_field(1, random, 30)[0]);
    for (std::size_t n = 0; n < model.nodes() && sets > 0; ++n) {
      if (random.chance(0.1)) place(loads, n, goals[static_cast<std::size_t>(random.integer(0, sets - 1))]);
    }
    const StoppingRule rule{.motion_mm = 0, .steps = static_cast<int>(random.integer(0, 4))};
    const auto first = make(model), second = make(model);
    first->set_loads(loads);
    second->set_loads(loads);
    second->advance(0, {.motion_mm = 0, .steps = 0});
    const double part = random.real(0.1, 1);
    const Convergence one = first->advance(part, rule), other = second->advance(part, rule);
    EXPECT_EQ(first->displacement_on_host(), second->displacement_on_host());
    EXPECT_EQ(one.motion_mm, other.motion_mm);
    const double further = random.real(0.1, 1);
    first->advance(further, rule);
    second->advance(further, rule);
    EXPECT_EQ(first->displacement_on_host(), second->displacement_on_host());
  }
}

TEST_P(Chainmail, AMirroredLatticeGivesTheMirroredBits) {
  Random random(test::test_seed(), 7'400'000);
  const Geometry grid = lattice({8, 7, 6}, {5, 6, 7});
  const std::vector<Tissue> tissues = random_tissues(random);
  const std::vector<std::uint8_t> cells = random_cells(grid, random, 4);
  std::vector<std::uint8_t> mirrored_cells(cells.size());
  for (std::size_t n = 0; n < cells.size(); ++n) mirrored_cells[n / 7 * 7 + 6 - n % 7] = cells[n];
  const Model model = make_model(grid, cells, tissues), mirrored = make_model(grid, mirrored_cells, tissues);
  const auto mirror = [](std::size_t n) { return n / 8 * 8 + 7 - n % 8; };
  const Loads loads = loads_within_limits(model, random);
  Loads other = loads;
  for (std::size_t n = 0; n < model.nodes(); ++n) {
    other.constraint[mirror(n)] = loads.constraint[n];
    other.goal[mirror(n)] = loads.goal[n] * glm::vec3(-1, 1, 1);
  }
  const Field found = settle(*make(mirrored), other, 40), expected = settle(*make(model), loads, 40);
  for (std::size_t n = 0; n < model.nodes(); ++n) EXPECT_EQ(found[mirror(n)] * glm::vec3(-1, 1, 1), expected[n]);
}

/// Where each free vertex is the mean of its neighbours, weighed by one over the squared length of the link.
std::vector<glm::dvec3> harmonic(const Model& model, const Loads& loads) {
  std::vector<glm::dvec3> u(model.nodes(), glm::dvec3(0));
  for (int sweep = 0; sweep < 4000; ++sweep) {
    for (std::size_t n = 0; n < model.nodes(); ++n) {
      if (loads.constraint[n] == Constraint::placed) {
        u[n] = {loads.goal[n].x, loads.goal[n].y, loads.goal[n].z};
        continue;
      }
      glm::dvec3 sum(0);
      double weights = 0;
      for (int axis = 0; axis < 3; ++axis) {
        const double weight = 1 / (model.lattice.spacing[axis] * model.lattice.spacing[axis]);
        for (const int to : {direction_up(axis), opposite(direction_up(axis))}) {
          const std::int32_t other = model.neighbour[model.link(to, n)];
          if (other < 0) continue;
          sum += weight * u[static_cast<std::size_t>(other)];
          weights += weight;
        }
      }
      u[n] = sum / weights;
    }
  }
  return u;
}

TEST_P(Chainmail, WhereNoLimitBindsItEndsAtTheHarmonicState) {
  Random random(test::test_seed(), 7'500'000);
  const Geometry grid = lattice({9, 8, 7}, {3, 4, 9});
  const std::vector<Tissue> wide{{.name = "wide", .compression = 1, .stretch = 100, .shear = 100}};
  Model model = make_model(grid, std::vector<std::uint8_t>(8 * 7 * 6), wide);
  for (LinkLimits& limits : model.limits) limits = {-1000, 1000, 1000};
  Loads loads = no_loads(model);
  for (int n = 0; n < 12; ++n) {
    place(loads, static_cast<std::size_t>(random.integer(0, 9 * 8 * 7 - 1)), random_field(1, random, 25)[0]);
  }
  const auto simulation = make(model);
  simulation->set_loads(loads);
  const Convergence convergence = simulation->advance(1, {.motion_mm = 3e-4});
  EXPECT_TRUE(convergence.reached);
  EXPECT_LT(convergence.steps, 200);
  const std::vector<glm::dvec3> expected = harmonic(model, loads);
  const Field found = simulation->displacement_on_host();
  for (std::size_t n = 0; n < found.size(); ++n) {
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(found[n][c], expected[n][c], 0.01);
  }
}

/// A lattice cut in two between i = 1 and i = 2: the halves have copies of the other's vertices.
Model model_cut_in_two(const Geometry& grid) {
  const auto rows = static_cast<std::uint32_t>(grid.size.y * grid.size.z),
             width = static_cast<std::uint32_t>(grid.size.x);
  std::vector<std::uint32_t> copies_of;
  for (const std::uint32_t i : {2u, 1u}) {
    for (std::uint32_t row = 0; row < rows; ++row) copies_of.push_back(i + width * row);
  }
  std::vector<CellPiece> pieces;
  const auto high = static_cast<std::uint32_t>(grid.size.y);
  for (std::uint32_t k = 0; k + 1 < grid.size.z; ++k) {
    for (std::uint32_t j = 0; j + 1 < high; ++j) {
      for (const bool is_left : {true, false}) {
        CellPiece piece{.cell = 1 + (width - 1) * (j + (high - 1) * k), .node = {}, .volume = 0.5};
        for (std::uint32_t c = 0; c < 8; ++c) {
          const std::uint32_t row = j + (c >> 1 & 1) + high * (k + (c >> 2)), i = 1 + (c & 1);
          const std::uint32_t copy = width * rows + (is_left ? 0 : rows) + row;
          piece.node[c] = (i == 1) == is_left ? i + width * row : copy;
        }
        pieces.push_back(piece);
      }
    }
  }
  const std::vector<Tissue> soft{{.name = "soft"}};
  const auto cells = static_cast<std::size_t>((grid.size.x - 1) * (grid.size.y - 1) * (grid.size.z - 1));
  return make_model(grid, std::vector<std::uint8_t>(cells), soft, copies_of, pieces);
}

TEST_P(Chainmail, NothingIsDraggedAcrossACut) {
  const Geometry grid = lattice({4, 9, 7});
  const Model model = model_cut_in_two(grid);
  Loads loads = no_loads(model);
  for (std::size_t row = 0; row < 63; ++row) place(loads, 4 * row, {-20, 0, 12});
  const auto simulation = make(model);
  simulation->set_loads(loads);
  simulation->advance(1, {.motion_mm = 0.001});
  const Field found = simulation->displacement_on_host();
  for (std::size_t row = 0; row < 63; ++row) {
    EXPECT_NE(found[4 * row + 1], glm::vec3(0));   // left of the cut
    EXPECT_NE(found[4 * 63 + row], glm::vec3(0));  // its copies
    EXPECT_EQ(found[4 * row + 2], glm::vec3(0));   // right of it
    EXPECT_EQ(found[4 * row + 3], glm::vec3(0));
    EXPECT_EQ(found[5 * 63 + row], glm::vec3(0));
  }
}

TEST_P(Chainmail, AnyDisplacementIsBroughtWithinTheLimitsAndOneWithinThemIsKept) {
  Random random(test::test_seed(), 7'600'000);
  const Model model = random_model(lattice({7, 6, 9}), random);
  const auto simulation = make(model);
  simulation->set_displacement(random_field(model.nodes(), random, 50));
  const Field within = simulation->displacement_on_host();
  EXPECT_TRUE(links_beyond_limits(model, within, 0).empty());
  simulation->set_displacement(within);
  EXPECT_EQ(simulation->displacement_on_host(), within);
  simulation->set_loads(no_loads(model));  // nothing is placed: nothing moves
  EXPECT_EQ(simulation->advance(1, {}).motion_mm, 0);
  EXPECT_EQ(simulation->displacement_on_host(), within);
}

TEST_P(Chainmail, PlacedNodesGoTheAskedPartOfTheirWayFromWhereTheyAre) {
  const Geometry grid = lattice({4, 4, 4});
  const std::vector<Tissue> soft{{.name = "soft"}};
  const Model model = make_model(grid, std::vector<std::uint8_t>(27), soft);
  Loads loads = no_loads(model);
  place(loads, 21, {8, -4, 2});
  const auto simulation = make(model);
  simulation->set_loads(loads);
  simulation->advance(0.25, {.steps = 3});
  EXPECT_EQ(simulation->displacement_on_host()[21], glm::vec3(2, -1, 0.5));
  loads.goal[21] = {4, -1, 0.5};
  simulation->set_loads(loads);
  simulation->advance(0.5, {.steps = 3});
  EXPECT_EQ(simulation->displacement_on_host()[21], glm::vec3(3, -1, 0.5));
}

TEST_P(Chainmail, ACancelledAdvanceThrowsAndLeavesAStateToGoOnFrom) {
  Random random(test::test_seed(), 7'700'000);
  const Model model = random_model(lattice({9, 9, 9}), random);
  const Loads loads = loads_within_limits(model, random);
  const auto simulation = make(model);
  simulation->set_loads(loads);
  std::stop_source source;
  source.request_stop();
  EXPECT_THROW(simulation->advance(1, {}, {.stop = source.get_token()}), Cancelled);
  EXPECT_TRUE(links_beyond_limits(model, simulation->displacement_on_host(), 0).empty());
  simulation->advance(1, {.motion_mm = 0, .steps = 30});
  EXPECT_TRUE(links_beyond_limits(model, simulation->displacement_on_host(), 0).empty());
}

TEST_P(Chainmail, WhatCannotBeUsedIsRefused) {
  const std::vector<Tissue> soft{{.name = "soft"}};
  const Model model = make_model(lattice({2, 2, 2}), std::vector<std::uint8_t>(1), soft);
  const auto simulation = make(model);
  const auto refused = [](auto&& call) {
    try {
      call();
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const auto refused_loads = [&](auto&& change) {
    Loads loads = no_loads(model);
    change(loads);
    return refused([&] { simulation->set_loads(loads); });
  };
  EXPECT_TRUE(says(refused([&] { simulation->advance(1, {}); }), {"set_loads"}));
  EXPECT_TRUE(says(refused_loads([](Loads& loads) { loads.constraint.pop_back(); }), {"hold", "8", "found 7"}));
  EXPECT_TRUE(says(refused_loads([](Loads& loads) { loads.goal.pop_back(); }), {"goal", "8", "found 7"}));
  EXPECT_TRUE(says(refused_loads([](Loads& loads) { loads.force.resize(8); }), {"no forces", "found 8"}));
  EXPECT_TRUE(says(refused_loads([](Loads& loads) { place(loads, 5, {0, NAN, 0}); }), {"goal of node 5", "nan"}));
  EXPECT_TRUE(says(refused_loads([](Loads& loads) { place(loads, 5, {0, 5000, 0}); }), {"node 5", "5000", "4096"}));
  // The goal of a free node is not read.
  EXPECT_EQ(refused_loads([](Loads& loads) { loads.goal[5] = {0, NAN, 0}; }), "");
  EXPECT_TRUE(says(refused([&] { simulation->advance(1.5, {}); }), {"1.5", "0 to 1"}));
  EXPECT_TRUE(says(refused([&] { simulation->advance(1, {.motion_mm = -1}); }), {"-1", "0 or more"}));
  EXPECT_TRUE(says(refused([&] { simulation->advance(1, {.steps = -2}); }), {"-2", "0 or more"}));
  EXPECT_TRUE(says(refused([&] { simulation->set_displacement(Field(3)); }), {"8", "found 3"}));
  EXPECT_TRUE(says(refused([&] { simulation->set_displacement(Field(8, {0, 0, INFINITY})); }), {"node 0", "inf"}));
  Model tight = model;
  tight.limits[0].longest = -1;
  EXPECT_TRUE(says(refused([&] { make(tight); }), {"axis 0", "node 0", "-1"}));
  Model sheared = model;
  sheared.lattice.direction[1].x = 0.5;
  EXPECT_TRUE(says(refused([&] { make(sheared); }), {"right angles", "0 and 1", "0.5"}));
}

}  // namespace
}  // namespace tetwarp::simulate
