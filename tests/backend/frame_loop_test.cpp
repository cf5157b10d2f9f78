// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "backend/frame_loop.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include "backend/devices.h"
#include "backend/factories.h"
#include "deform/phantom.h"
#include "io/scenario_file.h"

namespace tetwarp {
namespace {

using namespace simulate;

/// A shipped scenario on a small phantom.
class FrameLoops : public testing::TestWithParam<BackendKind> {
 protected:
  void SetUp() override {
    if (GetParam() == BackendKind::cuda && device_count() == 0) GTEST_SKIP() << "no CUDA device";
    resampler_ = make_forward_resampler(GetParam(), phantom_.geometry);
    renderer_ = make_renderer(GetParam());
    renderer_->set_style({.transfer = transfer_function("ct-bone")});
  }

  static Scenario scenario(const std::string& name, Method method, double deadband_mm = 0) {
    Scenario made = read_scenario(std::string(TETWARP_SCENARIOS) + "/" + name + ".json");
    made.method = method;
    made.cell_size = 6;
    made.stop.steps = 2;
    made.deadband_mm = deadband_mm;
    return made;
  }
  std::unique_ptr<ScenarioRun> run_of(const Scenario& scenario) {
    patient_ = examine(view(phantom_), nullptr, scenario.cell_size, scenario.body_above_hu);
    return std::make_unique<ScenarioRun>(
        scenario, patient_, [&](const Model& model) { return make_simulation(GetParam(), scenario.method, model); });
  }
  Target target() { return {.source = view(phantom_), .output = view(deformed_), .background = -1000}; }
  ViewPlane plane() const { return view_plane(camera_, phantom_.geometry); }

  /// One part after the other, and all of it: what a FrameLoop must show.
  struct Expected {
    FrameResult result;
    std::vector<std::int16_t> voxels;
    std::vector<std::uint8_t> rgb;
  };
  std::vector<Expected> one_after_another(const Scenario& scenario) {
    std::vector<Expected> frames;
    const auto run = run_of(scenario);
    const auto resampler = make_cpu_resampler(phantom_.geometry);
    const auto renderer = make_cpu_renderer();
    renderer->set_style({.transfer = transfer_function("ct-bone")});
    Volume<std::int16_t> deformed = phantom_;
    const Target target{.source = view(phantom_), .output = view(deformed), .background = -1000};
    while (!run->is_done()) {
      const FrameResult result = run->next();
      const VertexField field = run->field();
      resampler->set_field(view(field, Outside::background));
      resampler->resample(whole(phantom_.geometry), {&target, 1});
      renderer->set_volume(view(std::as_const(deformed)));
      std::vector<std::uint8_t> rgb(3 * static_cast<std::size_t>(camera_.width) * camera_.height);
      renderer->render(plane(), rgb);
      frames.push_back({result, deformed.voxels, std::move(rgb)});
    }
    return frames;
  }
  /// @param seen  `FrameLoop::Parts::seen`: with it, pictures alone are compared
  void expect_same_frames(const Scenario& scenario, const std::vector<ValueRange>& seen = {}) {
    const std::vector<Expected> expected = one_after_another(scenario);
    const auto run = run_of(scenario);
    FrameLoop loop({*run, *resampler_, *renderer_, target(), Outside::background, seen}, GetParam());
    for (const Expected& frame : expected) {
      SCOPED_TRACE("frame " + std::to_string(frame.result.number));
      ASSERT_FALSE(loop.is_done());
      const ShownFrame shown = loop.next(plane());
      EXPECT_EQ(shown.simulated.number, frame.result.number);
      EXPECT_EQ(shown.simulated.ends_phase, frame.result.ends_phase);
      EXPECT_EQ(shown.simulated.convergence.motion_mm, frame.result.convergence.motion_mm);
      // On a device it is being deformed for the next frame.
      if (seen.empty() && (GetParam() == BackendKind::cpu || loop.is_done())) {
        ASSERT_EQ(deformed_.voxels, frame.voxels);
      }
      ASSERT_TRUE(std::equal(shown.rgb.begin(), shown.rgb.end(), frame.rgb.begin(), frame.rgb.end()));
    }
    EXPECT_TRUE(loop.is_done());
    EXPECT_THROW(loop.next(plane()), InputError);
  }

  const Volume<std::int16_t> phantom_ = make_phantom({60, 60, 40}, {7, 7, 8}, 3);
  Volume<std::int16_t> deformed_ = phantom_;
  const Camera camera_{.angle_deg = 30, .width = 90, .height = 70};
  Patient patient_;
  std::unique_ptr<ForwardResampler> resampler_;
  std::unique_ptr<Renderer> renderer_;
};

INSTANTIATE_TEST_SUITE_P(Backends, FrameLoops, testing::Values(BackendKind::cpu, BackendKind::cuda),
                         [](const auto& one) { return std::string(name_of(one.param)); });

TEST_P(FrameLoops, ShowWhatOnePartAfterTheOtherGives) {
  for (const Method method : {Method::chainmail, Method::mass_spring}) {
    SCOPED_TRACE(method == Method::chainmail ? "chainmail" : "mass-spring");
    expect_same_frames(scenario("retractor", method));
    expect_same_frames(scenario("retractor", method, 0.5));
  }
}

TEST_P(FrameLoops, ShowTheSameWhereWhatIsNotSeenIsLeft) {
  const std::vector<ValueRange> seen = seen_values({.transfer = transfer_function("ct-bone")});
  expect_same_frames(scenario("diaphragm_push", Method::chainmail), seen);
  expect_same_frames(scenario("retractor", Method::mass_spring, 0.5), seen);
}

TEST_P(FrameLoops, FollowCutsThatOpenAndClose) {
  Scenario incision = scenario("incision", Method::mass_spring);
  incision.cell_size = 3;  // so that both lips have vertices of their own
  expect_same_frames(incision);
}

TEST_P(FrameLoops, MayEndBeforeTheirScenario) {
  const Scenario retractor = scenario("retractor", Method::chainmail);
  const auto run = run_of(retractor);
  {
    FrameLoop loop({*run, *resampler_, *renderer_, target()}, GetParam());
    loop.next(plane());
  }
  { FrameLoop loop({*run, *resampler_, *renderer_, target()}, GetParam()); }  // no frame at all
  EXPECT_GE(run->frames_done(), 1);
}

TEST_P(FrameLoops, ThrowWhatASimulationThrows) {
  Scenario impossible = scenario("retractor", Method::chainmail);
  impossible.phases[1].moves[0].how = Shift{{1e6, 0, 0}};
  std::unique_ptr<ScenarioRun> run;
  try {
    run = run_of(impossible);
  } catch (const InputError&) {
    GTEST_SKIP() << "refused before the first frame";
  }
  FrameLoop loop({*run, *resampler_, *renderer_, target()}, GetParam());
  int shown = 0;
  EXPECT_THROW(
      while (!loop.is_done()) {
        loop.next(plane());
        ++shown;
      },
      InputError);
  EXPECT_EQ(shown, impossible.phases[0].frames);
}

/// A simulation that holds its nodes back shows them where they were, at most so far away; the last frame shows all.
TEST_P(FrameLoops, HoldBackSmallMotions) {
  for (const Method method : {Method::chainmail, Method::mass_spring}) {
    SCOPED_TRACE(method == Method::chainmail ? "chainmail" : "mass-spring");
    constexpr double kBand = 0.4;
    const Scenario exact = scenario("retractor", method), held = scenario("retractor", method, kBand);
    const auto run = run_of(exact), other = run_of(held);
    std::vector<glm::vec3> before(static_cast<std::size_t>(voxel_count(patient_.lattice)), glm::vec3(0));
    std::size_t stayed = 0, moved = 0;
    while (!run->is_done()) {
      const FrameResult frame = run->next();
      other->next();
      const std::vector<glm::vec3> where = run->displacement(), shown = other->displacement();
      for (std::size_t n = 0; n < before.size(); ++n) {
        const double away = glm::length(glm::dvec3(where[n] - before[n]));
        if (frame.ends_phase || away > 1.001 * kBand) {
          ASSERT_EQ(shown[n], where[n]);
          ++moved;
        } else if (away < 0.999 * kBand) {
          ASSERT_EQ(shown[n], before[n]);
          stayed += where[n] != before[n] ? 1 : 0;
        }
      }
      before = shown;
    }
    EXPECT_GT(stayed, 100u);
    EXPECT_GT(moved, 100u);
  }
}

}  // namespace
}  // namespace tetwarp
