// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "backend/devices.h"
#include "backend/factories.h"
#include "deform/simulate/chainmail.h"
#include "deform/simulate/cuts/cut_surface.h"
#include "deform/simulate/mass_spring.h"
#include "deform/simulate/scenario_run.h"
#include "tests/deform/simulate/scenario_volumes.h"
#include "tests/support/springs.h"

namespace tetwarp::simulate {
namespace {

using namespace test;

/// 11 x 11 x 6 vertices; the lowest layer is held, the uppermost moved, a cut goes between the middle ones.
Scenario parted(const CutPlan& cut, const glm::dvec3& by) {
  const Zone bottom{HalfSpace{{{0, 0, 1}}, {0, 0, -1}}}, top{HalfSpace{{{0, 0, 39}}, {0, 0, 1}}};
  Scenario scenario = scenario_of({{bottom, "hold[0]"}}, {move_of(top, Shift{by}, "move[0]")});
  scenario.method = Method::mass_spring;
  scenario.cuts = {cut};
  scenario.phases[0].frames = 2;
  scenario.phases.push_back({.name = "closed", .moves = {}, .closed_cuts = {cut.name}});
  scenario.phases[1].frames = 1;
  scenario.stop = {.motion_mm = 1e-5, .residual = 1e-5, .steps = 500};
  return scenario;
}

MakeSimulation cpu() {
  return [](const Model& model) { return make_cpu_mass_spring(model); };
}

TEST(CutRun, BothSidesOfAPlaneGoTheirWaysAndComeBackWhenItIsClosed) {
  const Patient patient = uniform_patient();
  const glm::dvec3 by(3, -2, 9);
  const Scenario scenario = parted({"across", PlaneCutPlan{{{0, 0, 19}}, {0.05, 0.03, 1}}}, by);
  ScenarioRun run(scenario, patient, cpu());
  run.next();
  run.next();
  const VertexField open = run.field();
  EXPECT_GE(open.replaced.size(), 100u);
  for (std::size_t n = 0; n < open.displacement.size(); ++n) {
    const bool above = n >= 3 * 121;  // vertices of the fourth layer, at 24 mm, and further up
    EXPECT_LT(glm::distance(open.displacement[n], above ? glm::vec3(by) : glm::vec3(0)), 1e-3f) << n;
  }
  for (const glm::vec3& d : open.mesh.displacement)
    EXPECT_LT(std::min(glm::length(d), glm::distance(d, glm::vec3(by))), 1e-3f);
  run.next();
  const VertexField closed = run.field();
  EXPECT_TRUE(closed.replaced.empty());
  EXPECT_TRUE(closed.mesh.is_empty());
  for (const glm::vec3& d : closed.displacement) EXPECT_LT(glm::length(d), 1e-3f);
}

TEST(CutRun, FramesAreResampledThroughTheirFields) {
  const Patient patient = uniform_patient();
  const Scenario scenario = parted({"across", PlaneCutPlan{{{0, 0, 19}}, {0, 0, 1}}}, {0, 0, 8});
  const auto source = ct_of(small_grid(), [](auto i, auto j, auto k) { return 100 * k + 7 * i - j; });
  Volume<std::int16_t> by_loop = source, by_hand = source;
  const Target to_loop{.source = view(source), .output = view(by_loop), .background = -1000},
      to_hand{.source = view(source), .output = view(by_hand), .background = -1000};
  ScenarioRun loop(scenario, patient, cpu()), hand(scenario, patient, cpu());
  const auto resampler = make_cpu_resampler(small_grid()), other = make_cpu_resampler(small_grid());
  while (!loop.is_done()) {
    const FrameResult frame = loop.next();
    const Report of_loop = loop.resample(*resampler, {&to_loop, 1});
    hand.next();
    const VertexField field = hand.field();
    other->set_field(tetwarp::view(field, Outside::background));
    const Report report = other->resample(whole(small_grid()), {&to_hand, 1});
    EXPECT_EQ(by_loop.voxels, by_hand.voxels);
    EXPECT_EQ(of_loop.uncovered, report.uncovered);
    if (frame.number == 2) {
      EXPECT_EQ(by_loop.voxels[441 * 6], -1000) << "the gap is background";
    }
    EXPECT_EQ(of_loop.uncovered > 0, frame.phase == 0);
  }
  EXPECT_EQ(by_loop.voxels, source.voxels) << "closed again";
}

/// Where a cut ends within tissue, copies and vertices of the lattice are neighbours.
TEST(CutRun, SpringsRoundACutHaveTheBitsOfOneNodeAfterTheOther) {
  const Patient patient = uniform_patient();
  const Scenario scenario = parted({"slit", DiscCutPlan{{{0, 0, 19}}, {0.1, 0, 1}, {13}}}, {2, 1, 6});
  std::vector<std::vector<glm::vec3>> expected;
  for (const tetwarp::test::SpringMethod& method : tetwarp::test::methods()) {
    if (!method.cannot_run.empty()) continue;
    ScenarioRun run(scenario, patient, method.make);
    std::vector<std::vector<glm::vec3>> frames;
    while (!run.is_done()) {
      run.next();
      frames.push_back(run.displacement());
    }
    EXPECT_GT(frames[0].size(), 11u * 11 * 6) << "there are copies";
    if (expected.empty()) expected = frames;
    EXPECT_TRUE(frames == expected) << method.name;
  }
  EXPECT_EQ(expected.size(), 3u);
}

TEST(CutRun, FramesOnADeviceHaveTheCpusBits) {
  if (device_count() == 0) GTEST_SKIP() << "no CUDA device on this machine";
  const Patient patient = uniform_patient();
  Scenario scenario = parted({"slit", DiscCutPlan{{{0, 0, 19}}, {0, 0, 1}, {13}}}, {2, 1, 6});
  scenario.method = Method::chainmail;
  scenario.phases.push_back(scenario.phases[1]);  // closed, open, closed: with and without copies in the field
  scenario.phases[0].closed_cuts = scenario.phases[2].closed_cuts;
  scenario.phases[1] = parted(scenario.cuts[0], {2, 1, 6}).phases[0];
  const auto source = ct_of(small_grid(), [](auto i, auto j, auto k) { return 100 * k + 7 * i - j; });
  Volume<std::int16_t> on_cpu = source, on_device = source;
  const Target to_cpu{.source = view(source), .output = view(on_cpu), .background = -1000},
      to_device{.source = view(source), .output = view(on_device), .background = -1000};
  ScenarioRun cpu_run(scenario, patient, [](const Model& model) { return make_cpu_chainmail(model); });
  ScenarioRun device_run(scenario, patient, [](const Model& model) {
    return make_simulation(BackendKind::cuda, simulate::Method::chainmail, model);
  });
  const auto cpu_resampler = make_cpu_resampler(small_grid()),
             device_resampler = make_forward_resampler(BackendKind::cuda, small_grid());
  for (int frame = 0; !cpu_run.is_done(); ++frame) {
    cpu_run.next();
    device_run.next();
    EXPECT_EQ(cpu_run.displacement(), device_run.displacement()) << frame;
    cpu_run.resample(*cpu_resampler, {&to_cpu, 1});
    device_run.resample(*device_resampler, {&to_device, 1});
    EXPECT_EQ(on_cpu.voxels, on_device.voxels) << frame;
    EXPECT_EQ(on_cpu.voxels != source.voxels, frame < 4) << frame;  // at last let go
  }
}

/// Moves nodes as it is told: to the goals of placed nodes, others not at all. It remembers where it began.
class Puppet final : public Simulation {
 public:
  Puppet(const Model& model, std::vector<std::vector<glm::vec3>>& begun) : at_(model.nodes()), begun_(begun) {}
  void set_loads(const Loads& loads) override { loads_ = loads; }
  Convergence advance(double part, const StoppingRule&, const Control&) override {
    for (std::size_t n = 0; n < at_.size(); ++n) {
      if (loads_.constraint[n] == Constraint::placed) at_[n] = static_cast<float>(part) * loads_.goal[n];
    }
    return {.steps = 1, .reached = true};
  }
  std::span<const glm::vec3> displacement() const override { return at_; }
  void set_displacement(std::span<const glm::vec3> displacement) override {
    at_.assign(displacement.begin(), displacement.end());
    begun_.push_back(at_);
  }

 private:
  std::vector<glm::vec3> at_;
  Loads loads_;
  std::vector<std::vector<glm::vec3>>& begun_;
};

TEST(CutRun, ACutThatStaysOpenStaysAsWideAsItIsWhileAnotherIsMadeOrClosed) {
  const Patient patient = uniform_patient();
  Scenario scenario = parted({"across", PlaneCutPlan{{{0, 0, 19}}, {0.05, 0.03, 1}}}, {3, -2, 9});
  scenario.cuts.push_back({"along", PlaneCutPlan{{{1, 0, 0}}, {1, 0.02, 0.1}}});
  const Phase moved = scenario.phases[0];
  scenario.phases = {moved, moved, moved};
  scenario.phases[0].closed_cuts = scenario.phases[2].closed_cuts = {"along"};
  ScenarioRun run(scenario, patient, cpu());
  const auto vertices = static_cast<std::size_t>(voxel_count(patient.lattice));
  std::size_t copies = 0, wide = 0;
  run.next();
  run.next();
  std::vector<glm::vec3> before = run.displacement();
  for (int phase = 1; phase < 3; ++phase) {
    // At the beginning of a phase: the same scenario, played by a puppet that starts where the true run is.
    const std::vector<Cut> first = open_cuts(scenario, scenario.phases[phase - 1], patient),
                           second = open_cuts(scenario, scenario.phases[phase], patient);
    const DividedLattice earlier = divide(patient.lattice, first), now = divide(patient.lattice, second);
    const std::vector<std::uint32_t> from = nodes_before(now, earlier, patient.lattice);
    ASSERT_EQ(from.size(), now.copies_of.size());
    const CutSurface across(first[0].name == "across" ? first[0] : first[1]);
    const AffineMap point = point_from_index(patient.lattice);
    const glm::i64vec3 size = patient.lattice.size;
    for (std::size_t n = 0; n < from.size(); ++n) {
      // A copy belongs to tissue on the other side of one cut or both. Where only "across" parts it from its vertex,
      // it must begin with the other side, not with its vertex.
      const std::int64_t v = now.copies_of[n];
      const glm::dvec3 at = point(glm::dvec3(v % size.x, v / size.x % size.y, v / (size.x * size.y)));
      const bool above = across.side(at) > 0;
      const glm::vec3 begins = before[from[n]];
      ++copies;
      const bool with_other_side = glm::distance(begins, above ? glm::vec3(0) : glm::vec3(3, -2, 9)) < 1e-2f;
      wide += with_other_side;
      EXPECT_TRUE(with_other_side || glm::distance(begins, before[static_cast<std::size_t>(v)]) < 1e-2f);
      EXPECT_TRUE(with_other_side || phase == 1) << "only one cut is left: node " << n;
    }
    run.next();
    run.next();
    before = run.displacement();
    EXPECT_EQ(before.size(), vertices + now.copies_of.size());
  }
  EXPECT_GT(copies, 300u);
  EXPECT_GT(wide, copies / 2);
}

TEST(CutRun, APhaseBeginsWhereTheTissueWasOnBothSidesOfACutThatStaysOpen) {
  const Patient patient = uniform_patient();
  Scenario scenario = parted({"across", PlaneCutPlan{{{0, 0, 19}}, {0.05, 0.03, 1}}}, {3, -2, 9});
  scenario.method = Method::chainmail;
  scenario.cuts.push_back({"along", PlaneCutPlan{{{1, 0, 0}}, {1, 0.02, 0.1}}});
  const Phase moved = scenario.phases[0];
  scenario.phases = {moved, moved};
  scenario.phases[0].closed_cuts = {"along"};
  std::vector<std::vector<glm::vec3>> begun;
  ScenarioRun run(scenario, patient, [&](const Model& model) { return std::make_unique<Puppet>(model, begun); });
  run.next();
  run.next();
  const std::vector<glm::vec3> before = run.displacement();
  const DividedLattice earlier = divide(patient.lattice, open_cuts(scenario, scenario.phases[0], patient));
  run.next();
  ASSERT_EQ(begun.size(), 2u);
  const DividedLattice now = divide(patient.lattice, open_cuts(scenario, scenario.phases[1], patient));
  const std::vector<std::uint32_t> from = nodes_before(now, earlier, patient.lattice);
  const auto vertices = static_cast<std::size_t>(voxel_count(patient.lattice));
  for (std::size_t n = 0; n < begun[1].size(); ++n)
    EXPECT_EQ(begun[1][n], before[n < vertices ? n : from[n - vertices]]) << n;
}

TEST(CutRun, ADiscOpensWhereItIsAndTissueRoundItHolds) {
  const Patient patient = uniform_patient();
  const Scenario scenario = parted({"slit", DiscCutPlan{{{0, 0, 19}}, {0, 0, 1}, {13}}}, {0, 0, 6});
  ScenarioRun run(scenario, patient, cpu());
  run.next();
  run.next();
  const VertexField open = run.field();
  double widest = 0;
  std::size_t lips = 0;
  for (std::size_t a = 0; a < open.mesh.rest.size(); ++a) {
    const glm::dvec3& rest = open.mesh.rest[a];
    if (std::abs(rest.z - 19) > 1e-9) continue;
    for (std::size_t b = a + 1; b < open.mesh.rest.size(); ++b) {
      if (open.mesh.rest[b] != rest) continue;
      const glm::dvec3 gap(open.mesh.displacement[b] - open.mesh.displacement[a]);
      ++lips;
      widest = std::max(widest, std::abs(gap.z));
      EXPECT_LE(glm::length(glm::dvec3(rest.x, rest.y, 0)), 13 + 4) << "a cell more than the radius";
      EXPECT_LT(std::hypot(gap.x, gap.y), 0.5 * std::abs(gap.z) + 0.5);
    }
  }
  EXPECT_GT(lips, 20u);
  EXPECT_GT(widest, 2);  // mm, of the 6 by which the top was pulled away
  EXPECT_LT(widest, 6);
}

}  // namespace
}  // namespace tetwarp::simulate
