// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/simulate/scenario.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include "deform/simulate/scenario_run.h"
#include "tests/deform/simulate/scenario_volumes.h"
#include "tests/support/says.h"

namespace tetwarp::simulate {
namespace {

using namespace test;

const Zone kTop{HalfSpace{{{0, 0, 40}}, {0, 0, 1}}}, kBottom{HalfSpace{{{0, 0, 0}}, {0, 0, -1}}};
constexpr std::size_t kLayer = 121, kVertices = 6 * kLayer;

TEST(Scenario, FirstTissueThatFitsIsTheCells) {
  Volume<std::int16_t> ct = ct_of({.size = {5, 2, 2}}, [](auto i, auto, auto) {
    return i == 0 ? -1000 : i < 3 ? 40 : 400;
  });
  const Volume<std::uint8_t> labels{ct.geometry, std::vector<std::uint8_t>{0, 0, 6, 6, 6, 0, 0, 6, 6, 6,  //
                                                                           0, 0, 6, 6, 6, 0, 0, 6, 6, 6}};
  const ConstVolumeView given = view(labels);
  const Patient patient = examine(view(ct), &given, 1, -400);  // cells -1000, 40, 40, 400 (the last two voxels)
  Scenario scenario;
  scenario.tissues = {tissue_of("bone", HuRange{200, 1e9}), tissue_of("liver", HuRange{0, 200}, {5, 6}),
                      tissue_of("rest")};
  EXPECT_EQ(tissue_of_cells(scenario, patient), (std::vector<std::uint8_t>{2, 2, 1, 0}));
  const Patient without = examine(view(ct), nullptr, 1, -400);
  EXPECT_TRUE(says(refusal([&] { tissue_of_cells(scenario, without); }), {"\"liver\"", "--labels"}));
}

TEST(Scenario, HeldAndMovedVerticesGoToTheirGoals) {
  const Patient patient = uniform_patient();
  const Scenario scenario = scenario_of({{kBottom, "hold[0]"}}, {move_of(kTop, Shift{{1, 2, 3}}, "move[0]")});
  const PhaseLoads loads(scenario, scenario.phases[0], patient);
  EXPECT_EQ(loads.counts().held, kLayer);
  EXPECT_EQ(loads.counts().moved, kLayer);
  EXPECT_EQ(loads.counts().with_force, 0u);
  EXPECT_FALSE(loads.changes_by_frame());
  const Model model = make_model(patient.lattice, tissue_of_cells(scenario, patient), std::vector<Tissue>{{}});
  std::vector<glm::vec3> start(model.nodes());
  start.back() = {8, 0, 0};
  const Loads half = loads.at(0.5, model, start);
  for (std::size_t n = 0; n < kVertices; ++n) {
    const bool is_free = n >= kLayer && n < kVertices - kLayer;
    EXPECT_EQ(half.constraint[n], is_free ? Constraint::free : Constraint::placed);
    if (!is_free && n + 1 < kVertices) {
      EXPECT_EQ(half.goal[n], n < kLayer ? glm::vec3(0) : glm::vec3(0.5f, 1, 1.5f)) << n;
    }
  }
  EXPECT_EQ(half.goal.back(), glm::vec3(4.5f, 1, 1.5f));  // half way from where it was
  EXPECT_EQ(loads.at(1, model, start).goal.back(), glm::vec3(1, 2, 3));
  EXPECT_TRUE(half.force.empty());
}

TEST(Scenario, CopiesOfVerticesAreFree) {
  const Patient patient = uniform_patient();
  const Scenario scenario = scenario_of({}, {move_of(kTop, Shift{{1, 2, 3}}, "move[0]")});
  Model model = make_model(patient.lattice, tissue_of_cells(scenario, patient), std::vector<Tissue>{{}});
  model.vertex.push_back(kVertices - 1);
  const Loads loads = PhaseLoads(scenario, scenario.phases[0], patient).at(1, model, std::vector<glm::vec3>(727));
  ASSERT_EQ(loads.constraint.size(), kVertices + 1);
  EXPECT_EQ(loads.constraint[kVertices - 1], Constraint::placed);
  EXPECT_EQ(loads.constraint[kVertices], Constraint::free);
}

TEST(Scenario, HoldWinsOverMoves) {
  const Patient patient = uniform_patient();
  const Zone left{HalfSpace{{{0, 0, 0}}, {1, 0, 0}}};
  Scenario scenario = scenario_of({{left, "hold[0]"}}, {move_of(kTop, Shift{{1, 2, 3}}, "move[0]")});
  const PhaseLoads loads(scenario, scenario.phases[0], patient);
  EXPECT_EQ(loads.counts().held, 6u * 11 * 6);
  EXPECT_EQ(loads.counts().moved, 5u * 11);
  scenario.hold = {{kTop, "hold[0]"}};
  EXPECT_TRUE(says(refusal([&] { PhaseLoads(scenario, scenario.phases[0], patient); }),
                   {"move[0]", "121 of its 121 vertices are held"}));
}

TEST(Scenario, MovesThatDisagreeAreRefusedByBothNames) {
  const Patient patient = uniform_patient();
  const Move push = move_of(kTop, Shift{{0, 0, 4}}, "move[0] \"push\""),
             pull = move_of(Handle{{{0, 0, 40}}, {5}}, Shift{{0.1, 0, 0}, Unit::body}, "move[1] \"pull\"");
  const Scenario scenario = scenario_of({}, {push, pull});
  EXPECT_TRUE(
      says(refusal([&] { PhaseLoads(scenario, scenario.phases[0], patient); }),
           {"move[0] \"push\"", "move[1] \"pull\"", "(0.0, -4.0, 40.0)", "(0.0, -4.0, 44.0)", "(4.0, -4.0, 40.0)"}));
  const Move same = move_of(Handle{{{0, 0, 40}}, {5}}, Shift{{0, 0, 0.1}, Unit::body}, "move[1]");
  const Scenario agreed = scenario_of({}, {push, same});  // a tenth of 40 mm
  EXPECT_EQ(PhaseLoads(agreed, agreed.phases[0], patient).counts().moved, kLayer);
}

TEST(Scenario, TurnsFollowTheirArc) {
  const Patient patient = uniform_patient();
  const Rotation turn{{{0, 0, 0}}, {0, 0, 2}, 90};
  const Scenario scenario = scenario_of({}, {move_of(kTop, turn, "move[0]")});
  const PhaseLoads loads(scenario, scenario.phases[0], patient);
  EXPECT_TRUE(loads.changes_by_frame());
  const Model model = make_model(patient.lattice, tissue_of_cells(scenario, patient), std::vector<Tissue>{{}});
  const std::vector<glm::vec3> start(model.nodes());
  const glm::vec3 corner = loads.at(1, model, start).goal[kVertices - 1];  // (20, 20) to (-20, 20)
  EXPECT_LT(glm::distance(corner, glm::vec3(-40, 0, 0)), 1e-4f);
  const glm::vec3 on_the_way = loads.at(0.5, model, start).goal[kVertices - 1];
  const auto far = static_cast<float>(std::sqrt(800.0));
  EXPECT_LT(glm::distance(on_the_way, glm::vec3(-20, far - 20, 0)), 1e-4f);
}

TEST(Scenario, ADragBeginsWhereTheTissueIsAndPinsStayThere) {
  const Patient patient = uniform_patient();
  Scenario scenario = scenario_of({{kBottom, "hold[0]"}}, {move_of(kTop, Drag{{{1, 0, 0}, {1, 2, 0}}}, "move[0]")});
  Phase& phase = scenario.phases[0];
  phase.frames = 2;
  phase.pins = {{Zone{HalfSpace{{{0, 0, 32}}, {0, 0, 1}}}, "pin[0]"}};  // the layer below the top, and the top
  EXPECT_TRUE(says(refusal([&] { PhaseLoads(scenario, phase, patient); }), {"move[0]", "pinned"}));
  phase.pins = {{Zone{AllOf{{Zone{HalfSpace{{{0, 0, 32}}, {0, 0, 1}}}, Zone{Not{{kTop}}}}}}, "pin[0]"}};
  const PhaseLoads loads(scenario, phase, patient);
  EXPECT_TRUE(loads.changes_by_frame());
  EXPECT_FALSE(loads.pushes());
  EXPECT_EQ(loads.counts().held, kLayer);
  EXPECT_EQ(loads.counts().pinned, kLayer);
  EXPECT_EQ(loads.counts().moved, kLayer);
  const Model model = make_model(patient.lattice, tissue_of_cells(scenario, patient), std::vector<Tissue>{{}});
  const std::vector<glm::vec3> start(model.nodes(), glm::vec3(8, 4, 2));
  for (int frame = 0; frame < 2; ++frame) {
    const Loads at = loads.at(0.5 * (frame + 1), model, start);
    EXPECT_EQ(at.goal.front(), glm::vec3(0));  // held at rest
    EXPECT_EQ(at.constraint[kVertices - 2 * kLayer], Constraint::placed);
    EXPECT_EQ(at.goal[kVertices - 2 * kLayer], start[0]);
    EXPECT_EQ(at.goal.back(), frame == 0 ? glm::vec3(9, 4, 2) : glm::vec3(9, 6, 2));
    EXPECT_EQ(at.constraint[kLayer], Constraint::free);
  }
}

TEST(Scenario, DragsThatDisagreeInAnyFrameOrLackAFrameAreRefused) {
  const Patient patient = uniform_patient();
  const Drag way{{{1, 0, 0}, {1, 2, 0}}}, other{{{1, 1, 0}, {1, 2, 0}}};
  const auto with = [&](std::vector<Move> moves, int frames) {
    Scenario scenario = scenario_of({}, std::move(moves));
    scenario.phases[0].frames = frames;
    return refusal([&] { PhaseLoads(scenario, scenario.phases[0], patient); });
  };
  EXPECT_EQ(with({move_of(kTop, way, "a"), move_of(kTop, way, "b")}, 2), "");
  EXPECT_TRUE(says(with({move_of(kTop, way, "a"), move_of(kTop, other, "b")}, 2), {"a and b"}));
  EXPECT_TRUE(says(with({move_of(kTop, way, "a"), move_of(kTop, Shift{{1, 2, 0}}, "b")}, 2), {"a and b"}));
  EXPECT_TRUE(says(with({move_of(kTop, way, "a")}, 3), {"a has 2 places", "3 frames"}));
}

TEST(Scenario, ABallPlacesWhatItMeetsOnItsSurface) {
  const Patient patient = uniform_patient();
  Scenario scenario = scenario_of({{kBottom, "hold[0]"}}, {});
  Phase& phase = scenario.phases[0];
  phase.frames = 2;
  const glm::dvec3 near(0, 0, 47), far(0, 0, 60);
  phase.push = Push{10, {far, near}};
  const PhaseLoads loads(scenario, phase, patient);
  EXPECT_TRUE(loads.changes_by_frame());
  ASSERT_TRUE(loads.pushes());
  const Model model = make_model(patient.lattice, tissue_of_cells(scenario, patient), std::vector<Tissue>{{}});
  const std::vector<glm::vec3> now(model.nodes());
  const auto placed = [](const Loads& of) {
    return std::count(of.constraint.begin(), of.constraint.end(), Constraint::placed);
  };
  EXPECT_EQ(placed(loads.at(0.5, model, now, now)), static_cast<std::ptrdiff_t>(kLayer));  // those that are held
  const Loads met = loads.at(1, model, now, now);
  std::size_t met_count = 0;
  for (std::size_t n = kLayer; n < kVertices; ++n) {
    const auto vertex = static_cast<std::int64_t>(n);
    const glm::dvec3 rest(-20.0 + 4.0 * static_cast<double>(vertex % 11),
                          -20.0 + 4.0 * static_cast<double>(vertex / 11 % 11), 8.0 * static_cast<double>(vertex / 121));
    const double away = glm::distance(rest, near);
    ASSERT_EQ(met.constraint[n], away < 10.1 ? Constraint::placed : Constraint::free) << n;
    if (away >= 10.1) continue;
    ++met_count;
    const glm::dvec3 goal = rest + glm::dvec3(met.goal[n]);
    EXPECT_NEAR(glm::distance(goal, near), std::max(away, 10.0), 1e-5);
    EXPECT_LT(glm::length(glm::cross(goal - near, rest - near)), 1e-4);  // along the line from the centre
  }
  EXPECT_GT(met_count, 4u);
  // Where a node is counts, not where it rests.
  std::vector<glm::vec3> gone = now;
  for (std::size_t n = kVertices - kLayer; n < kVertices; ++n) gone[n].z = -20;
  EXPECT_EQ(placed(loads.at(1, model, now, gone)), static_cast<std::ptrdiff_t>(kLayer));
  phase.push->at_mm.pop_back();
  EXPECT_TRUE(says(refusal([&] { PhaseLoads(scenario, phase, patient); }), {"ball", "1 places", "2 frames"}));
  phase.push = Push{10, {far, near}};
  const Patient air = uniform_patient(-1000);
  EXPECT_TRUE(says(refusal([&] { PhaseLoads(scenario, phase, air); }), {"ball", "body"}));
}

TEST(Scenario, ForceIsSharedByWhatIsPulled) {
  const Patient patient = uniform_patient();
  const Move pull = move_of(kTop, Force{{0, 0, 121}}, "move[0]");
  Scenario scenario = scenario_of({{kBottom, "hold[0]"}}, {pull, pull});
  scenario.method = Method::mass_spring;
  const PhaseLoads loads(scenario, scenario.phases[0], patient);
  EXPECT_EQ(loads.counts().with_force, kLayer);
  EXPECT_EQ(loads.counts().moved, 0u);
  const Model model = make_model(patient.lattice, tissue_of_cells(scenario, patient), std::vector<Tissue>{{}});
  const Loads whole = loads.at(1, model, std::vector<glm::vec3>(model.nodes()));
  ASSERT_EQ(whole.force.size(), kVertices);
  EXPECT_EQ(whole.force[kVertices - 1], glm::vec3(0, 0, 2));
  EXPECT_EQ(whole.force[0], glm::vec3(0));
  EXPECT_EQ(whole.constraint[kVertices - 1], Constraint::free);

  scenario.phases[0].moves.push_back(move_of(kTop, Shift{{0, 0, 4}}, "move[2]"));
  EXPECT_TRUE(says(refusal([&] { PhaseLoads(scenario, scenario.phases[0], patient); }), {"move[0]", "move[2]"}));
  scenario.phases[0].moves = {pull};
  scenario.hold.clear();
  EXPECT_TRUE(says(refusal([&] { PhaseLoads(scenario, scenario.phases[0], patient); }), {"nothing is held"}));
  scenario.method = Method::chainmail;
  EXPECT_TRUE(says(refusal([&] { PhaseLoads(scenario, scenario.phases[0], patient); }), {"force", "chainmail"}));
}

TEST(Scenario, EmptyRegionsAreToldOfHoldsAndRefusedOfMoves) {
  const Patient patient = uniform_patient();
  const Zone bone{HuRange{200, 3000}};
  const Scenario held = scenario_of({{bone, "hold[0]"}}, {move_of(kTop, Shift{{1, 0, 0}}, "move[0]")});
  EXPECT_EQ(PhaseLoads(held, held.phases[0], patient).notes(), std::vector<std::string>{"hold[0] holds no vertex"});
  const Scenario moved = scenario_of({}, {move_of(bone, Shift{{1, 0, 0}}, "move[0]")});
  EXPECT_TRUE(says(refusal([&] { PhaseLoads(moved, moved.phases[0], patient); }), {"move[0]", "empty"}));
  const Scenario away = scenario_of({}, {move_of(Handle{{{500, 0, 0}}, {3}}, Shift{{1, 0, 0}}, "move[0]")});
  EXPECT_TRUE(says(refusal([&] { PhaseLoads(away, away.phases[0], patient); }), {"move[0]", "480"}));
}

TEST(Scenario, CutsArePlacedByTheBodyAndThoseClosedLeftOut) {
  const Patient patient = uniform_patient();
  Scenario scenario = scenario_of({}, {move_of(kTop, Shift{{1, 0, 0}}, "move[0]")});
  scenario.cuts = {{"a", PlaneCutPlan{{{0.5, 0.5, 0.5}, Unit::body}, {0, 0, 1}}},
                   {"b", DiscCutPlan{{{1, 2, 3}}, {0, 1, 0}, {0.25, Unit::body}}},
                   {"c", SweptCutPlan{{{{0, 0, 0}}, {{1, 1, 1}, Unit::body}}, {0, 4, 0}, {10}}}};
  std::vector<Cut> cuts = open_cuts(scenario, scenario.phases[0], patient);
  ASSERT_EQ(cuts.size(), 3u);
  EXPECT_EQ(std::get<PlaneCut>(cuts[0].shape).point, glm::dvec3(0, 0, 20));
  EXPECT_EQ(std::get<DiscCut>(cuts[1].shape).radius_mm, 10);
  const auto& swept = std::get<SweptCut>(cuts[2].shape);
  EXPECT_EQ(swept.path, (std::vector<glm::dvec3>{{0, 0, 0}, {20, 20, 40}}));
  EXPECT_EQ(swept.sweep, glm::dvec3(0, 10, 0));
  EXPECT_FALSE(swept.is_closed);
  scenario.phases[0].closed_cuts = {"b", "a"};
  cuts = open_cuts(scenario, scenario.phases[0], patient);
  ASSERT_EQ(cuts.size(), 1u);
  EXPECT_EQ(cuts[0].name, "c");
}

/// A simulation that moves placed nodes to their goals, leaves all others, and remembers its loads.
class Puppet final : public Simulation {
 public:
  struct Log {
    int made = 0, loads = 0;
    std::vector<double> parts;
  };

  Puppet(const Model& model, Log& log) : log_(log), now_(model.nodes()), from_(now_) { ++log.made; }
  void set_loads(const Loads& loads) override {
    loads_ = loads;
    from_ = now_;
    ++log_.loads;
  }
  Convergence advance(double part, const StoppingRule&, const Control&) override {
    log_.parts.push_back(part);
    for (std::size_t n = 0; n < now_.size(); ++n) {
      if (loads_.constraint[n] == Constraint::placed)
        now_[n] = from_[n] + static_cast<float>(part) * (loads_.goal[n] - from_[n]);
    }
    return {.steps = 3, .motion_mm = 0.5, .reached = true};
  }
  std::span<const glm::vec3> displacement() const override { return now_; }
  void set_displacement(std::span<const glm::vec3> displacement) override {
    now_.assign(displacement.begin(), displacement.end());
  }

 private:
  Log& log_;
  Loads loads_;
  std::vector<glm::vec3> now_, from_;
};

TEST(ScenarioRun, PhasesGoOnFromWhereTheOneBeforeLed) {
  const Patient patient = uniform_patient();
  Scenario scenario = scenario_of({{kBottom, "hold[0]"}}, {move_of(kTop, Shift{{8, 0, 0}}, "move[0]")});
  scenario.phases[0].frames = 2;
  scenario.phases.push_back({.name = "back", .moves = {move_of(kTop, Shift{{0, 4, 0}}, "move[0]")}, .closed_cuts = {}});
  scenario.phases.back().frames = 4;
  Puppet::Log log;
  ScenarioRun run(scenario, patient, {[&](const Model& model) { return std::make_unique<Puppet>(model, log); }});
  EXPECT_EQ(run.frames(), 6);
  EXPECT_EQ(run.displacement(), std::vector<glm::vec3>(kVertices));
  const std::vector<glm::vec3> expected = {{4, 0, 0}, {8, 0, 0}, {6, 1, 0}, {4, 2, 0}, {2, 3, 0}, {0, 4, 0}};
  for (int n = 0; n < 6; ++n) {
    const FrameResult frame = run.next();
    EXPECT_EQ(frame.number, n + 1);
    EXPECT_EQ(frame.phase, n < 2 ? 0u : 1u);
    EXPECT_EQ(frame.ends_phase, n == 1 || n == 5);
    EXPECT_EQ(run.displacement().back(), expected[static_cast<std::size_t>(n)]);
    EXPECT_EQ(run.displacement().front(), glm::vec3(0));
  }
  EXPECT_TRUE(run.is_done());
  EXPECT_EQ(log.made, 1);
  EXPECT_EQ(log.loads, 2);
  EXPECT_EQ(log.parts, (std::vector<double>{0.5, 1, 0.25, 0.5, 0.75, 1}));
}

TEST(ScenarioRun, TurnsAreGivenFrameByFrame) {
  const Patient patient = uniform_patient();
  Scenario scenario = scenario_of({}, {move_of(kTop, Rotation{{{0, 0, 0}}, {0, 0, 1}, 90}, "move[0]")});
  scenario.phases[0].frames = 2;
  Puppet::Log log;
  ScenarioRun run(scenario, patient, {[&](const Model& model) { return std::make_unique<Puppet>(model, log); }});
  run.next();
  const auto far = static_cast<float>(std::sqrt(800.0));
  EXPECT_LT(glm::distance(run.displacement().back(), glm::vec3(-20, far - 20, 0)), 1e-4f);
  run.next();
  EXPECT_LT(glm::distance(run.displacement().back(), glm::vec3(-40, 0, 0)), 1e-4f);
  EXPECT_EQ(log.loads, 2);
  EXPECT_EQ(log.parts, (std::vector<double>{1, 1}));
}

TEST(ScenarioRun, DragsPinsAndBallsGoOnFromWhereTissueIs) {
  const Patient patient = uniform_patient();
  Scenario scenario = scenario_of({}, {move_of(kTop, Shift{{8, 0, 0}}, "move[0]")});
  scenario.phases.push_back({.name = "drag",
                             .moves = {move_of(kTop, Drag{{{0, 1, 0}, {0, 3, 0}}}, "phases[1].move[0]")},
                             .closed_cuts = {},
                             .frames = 2});
  scenario.phases.push_back({.name = "pin", .moves = {}, .pins = {{kTop, "phases[2].pin[0]"}}, .closed_cuts = {}});
  const glm::dvec3 last_rest(20, 20, 40), last_now = last_rest + glm::dvec3(8, 3, 0);
  scenario.phases.push_back(
      {.name = "push", .moves = {}, .push = Push{2, {last_now + glm::dvec3(0, 0, 1)}}, .closed_cuts = {}});
  Puppet::Log log;
  ScenarioRun run(scenario, patient, {[&](const Model& model) { return std::make_unique<Puppet>(model, log); }});
  const std::vector<glm::vec3> expected = {{8, 0, 0}, {8, 1, 0}, {8, 3, 0}, {8, 3, 0}, {8, 3, -1}};
  for (const glm::vec3& there : expected) {
    run.next();
    EXPECT_EQ(run.displacement().back(), there);
  }
  EXPECT_EQ(run.displacement()[kVertices - 2], glm::vec3(8, 3, 0));  // 4 mm beside it: the ball does not reach it
  EXPECT_EQ(log.made, 1);
}

TEST(ScenarioRun, RefusesOnePhaseBeforeTheFirstIsSimulated) {
  const Patient patient = uniform_patient();
  Scenario scenario = scenario_of({}, {move_of(kTop, Shift{{8, 0, 0}}, "move[0]")});
  scenario.phases.push_back(
      {.name = "then", .moves = {move_of(Zone{HuRange{500, 600}}, Shift{}, "phases[1].move[0]")}, .closed_cuts = {}});
  EXPECT_TRUE(says(refusal([&] { ScenarioRun(scenario, patient, {}); }), {"phases[1].move[0]"}));
}

}  // namespace
}  // namespace tetwarp::simulate
