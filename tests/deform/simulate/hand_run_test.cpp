// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// What a hand does: drags, pins and a ball, with few steps a frame.
#include <gtest/gtest.h>

#include <algorithm>
#include <glm/geometric.hpp>

#include "backend/devices.h"
#include "backend/factories.h"
#include "deform/simulate/chainmail.h"
#include "deform/simulate/mass_spring.h"
#include "deform/simulate/scenario_run.h"
#include "tests/deform/simulate/scenario_volumes.h"
#include "tests/support/random.h"
#include "tests/support/run.h"

namespace tetwarp::simulate {
namespace {

using namespace test;
using tetwarp::test::Random;
using tetwarp::test::seed_text;
using tetwarp::test::test_seed;

/// A random way, a place a frame. Sometimes it stays where it is.
std::vector<glm::dvec3> way(Random& random, const glm::dvec3& from, int frames) {
  std::vector<glm::dvec3> places;
  glm::dvec3 at = from;
  for (int n = 0; n < frames; ++n) {
    const bool stays = n > 0 && random.integer(0, 2) == 0;
    for (int axis = 0; axis < 3 && !stays; ++axis) at[axis] += random.real(-1.5, 1.5);
    places.push_back(at);
  }
  return places;
}

/// Grips, a pin, a ball and rests between them, on the 11 x 11 x 6 vertices of `uniform_patient`.
Scenario by_hand(Method method, Random& random) {
  Scenario scenario = scenario_of({{Zone{HalfSpace{{{0, 0, 1}}, {0, 0, -1}}}, "hold[0]"}}, {});
  scenario.method = method;
  scenario.stop = {.motion_mm = 1e-4, .residual = 1e-4, .steps = 2};
  scenario.phases.clear();
  const auto add = [&](Phase phase) {
    phase.name = "phases[" + std::to_string(scenario.phases.size()) + "]";
    scenario.phases.push_back(std::move(phase));
  };
  const std::vector<HeldZone> pin{{Zone{Sphere{{{-12, -12, 24}}, {9}}}, "pin[0]"}};
  for (int n = 0; n < 3; ++n) {
    const int frames = static_cast<int>(random.integer(3, 6));
    const glm::dvec3 at(random.real(0, 16), random.real(0, 16), 32);
    Phase grip, rest, ball;
    grip.moves = {move_of(Handle{{at}, {9}}, Drag{way(random, {}, frames)}, "move[0]")};
    grip.frames = frames;
    if (n > 0) grip.pins = pin;
    add(grip);
    rest.pins = grip.pins;
    rest.frames = 2;
    add(rest);
    ball.push = Push{8, way(random, {random.real(-16, 16), random.real(-16, 16), 43}, frames)};
    ball.pins = grip.pins;
    ball.frames = frames;
    add(ball);
  }
  return scenario;
}

using Frames = std::vector<std::vector<glm::vec3>>;

Frames run_all(const Scenario& scenario, const Patient& patient, const MakeSimulation& make) {
  ScenarioRun run(scenario, patient, make);
  Frames frames;
  while (!run.is_done()) {
    run.next();
    frames.push_back(run.displacement());
  }
  return frames;
}

MakeSimulation cpu(Method method, int threads) {
  return [=](const Model& model) {
    const Limits limits{.threads = threads, .memory = 0};
    return method == Method::chainmail ? make_cpu_chainmail(model, limits) : make_cpu_mass_spring(model, limits);
  };
}

class ByHand : public testing::TestWithParam<Method> {};

TEST_P(ByHand, TissueFollowsAndPinnedTissueStays) {
  SCOPED_TRACE(seed_text(test_seed()));
  Random random(test_seed(), 41);
  const Patient patient = uniform_patient();
  const Scenario scenario = by_hand(GetParam(), random);
  ScenarioRun run(scenario, patient, cpu(GetParam(), 1));
  EXPECT_EQ(run.counts(0).pinned, 0u);
  EXPECT_GT(run.counts(3).pinned, 8u);
  const std::vector<std::uint8_t> pinned = select(scenario.phases[3].pins[0].zone, patient);
  std::vector<glm::vec3> before;
  float most = 0;
  while (!run.is_done()) {
    const FrameResult frame = run.next();
    const std::vector<glm::vec3> now = run.displacement();
    for (std::size_t n = 0; n < now.size(); ++n) {
      if (frame.phase >= 3 && pinned[n] != 0) {
        ASSERT_EQ(now[n], before[n]) << n << " in frame " << frame.number;
      }
      most = std::max(most, glm::length(now[n]));
    }
    before = now;
  }
  EXPECT_GT(most, 1.0f);
}

TEST_P(ByHand, EveryMachineGivesTheSameBits) {
  SCOPED_TRACE(seed_text(test_seed()));
  Random random(test_seed(), 42);
  const Patient patient = uniform_patient();
  const Scenario scenario = by_hand(GetParam(), random);
  const Frames expected = run_all(scenario, patient, cpu(GetParam(), 1));
  EXPECT_TRUE(run_all(scenario, patient, cpu(GetParam(), 2)) == expected);
  if (device_count() == 0) GTEST_SKIP() << "no CUDA device on this machine";
  const MakeSimulation device = [](const Model& model) {
    return make_simulation(BackendKind::cuda, GetParam(), model);
  };
  EXPECT_TRUE(run_all(scenario, patient, device) == expected);
}

/// Plays a phase. @param start  displacement when it began
std::vector<std::vector<glm::vec3>> play(const Scenario& scenario, std::size_t phase, const Patient& patient,
                                         const Model& model, Simulation& simulation) {
  const Phase& of = scenario.phases[phase];
  const PhaseLoads loads(scenario, of, patient);
  const std::vector<glm::vec3> start = simulation.displacement_on_host();
  if (!loads.changes_by_frame()) simulation.set_loads(loads.at(1, model, start));
  std::vector<std::vector<glm::vec3>> frames;
  for (int frame = 0; frame < of.frames; ++frame) {
    const double part = (frame + 1.0) / of.frames;
    if (loads.changes_by_frame()) simulation.set_loads(loads.at(part, model, start, simulation.displacement_on_host()));
    simulation.advance(loads.changes_by_frame() ? 1 : part, scenario.stop);
    frames.push_back(simulation.displacement_on_host());
  }
  return frames;
}

/// A run sets no loads anew where the hand stays where it is.
TEST_P(ByHand, AHandThatStaysGivesTheBitsOfLoadsThatAreSetInEachFrame) {
  SCOPED_TRACE(seed_text(test_seed()));
  Random random(test_seed(), 44);
  const Patient patient = uniform_patient();
  Scenario scenario = by_hand(GetParam(), random);
  for (Phase& phase : scenario.phases) {
    for (Move& move : phase.moves) {
      auto& along = std::get<Drag>(move.how).by_mm;
      along.insert(along.end(), 5, along.back());
      phase.frames += 5;
    }
  }
  const Model model =
      make_model(patient.lattice, tissue_of_cells(scenario, patient), std::vector<Tissue>{scenario.tissues[0].tissue});
  const auto check = [&](const MakeSimulation& make) {
    const std::unique_ptr<Simulation> simulation = make(model);
    Frames expected;
    for (std::size_t phase = 0; phase < scenario.phases.size(); ++phase) {
      const Frames frames = play(scenario, phase, patient, model, *simulation);
      expected.insert(expected.end(), frames.begin(), frames.end());
    }
    EXPECT_TRUE(run_all(scenario, patient, make) == expected);
  };
  check(cpu(GetParam(), 2));
  if (device_count() == 0) GTEST_SKIP() << "no CUDA device on this machine";
  check([](const Model& of) { return make_simulation(BackendKind::cuda, GetParam(), of); });
}

/// So what was done can be taken back to the beginning of any phase, and gone on from there.
TEST_P(ByHand, AStateGoesOnToTheSameBitsInAnotherSimulationAndOnAnotherBackend) {
  SCOPED_TRACE(seed_text(test_seed()));
  Random random(test_seed(), 43);
  const Patient patient = uniform_patient();
  const Scenario scenario = by_hand(GetParam(), random);
  const Model model =
      make_model(patient.lattice, tissue_of_cells(scenario, patient), std::vector<Tissue>{scenario.tissues[0].tissue});
  const auto one = cpu(GetParam(), 1)(model), other = cpu(GetParam(), 1)(model);
  std::unique_ptr<Simulation> on_device;
  if (device_count() > 0) on_device = make_simulation(BackendKind::cuda, GetParam(), model);
  EXPECT_THROW(other->set_state(std::vector<std::byte>(7)), InputError);
  for (std::size_t phase = 0; phase < scenario.phases.size(); ++phase) {
    SCOPED_TRACE(phase);
    const std::vector<std::byte> state = one->state();
    const auto expected = play(scenario, phase, patient, model, *one);
    other->set_state(state);
    EXPECT_TRUE(other->state() == state);
    EXPECT_TRUE(play(scenario, phase, patient, model, *other) == expected);
    EXPECT_TRUE(other->state() == one->state());
    if (!on_device) continue;
    on_device->set_state(state);
    EXPECT_TRUE(on_device->state() == state);
    EXPECT_TRUE(play(scenario, phase, patient, model, *on_device) == expected);
    EXPECT_TRUE(on_device->state() == one->state());
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, ByHand, testing::Values(Method::chainmail, Method::mass_spring),
                         [](const auto& of) { return of.param == Method::chainmail ? "ChainMail" : "MassSpring"; });

}  // namespace
}  // namespace tetwarp::simulate
