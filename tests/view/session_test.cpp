// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "view/session/session.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "backend/devices.h"
#include "backend/factories.h"
#include "deform/errors.h"
#include "deform/simulate/chainmail.h"
#include "deform/simulate/mass_spring.h"
#include "deform/simulate/scenario_run.h"
#include "io/scenario_file.h"
#include "tests/deform/simulate/scenario_volumes.h"
#include "tests/support/random.h"
#include "tests/support/run.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"

namespace tetwarp::viewer {
namespace {

using namespace simulate;
using namespace simulate::test;
using tetwarp::test::Random;
using tetwarp::test::seed_text;
using tetwarp::test::test_seed;

MakeSimulation cpu(Method method, int threads = 1) {
  return [=](const Model& model) {
    const Limits limits{.threads = threads, .memory = 0};
    return method == Method::chainmail ? make_cpu_chainmail(model, limits) : make_cpu_mass_spring(model, limits);
  };
}

Scenario base(Method method) {
  Scenario scenario = scenario_of({{Zone{HalfSpace{{{0, 0, 1}}, {0, 0, -1}}}, "hold[0]"}}, {});
  scenario.method = method;
  scenario.stop = {.motion_mm = 1e-4, .residual = 1e-4, .steps = 2};
  return scenario;
}

/// What the file of a recording is read as.
Scenario reread(const Scenario& recorded) {
  const Scratch scratch;
  write_file(scratch / "hand.json", scenario_text(recorded));
  return read_scenario(scratch / "hand.json");
}

std::vector<glm::vec3> replayed(const Scenario& scenario, const Patient& patient, const MakeSimulation& make) {
  ScenarioRun run(scenario, patient, make);
  while (!run.is_done()) run.next();
  return run.displacement();
}

std::string text_of(const Session& session) {
  return session.recorded().phases.empty() ? "" : scenario_text(session.recorded());
}

glm::dvec3 somewhere(Random& random) { return {random.real(-18, 18), random.real(-18, 18), random.real(6, 38)}; }

/// Something that a hand may do. What is refused changes nothing.
void act_at_random(Session& session, Random& random, int number) {
  try {
    switch (random.integer(0, 10)) {
      case 0: session.grip(somewhere(random), random.real(4, 9)); break;
      case 1: session.move({random.real(-4, 4), random.real(-4, 4), random.real(-4, 4)}); break;
      case 2: session.release(); break;
      case 3: session.pin({Sphere{{somewhere(random)}, {random.real(3, 8)}}}); break;
      case 4: session.unpin(); break;
      case 5:
        if (session.recorded().cuts.size() < 3)
          session.cut({"cut " + std::to_string(number),
                       DiscCutPlan{{somewhere(random)}, {random.real(-1, 1), 0.2, 0.7}, {10}}});
        break;
      case 6:
        if (!session.recorded().cuts.empty()) session.suture(session.recorded().cuts.back().name);
        break;
      case 7:
        if (!session.recorded().cuts.empty()) session.reopen(session.recorded().cuts.front().name);
        break;
      case 8: session.ball({random.real(-18, 18), random.real(-18, 18), random.real(42, 46)}, 6); break;
      case 9: session.lift_ball(); break;
      default: session.undo(); break;
    }
  } catch (const InputError&) {
  }
}

class Sessions : public testing::TestWithParam<Method> {};

TEST_P(Sessions, TwoHundredActionsAreRepeatedToTheSameBitsAnywhere) {
  SCOPED_TRACE(seed_text(test_seed()));
  const Patient patient = uniform_patient();
  for (std::uint64_t seed = 0; seed < 3; ++seed) {
    Random random(test_seed(), 50 + seed);
    Session session(base(GetParam()), patient, cpu(GetParam()), seed == 1 ? 200000 : Session::kMostSnapshotBytes);
    for (int n = 0; n < 200; ++n) {
      act_at_random(session, random, n);
      for (int steps = static_cast<int>(random.integer(0, 2)); steps > 0; --steps) session.step();
    }
    session.step();
    const Scenario recorded = reread(session.recorded());
    EXPECT_EQ(scenario_text(recorded), scenario_text(session.recorded()));  // to the last bit of every number
    EXPECT_EQ(frame_count(recorded), session.frames());
    const std::vector<glm::vec3> expected = session.player().displacement();
    EXPECT_GT(session.frames(), 50);
    EXPECT_TRUE(std::any_of(expected.begin(), expected.end(), [](const glm::vec3& u) { return u != glm::vec3(0); }));
    EXPECT_TRUE(replayed(recorded, patient, cpu(GetParam(), 2)) == expected);
    if (device_count() == 0) continue;
    const auto device = [](const Model& model) { return make_simulation(BackendKind::cuda, GetParam(), model); };
    EXPECT_TRUE(replayed(recorded, patient, device) == expected);
  }
}

TEST_P(Sessions, AScenarioIsPlayedAmongWhatTheHandDoes) {
  const Patient patient = uniform_patient();
  const Scenario scenario = base(GetParam());
  Phase lift;
  lift.moves = {move_of(Zone{Sphere{{{0, 0, 36}}, {9}}}, Shift{{0, 0, 3}}, "move[0]")};
  lift.frames = 4;
  Phase turn;
  turn.moves = {move_of(Zone{Sphere{{{8, 8, 36}}, {9}}}, Rotation{{{8, 8, 36}}, {0, 0, 1}, 20}, "move[0]")};
  turn.frames = 3;
  Session session(scenario, patient, cpu(GetParam()));
  session.grip({-8, 0, 32}, 6);
  session.move({1, 0, 0});
  session.step();
  const std::vector<glm::vec3> before = session.player().displacement();
  const std::string text_before = text_of(session);
  session.play({lift, turn});
  EXPECT_TRUE(session.plays());
  EXPECT_FALSE(session.holds());
  session.step();
  EXPECT_THROW(session.grip({-8, 0, 32}, 6), InputError);
  EXPECT_THROW(session.move({2, 0, 0}), InputError);
  EXPECT_EQ(text_of(session), text_before);  // a phase is recorded as a whole
  ASSERT_TRUE(session.undo());
  EXPECT_FALSE(session.plays());
  EXPECT_TRUE(session.player().displacement() == before);
  session.play({lift, turn});
  for (int n = 0; n < 7; ++n) {
    EXPECT_TRUE(session.plays()) << n;
    session.step();
  }
  EXPECT_FALSE(session.plays());
  session.step();  // tissue comes to rest
  const Scenario recorded = reread(session.recorded());
  EXPECT_EQ(frame_count(recorded), 1 + 7 + 1);
  EXPECT_TRUE(replayed(recorded, patient, cpu(GetParam(), 2)) == session.player().displacement());
  Phase impossible = lift;
  impossible.moves[0].what = Zone{Sphere{{{900, 0, 0}}, {1}}};
  EXPECT_THROW(session.play({lift, impossible}), InputError);
  EXPECT_FALSE(session.plays());
}

TEST_P(Sessions, AScenarioIsPlayedBeforeAnythingWasDone) {
  const Patient patient = uniform_patient();
  Phase lift;
  lift.moves = {move_of(Zone{Sphere{{{0, 0, 36}}, {9}}}, Shift{{0, 0, 3}}, "move[0]")};
  lift.frames = 4;
  Session session(base(GetParam()), patient, cpu(GetParam()));
  session.play({lift});
  for (int n = 0; n < 4; ++n) session.step();
  EXPECT_FALSE(session.plays());
  EXPECT_TRUE(replayed(reread(session.recorded()), patient, cpu(GetParam())) == session.player().displacement());
}

TEST_P(Sessions, UndoAndRedoGoThroughAllStatesWhateverWasLetGoOf) {
  SCOPED_TRACE(seed_text(test_seed()));
  const Patient patient = uniform_patient();
  for (const std::size_t most : {Session::kMostSnapshotBytes, std::size_t{150000}}) {
    Session session(base(GetParam()), patient, cpu(GetParam()), most);
    std::vector<std::vector<glm::vec3>> states;
    std::vector<std::string> texts;
    const auto note = [&] {
      states.push_back(session.player().displacement());
      texts.push_back(text_of(session));
    };
    const auto steps = [&](int count) {
      for (int n = 0; n < count; ++n) session.step();
    };
    note();
    session.grip({4, 4, 32}, 9);
    for (int n = 1; n <= 3; ++n) {
      session.move({0.5 * n, 0, 0.25 * n});
      steps(1);
    }
    note();
    session.cut({"slit", DiscCutPlan{{{0, 0, 19}}, {0, 0, 1}, {13}}});
    steps(3);
    note();
    session.pin({Sphere{{{-12, -12, 24}}, {9}}});
    steps(1);
    note();
    session.release();
    steps(2);
    note();
    session.ball({-8, 0, 46}, 8);
    steps(1);
    session.ball({-8, 0, 44}, 8);
    steps(1);
    note();
    session.suture("slit");
    steps(2);
    note();
    const auto expect = [&](std::size_t n) {
      EXPECT_TRUE(session.player().displacement() == states[n]) << n;
      EXPECT_EQ(text_of(session), texts[n]) << n;
    };
    const std::size_t last = states.size() - 1;
    EXPECT_FALSE(session.redo());
    for (int round = 0; round < 2; ++round) {
      for (std::size_t n = last; n-- > 0;) {
        ASSERT_TRUE(session.undo());
        expect(n);
      }
      EXPECT_FALSE(session.undo());
      for (std::size_t n = 1; n <= last; ++n) {
        ASSERT_TRUE(session.redo());
        expect(n);
      }
      EXPECT_FALSE(session.redo());
    }
    EXPECT_LE(session.snapshot_bytes(), most);
    session.undo();
    session.unpin();  // what is done now takes the place of what was taken back
    EXPECT_FALSE(session.redo());
  }
}

TEST_P(Sessions, TheHandHoldsOnWhileOtherThingsAreDone) {
  const Patient patient = uniform_patient();
  Session session(base(GetParam()), patient, cpu(GetParam()));
  constexpr std::size_t kGripped = 4 * 121 + 6 * 11 + 6;  // the vertex at (4, 4, 32)
  const auto expect_at = [&](double x) { EXPECT_NEAR(double{session.player().displacement()[kGripped].x}, x, 1e-4); };
  session.grip({4, 4, 32}, 3);
  for (const double x : {1.0, 1.5, 2.0}) {
    session.move({x, 0, 0});
    session.step();
    expect_at(x);
  }
  session.pin({Sphere{{{-12, -12, 24}}, {9}}});
  for (const double x : {2.0, 2.5, 3.0, 2.75}) {
    session.move({x, 0, 0});
    session.step();
    expect_at(x);
  }
  session.grip({4, 4, 32}, 3);  // again, where it is now
  session.step();
  expect_at(2.75);
  session.move({-1, 0, 0});
  session.step();
  expect_at(1.75);
  EXPECT_EQ(session.recorded().phases.size(), 3u);
}

TEST_P(Sessions, ARecordingOfOnePhaseHasAllOfIt) {
  const Patient patient = uniform_patient();
  const auto expect_replay = [&](auto&& act) {
    Session session(base(GetParam()), patient, cpu(GetParam()));
    act(session);
    session.step();
    EXPECT_EQ(session.recorded().phases.size(), 1u);
    EXPECT_TRUE(replayed(reread(session.recorded()), patient, cpu(GetParam())) == session.player().displacement());
    return scenario_text(session.recorded());
  };
  const auto grip = [](Session& session) {
    session.grip({4, 4, 32}, 9);
    session.move({3, 0, 0});
  };
  const Zone half{HalfSpace{{{-8, 0, 0}}, {-0.3, 0.1, 0.7}}};
  expect_replay(grip);
  EXPECT_TRUE(says(expect_replay([&](Session& session) {
                     session.pin({AllOf{{half, Zone{Sphere{{{-12, -12, 24}}, {9}}}}}});
                     grip(session);
                   }),
                   {"\"pin\""}));
  EXPECT_TRUE(says(expect_replay([&](Session& session) { session.ball({0, 0, 46}, 8); }), {"\"push\""}));
  expect_replay([&](Session& session) { session.pin({Sphere{{{-12, -12, 24}}, {9}}}); });
  EXPECT_TRUE(says(expect_replay([&](Session& session) {
                     session.cut({"slit", DiscCutPlan{{{0, 0, 19}}, {0.3, 0.2, 0.9}, {13}}});
                     session.suture("slit");
                     grip(session);
                   }),
                   {"closed_cuts"}));
}

TEST_P(Sessions, WhatIsRefusedChangesNothing) {
  const Patient patient = uniform_patient();
  Session session(base(GetParam()), patient, cpu(GetParam()));
  session.grip({4, 4, 32}, 9);
  session.move({1, 0, 0});
  session.step();
  const std::string before = scenario_text(session.recorded());
  EXPECT_TRUE(says(refusal([&] { session.grip({400, 0, 0}, 5); }), {"380", "nearest vertex"}));
  EXPECT_TRUE(says(refusal([&] { session.grip({4, 4, 0}, 3); }), {"held"}));
  EXPECT_TRUE(says(refusal([&] { session.suture("slit"); }), {"\"slit\""}));
  EXPECT_TRUE(says(refusal([&] { session.grip({4, 4, 32}, 0); }), {"radius"}));
  EXPECT_TRUE(says(refusal([&] { session.ball({4, NAN, 32}, 5); }), {"ball"}));
  EXPECT_TRUE(says(refusal([&] { session.move({1e9, 0, 0}); }), {"hand"}));
  EXPECT_TRUE(says(refusal([&] { session.pin({HalfSpace{{{0, 0, 20}}, {0, 0, 0}}}); }), {"direction"}));
  EXPECT_TRUE(says(refusal([&] { session.cut({"", PlaneCutPlan{{{0, 0, 20}}, {0, 0, 1}}}); }), {"name"}));
  const CutPlan slit{"slit", DiscCutPlan{{{0, 0, 19}}, {0, 0, 1}, {13}}};
  session.cut(slit);
  EXPECT_TRUE(says(refusal([&] { session.cut(slit); }), {"another cut"}));
  EXPECT_TRUE(session.undo());
  EXPECT_EQ(scenario_text(session.recorded()), before);
  session.move({2, 0, 0});
  session.step();  // the hand holds what it held
  EXPECT_EQ(session.frames(), 2);
  session.release();
  EXPECT_TRUE(says(refusal([&] { session.move({1, 0, 0}); }), {"holds nothing"}));
}

TEST_P(Sessions, AStopLeavesAllAsItWas) {
  const Patient patient = uniform_patient();
  Session session(base(GetParam()), patient, cpu(GetParam())), other(base(GetParam()), patient, cpu(GetParam()));
  std::stop_source source;
  source.request_stop();
  for (Session* one : {&session, &other}) {
    one->grip({4, 4, 32}, 9);
    one->move({1, 0, 0});
    one->step();
  }
  session.move({2, 0, 0});
  EXPECT_THROW(session.step({.stop = source.get_token()}), Cancelled);
  EXPECT_TRUE(session.player().displacement() == other.player().displacement());
  EXPECT_EQ(scenario_text(session.recorded()), scenario_text(other.recorded()));
  session.step();
  EXPECT_TRUE(replayed(reread(session.recorded()), patient, cpu(GetParam())) == session.player().displacement());
}

INSTANTIATE_TEST_SUITE_P(Methods, Sessions, testing::Values(Method::chainmail, Method::mass_spring),
                         [](const auto& of) { return of.param == Method::chainmail ? "ChainMail" : "MassSpring"; });

}  // namespace
}  // namespace tetwarp::viewer
