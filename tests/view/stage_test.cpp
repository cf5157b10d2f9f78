// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "view/session/stage.h"

#include <gtest/gtest.h>

#include <future>

#include "backend/factories.h"
#include "deform/phantom.h"
#include "deform/points.h"
#include "deform/simulate/scenario_run.h"
#include "io/scenario_file.h"
#include "tests/support/backends.h"
#include "tests/support/run.h"
#include "tests/support/scratch.h"
#include "tests/support/write_file.h"
#include "view/session/coarse_volume.h"
#include "view/session/default_scenario.h"

namespace tetwarp::viewer {
namespace {

using namespace request;
using namespace std::chrono_literals;
using tetwarp::test::same_bits;

constexpr auto kPatience = 60s;

const Volume<std::int16_t>& phantom() {
  static const Volume<std::int16_t> volume = make_phantom({64, 64, 40}, {6.4, 6.4, 7.5}, 1);
  return volume;
}

BackendKind kind_of(const tetwarp::test::Backend& backend) {
  return backend.name.find("cuda") == std::string::npos ? BackendKind::cpu : BackendKind::cuda;
}

Scene::Setup setup(BackendKind backend) { return {.source = view(phantom()), .background = -1024, .backend = backend}; }

/// A field that moves what is inside of the phantom, and whose cells are about 8 voxels.
VertexField bent() {
  VertexField field;
  field.lattice = lattice_over(phantom().geometry, 8);
  for (std::int64_t n = 0; n < voxel_count(field.lattice); ++n) {
    const std::int64_t i = n % field.lattice.size.x, j = n / field.lattice.size.x % field.lattice.size.y;
    const bool inside = i > 0 && j > 0 && i + 1 < field.lattice.size.x && j + 1 < field.lattice.size.y;
    field.displacement.push_back(inside ? glm::vec3(5.3f * static_cast<float>(i % 3), -7.1f, 3.2f) : glm::vec3(0));
  }
  return field;
}

TETWARP_BACKEND_SUITE(Scenes);

TEST_P(Scenes, ASliceIsThatOfTheWholeDeformedVolume) {
  Scene scene(setup(kind_of(GetParam())));
  const VertexField field = bent();
  const auto resampler = make_cpu_resampler(scene.grid());
  const Volume<std::int16_t> whole_volume = resample(*resampler, phantom(), field);
  scene.keep_field(field);
  SliceLook look;
  look.window = {.width = 800, .level = 0};
  for (const AnatomicalPlane plane : {AnatomicalPlane::axial, AnatomicalPlane::coronal, AnatomicalPlane::sagittal}) {
    const Slice slice = scene.slice_near(plane, {11, -17, 20});
    const PaneImage image = scene.slice(slice, look);
    ASSERT_TRUE(image.is_grey);
    int different = 0;
    for (int y = 0; y < image.height; ++y) {
      for (int x = 0; x < image.width; ++x) {
        const glm::dvec3 index = slice.index_at(scene.grid(), (x + 0.5) / image.width, (y + 0.5) / image.height);
        const std::size_t at = tetwarp::test::offset_of(scene.grid(), glm::i64vec3(glm::round(index)));
        different +=
            image.pixels[static_cast<std::size_t>(y * image.width + x)] != look.window(whole_volume.voxels[at])[0];
      }
    }
    EXPECT_EQ(different, 0) << static_cast<int>(plane);
    look.compared = Compared::before;
    EXPECT_NE(scene.slice(slice, look).pixels, image.pixels);
    look.compared = Compared::swipe;
    look.swipe = 0;
    EXPECT_EQ(scene.slice(slice, look).pixels, image.pixels);
    look.compared = Compared::after;
  }
}

TEST_P(Scenes, TissueIsFoundAgainWhereTheFieldTookIt) {
  Scene scene(setup(kind_of(GetParam())));
  const VertexField field = bent();
  scene.keep_field(field);
  PointMover mover(scene.grid(), view(field));
  int found = 0;
  for (const glm::dvec3& rest : {glm::dvec3(3, -20, 11), glm::dvec3(-61, 14, -40), glm::dvec3(40, 40, 70)}) {
    glm::dvec3 moved = rest;
    ASSERT_EQ(mover.move(moved), PointStatus::moved);
    const std::optional<glm::dvec3> back = scene.undeformed(moved);
    ASSERT_TRUE(back.has_value());
    // The inverse is that of the voxel nearest by, whose tetrahedron may be the next one.
    EXPECT_LT(glm::distance(*back, rest), 8) << found;
    const std::optional<Scene::Values> values = scene.values_at(moved);
    ASSERT_TRUE(values.has_value());
    ++found;
  }
  EXPECT_EQ(found, 3);
  EXPECT_FALSE(scene.undeformed({5000, 0, 0}).has_value());
  EXPECT_FALSE(scene.values_at({5000, 0, 0}).has_value());
}

TEST_P(Scenes, TheExactVolumeSaysWhatTheFieldIsWorth) {
  Scene scene(setup(kind_of(GetParam())));
  scene.set_style({.transfer = transfer_function("ct-bone")});
  VertexField field = bent();
  scene.keep_field(field);
  scene.make_exact();
  EXPECT_TRUE(scene.is_exact());
  Report report;
  const auto resampler = make_cpu_resampler(scene.grid());
  resample(*resampler, phantom(), field, &report);
  EXPECT_GT(report.uncovered, 0u);
  EXPECT_EQ(scene.quality().coverage,
            static_cast<double>(report.covered) / static_cast<double>(voxel_count(scene.grid())));
  EXPECT_EQ(scene.quality().jacobian_min, report.jacobian_min);
  // A vertex that leaps over its neighbours turns tetrahedra inside out.
  const std::size_t vertex = 4 + 9 * (4 + 9 * 2);
  for (glm::vec3& u : field.displacement) u = glm::vec3(0);
  field.displacement[vertex] = glm::vec3(150, 0, 0);
  scene.keep_field(field);
  EXPECT_FALSE(scene.is_exact());
  scene.make_exact();
  EXPECT_GT(scene.quality().inverted, 0u);
  EXPECT_LT(scene.quality().jacobian_min.value(), 0);
}

TEST_P(Scenes, LabelsGoWithTheVolumeByVote) {
  Volume<std::uint8_t> labels{phantom().geometry, {}};
  for (const std::int16_t value : phantom().voxels) labels.voxels.push_back(value > 200 ? 2 : value > -300 ? 1 : 0);
  Scene::Setup of = setup(kind_of(GetParam()));
  of.labels = view(std::as_const(labels));
  Scene scene(of);
  const VertexField field = bent();
  scene.keep_field(field);
  const auto resampler = make_cpu_resampler(scene.grid());
  resampler->set_field(view(field));
  Volume<std::uint8_t> deformed{scene.grid(), std::vector<std::uint8_t>(labels.voxels.size())};
  const Target target{
      .source = view(std::as_const(labels)), .output = view(deformed), .interpolation = Interpolation::vote};
  resampler->resample(whole(scene.grid()), {&target, 1});
  SliceLook look;
  look.window = {.width = 800, .level = 0};
  const Slice slice = scene.slice_near(AnatomicalPlane::axial, {11, -17, 20});
  const PaneImage plain = scene.slice(slice, look);
  look.layer = Layer::labels;
  const PaneImage filled = scene.slice(slice, look);
  look.layer = Layer::contours;
  const PaneImage lines = scene.slice(slice, look);
  std::size_t coloured = 0, lined = 0, wrong = 0;
  for (int y = 0; y < plain.height; ++y) {
    for (int x = 0; x < plain.width; ++x) {
      const glm::dvec3 index = slice.index_at(scene.grid(), (x + 0.5) / plain.width, (y + 0.5) / plain.height);
      const std::size_t at = tetwarp::test::offset_of(scene.grid(), glm::i64vec3(glm::round(index)));
      const auto pixel = static_cast<std::size_t>(y * plain.width + x);
      const auto is_grey = [&](const PaneImage& image) {
        return image.pixels[3 * pixel] == image.pixels[3 * pixel + 1] &&
               image.pixels[3 * pixel] == image.pixels[3 * pixel + 2];
      };
      wrong += is_grey(filled) != (deformed.voxels[at] == 0);
      coloured += !is_grey(filled);
      lined += !is_grey(lines);
      wrong += !is_grey(lines) && is_grey(filled);  // lines lie on the inner side
    }
  }
  EXPECT_EQ(wrong, 0u);
  EXPECT_GT(lined, 50u);
  EXPECT_LT(lined, coloured / 2);
}

TEST_P(Scenes, APullFieldGivesTheVolumeThatItsResamplerGives) {
  Scene scene(setup(kind_of(GetParam())));
  PullField pull{scene.grid(), {}};
  pull.grid.size = glm::i64vec3(3);
  pull.grid.spacing = scene.grid().spacing * glm::dvec3(scene.grid().size - std::int64_t{1}) / 2.0;
  for (int n = 0; n < 27; ++n)
    pull.displacement.emplace_back(3.3f * static_cast<float>(n % 4), -7, 0.4f * static_cast<float>(n));
  scene.keep_field(pull);
  const auto resampler = make_cpu_pull_resampler(scene.grid());
  resampler->set_field(view(pull, Outside::background));
  Volume<std::int16_t> deformed{scene.grid(), std::vector<std::int16_t>(phantom().voxels.size())};
  const Target target{.source = view(phantom()), .output = view(deformed), .background = -1024};
  resampler->resample(whole(scene.grid()), {&target, 1});
  for (const glm::dvec3& at : {glm::dvec3(3, -20, 11), glm::dvec3(-61, 14, -40), glm::dvec3(40, 40, 70)}) {
    const glm::dvec3 index = glm::round(index_from_point(scene.grid())(at));
    EXPECT_EQ(scene.values_at(at)->after, deformed.voxels[tetwarp::test::offset_of(scene.grid(), glm::i64vec3(index))]);
  }
  scene.keep_field(bent());  // and forward fields again
  scene.make_exact();
  EXPECT_TRUE(scene.quality().jacobian_min.has_value());
}

TEST_P(Scenes, WhatIsPickedLiesOnWhatIsSeen) {
  Scene scene(setup(kind_of(GetParam())));
  scene.set_style({.transfer = transfer_function("ct-skin")});
  const ViewPlane plane = view_plane({.width = 64, .height = 64}, scene.grid());
  scene.make_exact();
  const std::optional<glm::dvec3> at = scene.pick(plane, 32, 32);
  ASSERT_TRUE(at.has_value());
  const glm::dvec3 seen = plane.project(*at);
  EXPECT_NEAR(seen.x, 32.5, 0.01);
  EXPECT_NEAR(seen.y, 32.5, 0.01);
  const std::optional<Scene::Values> here = scene.values_at(*at);
  const std::optional<Scene::Values> before = scene.values_at(*at - 20.0 * plane.forward);
  ASSERT_TRUE(here && before);
  EXPECT_LT(before->after, -600);  // air in front of the skin
  EXPECT_GT(scene.values_at(*at + 8.0 * plane.forward)->after, -400);
  EXPECT_FALSE(scene.pick(plane, 0, 0).has_value());
}

/// A stage, and what it says.
class Watched {
 public:
  explicit Watched(BackendKind backend, std::optional<Reel> reel = {})
      : scene_(setup(backend)),
        scenario_(default_scenario(phantom().geometry, false)),
        patient_(simulate::examine(view(phantom()), nullptr, scenario_.cell_size, -400)) {
    Stage::Setup of;
    of.scenario = scenario_;
    of.patient = &patient_;
    of.scene = &scene_;
    of.reel = std::move(reel);
    of.has_device = backend != BackendKind::cpu;
    of.make = [backend](simulate::Method method) -> simulate::MakeSimulation {
      return [=](const simulate::Model& model) { return simulate::make_simulation(backend, method, model); };
    };
    stage_ = std::make_unique<Stage>(
        std::move(of), Stage::Listener{.picture =
                                           [this](const Picture& picture) {
                                             stage_ready_.wait();
                                             stage_->ask({Shown{picture.pane, picture.number}, 0});
                                             const std::lock_guard lock(mutex_);
                                             exact_[static_cast<std::size_t>(picture.pane)] = picture.is_exact;
                                             shows_[static_cast<std::size_t>(picture.pane)] = picture.request;
                                             ++pictures_;
                                             changed_.notify_all();
                                           },
                                       .state =
                                           [this](State state) {
                                             const std::lock_guard lock(mutex_);
                                             state_ = std::move(state);
                                             changed_.notify_all();
                                           },
                                       .answer =
                                           [this](Answer answer) {
                                             const std::lock_guard lock(mutex_);
                                             answers_.push_back(std::move(answer));
                                             changed_.notify_all();
                                           },
                                       .save =
                                           [this](SaveJob job) {
                                             const std::lock_guard lock(mutex_);
                                             saved_ = std::move(job);
                                             changed_.notify_all();
                                           }});
    ready_.set_value();
    for (int pane = 0; pane < kPanes; ++pane) ask(Size{static_cast<Pane>(pane), 120, 100});
    stage_->watch(true);
  }

  template <class What>
  std::uint32_t ask(What what) {
    if (!std::is_same_v<What, request::Save> && !std::is_same_v<What, Probe>) visible_ = number_ + 1;
    stage_->ask({std::move(what), ++number_});
    return number_;
  }

  /// Waits until all panes are exact and show the last request that can be seen, and nothing moves.
  [[nodiscard]] bool rests() {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, kPatience, [this] {
      for (int pane = 0; pane < kPanes; ++pane)
        if (!exact_[static_cast<std::size_t>(pane)] || shows_[static_cast<std::size_t>(pane)] < visible_) return false;
      return state_ && state_->quality && !state_->is_moving;
    });
  }
  [[nodiscard]] bool simulates(int frames) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, kPatience, [&] { return state_ && state_->frames >= frames; });
  }
  std::optional<Answer> answer(std::uint32_t number) {
    std::unique_lock lock(mutex_);
    std::optional<Answer> found;
    changed_.wait_for(lock, kPatience, [&] {
      for (const Answer& answer : answers_)
        if (answer.number == number) found = answer;
      return found.has_value();
    });
    return found;
  }
  std::string saved() { return save({"a", ""}).scenario; }
  SaveJob save(request::Save wish) {
    ask(std::move(wish));
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, kPatience, [&] { return saved_.has_value(); });
    return std::exchange(saved_, std::nullopt).value_or(SaveJob{});
  }
  State state() {
    const std::lock_guard lock(mutex_);
    return state_.value_or(State{});
  }
  int pictures() {
    const std::lock_guard lock(mutex_);
    return pictures_;
  }
  void watch(bool somebody) { stage_->watch(somebody); }
  std::future<void> visit(std::function<void(const Session&)> see) { return stage_->visit(std::move(see)); }
  void end() { stage_.reset(); }
  const simulate::Patient& patient() const { return patient_; }

 private:
  Scene scene_;
  simulate::Scenario scenario_;
  simulate::Patient patient_;
  std::promise<void> ready_;
  std::shared_future<void> stage_ready_ = ready_.get_future().share();
  std::mutex mutex_;
  std::condition_variable changed_;
  std::array<bool, kPanes> exact_{};
  std::array<std::uint32_t, kPanes> shows_{};
  std::optional<State> state_;
  std::vector<Answer> answers_;
  std::optional<SaveJob> saved_;
  int pictures_ = 0;
  std::uint32_t number_ = 0, visible_ = 0;
  std::unique_ptr<Stage> stage_;
};

TETWARP_BACKEND_SUITE(Stages);

TEST_P(Stages, AVisitSeesWhatWasAskedForBefore) {
  Watched stage(kind_of(GetParam()));
  ASSERT_TRUE(stage.rests());
  std::size_t pins = 0;
  const auto see = [&](const Session& session) { pins = session.pins().size(); };
  stage.visit(see).get();
  EXPECT_EQ(pins, 0u);
  stage.ask(request::Pin{glm::dvec3(0, -60, 0), 25});
  stage.visit(see).get();
  EXPECT_EQ(pins, 1u);
  stage.watch(false);
  stage.ask(Unpin{});
  stage.visit(see).get();  // though nobody looks
  EXPECT_EQ(pins, 0u);
  EXPECT_THROW(stage.visit([](const Session&) { throw Error("no"); }).get(), Error);
  EXPECT_TRUE(stage.visit(see).wait_for(kPatience) == std::future_status::ready);
}

TEST_P(Stages, AVisitToAStageThatEndsEnds) {
  Watched stage(kind_of(GetParam()));
  ASSERT_TRUE(stage.rests());
  std::promise<void> inside, leave;
  std::future<void> first = stage.visit([&](const Session&) {
    inside.set_value();
    leave.get_future().wait_for(kPatience);
  });
  ASSERT_EQ(inside.get_future().wait_for(kPatience), std::future_status::ready);
  std::future<void> second = stage.visit([](const Session&) {});
  std::thread ending([&] { stage.end(); });
  std::this_thread::sleep_for(50ms);
  leave.set_value();
  ending.join();
  EXPECT_NO_THROW(first.get());
  EXPECT_THROW(second.get(), std::future_error);
}

TEST_P(Stages, WhatAHandDoesIsSavedAndRepeatedToTheSameBits) {
  Watched stage(kind_of(GetParam()));
  ASSERT_TRUE(stage.rests());
  EXPECT_FALSE(stage.state().can_undo);
  stage.ask(Grip{glm::dvec3(0, -60, 0), 25});
  for (int n = 1; n <= 5; ++n) {
    stage.ask(request::Move{{4.0 * n, -2.5 * n, 0}});
    ASSERT_TRUE(stage.simulates(n));
  }
  stage.ask(request::Pin{glm::dvec3(60, 0, 10), 20});
  stage.ask(request::Cut{{glm::dvec3(-60, -20, 0), glm::dvec3(-30, 25, 0)}, {0, 0, 1}, 60, true});
  ASSERT_TRUE(stage.rests());
  EXPECT_EQ(stage.state().cuts.size(), 1u);
  EXPECT_TRUE(stage.state().cuts[0].second);
  ASSERT_EQ(stage.state().pins.size(), 1u);
  EXPECT_LT(glm::distance(glm::dvec3(stage.state().pins[0]), {60, 0, 10}), 8);
  EXPECT_EQ(stage.state().pins[0].w, 20);
  stage.ask(Suture{"cut 1"});
  ASSERT_TRUE(stage.rests());
  EXPECT_FALSE(stage.state().cuts[0].second);
  const Scratch scratch;
  write_file(scratch / "hand.json", stage.saved());
  const simulate::Scenario recorded = read_scenario(scratch / "hand.json");
  EXPECT_EQ(simulate::frame_count(recorded), stage.state().frames);
  const auto replay = [&](BackendKind backend) {
    simulate::ScenarioRun run(recorded, stage.patient(), [&](const simulate::Model& model) {
      return simulate::make_simulation(backend, recorded.method, model);
    });
    while (!run.is_done()) run.next();
    return run.displacement();
  };
  const std::vector<glm::vec3> on_cpu = replay(BackendKind::cpu);
  EXPECT_TRUE(same_bits(on_cpu, replay(kind_of(GetParam()))));
  EXPECT_TRUE(std::any_of(on_cpu.begin(), on_cpu.end(), [](const glm::vec3& u) { return glm::length(u) > 1; }));
}

TEST_P(Stages, WhatCannotBeDoneIsAnsweredWithTheReasonAndChangesNothing) {
  Watched stage(kind_of(GetParam()));
  ASSERT_TRUE(stage.rests());
  const auto problem = [&](std::uint32_t number) {
    const std::optional<Answer> answer = stage.answer(number);
    return answer && answer->kind == Answer::Kind::problem ? answer->text : std::string("no problem");
  };
  EXPECT_NE(problem(stage.ask(request::Move{{1, 0, 0}})).find("holds nothing"), std::string::npos);
  EXPECT_NE(problem(stage.ask(Suture{"cut 7"})).find("no cut has the name"), std::string::npos);
  EXPECT_NE(problem(stage.ask(request::Save{"a", ""})).find("nothing has been done"), std::string::npos);
  EXPECT_NE(problem(stage.ask(Style{"rainbow"})).find("rainbow"), std::string::npos);
  EXPECT_NE(problem(stage.ask(Grip{glm::dvec2(0, 0), 10})).find("nothing is seen"), std::string::npos);
  EXPECT_NE(problem(stage.ask(request::Cut{{glm::dvec3(9000, 0, 0), glm::dvec3(9000, 9, 0)}, {0, 0, 1}, 9, true}))
                .find("meets no tissue"),
            std::string::npos);
  ASSERT_TRUE(stage.rests());
  EXPECT_EQ(stage.state().frames, 0);
  EXPECT_FALSE(stage.state().can_undo);
}

TEST_P(Stages, UndoGoesBackToTheBeginningAndRedoForthAgain) {
  Watched stage(kind_of(GetParam()));
  stage.ask(Grip{glm::dvec3(0, -60, 0), 25});
  stage.ask(request::Move{{10, 0, 0}});
  ASSERT_TRUE(stage.simulates(1));
  stage.ask(Release{});
  ASSERT_TRUE(stage.rests());
  const int frames = stage.state().frames;
  const std::string before = stage.saved();
  stage.ask(Reset{});
  ASSERT_TRUE(stage.rests());
  EXPECT_EQ(stage.state().frames, 0);
  EXPECT_EQ(stage.state().quality->jacobian_min, 1);
  while (stage.state().can_redo) {
    const std::uint32_t number = stage.ask(Redo{});
    stage.ask(Probe{{0, 0, 0}});
    ASSERT_TRUE(stage.answer(number + 1).has_value());
  }
  EXPECT_EQ(stage.state().frames, frames);
  EXPECT_EQ(stage.saved(), before);
}

TEST_P(Stages, NothingIsMadeWhileNobodyLooks) {
  Watched stage(kind_of(GetParam()));
  ASSERT_TRUE(stage.rests());
  stage.watch(false);
  stage.ask(Grip{glm::dvec3(0, -60, 0), 25});
  stage.ask(request::Move{{10, 0, 0}});
  std::this_thread::sleep_for(300ms);
  const int pictures = stage.pictures();
  EXPECT_EQ(stage.state().frames, 0);
  std::this_thread::sleep_for(200ms);
  EXPECT_EQ(stage.pictures(), pictures);
  stage.watch(true);  // a page that comes back finds all as it was
  ASSERT_TRUE(stage.simulates(1));
  ASSERT_TRUE(stage.rests());
}

TEST(CoarseVolumes, EachVoxelIsTheMeanOfItsBlockInThePlaceOfTheBlock) {
  Volume<std::int16_t> volume{{.size = {200, 100, 5}, .spacing = {1, 2, 3}, .origin = {10, 20, 30}}, {}};
  for (std::int64_t n = 0; n < voxel_count(volume.geometry); ++n)
    volume.voxels.push_back(static_cast<std::int16_t>(n % 200 + 1000 * (n / 20000)));
  const glm::i64vec3 blocks = coarse_blocks(volume.geometry);
  EXPECT_EQ(blocks, glm::i64vec3(3, 2, 1));
  AnyVolume coarse = coarse_volume(view(std::as_const(volume)), blocks);
  EXPECT_EQ(coarse.geometry().size, glm::i64vec3(67, 50, 5));
  EXPECT_EQ(point_from_index(coarse.geometry())(glm::dvec3(0)), glm::dvec3(11, 21, 30));
  EXPECT_EQ(coarse.as<std::int16_t>()[1], 4);               // of 3, 4, 5
  EXPECT_EQ(coarse.as<std::int16_t>()[66], 199);            // of 198 and 199: 198.5 goes up
  EXPECT_EQ(coarse.as<std::int16_t>()[67 * 50 * 2], 2001);  // of 2000, 2001, 2002
}

/// What a hand did differs from backend to backend only in how many steps there were, so pins are sought where the hand
/// put them after tissue had moved.
TEST_P(Stages, APinIsShownWhereItsTissueLies) {
  Watched stage(kind_of(GetParam()));
  stage.ask(Grip{glm::dvec3(0, -60, 0), 30});
  stage.ask(request::Move{{12, -9, 0}});
  ASSERT_TRUE(stage.rests());
  const glm::dvec3 at(12, -69, 0);
  stage.ask(request::Pin{at, 15});
  ASSERT_TRUE(stage.rests());
  ASSERT_EQ(stage.state().pins.size(), 1u);
  EXPECT_LT(glm::distance(glm::dvec3(stage.state().pins[0]), at), 8);
  stage.ask(Release{});
  stage.ask(Unpin{});
  ASSERT_TRUE(stage.rests());
  EXPECT_TRUE(stage.state().pins.empty());
}

TEST_P(Stages, ALassoIsACutWhoseEndsAreJoined) {
  Watched stage(kind_of(GetParam()));
  std::vector<Pointed> around;
  for (int n = 0; n < 12; ++n) around.emplace_back(glm::dvec3(40 * std::cos(0.5236 * n), 40 * std::sin(0.5236 * n), 0));
  stage.ask(request::Cut{around, {0, 0, 1}, 60, true, true});
  ASSERT_TRUE(stage.rests());
  const Scratch scratch;
  write_file(scratch / "hand.json", stage.saved());
  const simulate::Scenario recorded = read_scenario(scratch / "hand.json");
  ASSERT_EQ(recorded.cuts.size(), 1u);
  EXPECT_TRUE(std::get<simulate::SweptCutPlan>(recorded.cuts[0].shape).is_closed);
}

TEST_P(Stages, OtherTissuesBeginAnewAndAreSaved) {
  Watched stage(kind_of(GetParam()));
  ASSERT_TRUE(stage.rests());
  std::vector<simulate::Tissue> tissues = stage.state().tissues;
  ASSERT_EQ(tissues.size(), 4u);
  const auto pulled = [&] {
    stage.ask(Grip{glm::dvec3(0, -60, 0), 25});
    stage.ask(request::Move{{20, -20, 0}});
    EXPECT_TRUE(stage.rests());
    return *stage.state().quality;
  };
  const Quality before = pulled();
  for (simulate::Tissue& tissue : tissues) tissue.stretch = tissue.compression = tissue.shear = 0.01;
  stage.ask(Tissues{tissues});
  ASSERT_TRUE(stage.rests());
  EXPECT_EQ(stage.state().frames, 0);
  EXPECT_EQ(stage.state().tissues[1].stretch, 0.01);
  const Quality stiff = pulled();
  EXPECT_NE(*stiff.jacobian_min, *before.jacobian_min);
  EXPECT_NE(stage.saved().find("0.01"), std::string::npos);
  tissues[0].name = "marble";
  const std::optional<Answer> refused = stage.answer(stage.ask(Tissues{tissues}));
  ASSERT_TRUE(refused.has_value());
  EXPECT_NE(refused->text.find("other names"), std::string::npos);
}

/// A field that grows in 5 frames.
Reel growing() {
  return {.frames = 5, .grows = true, .pulls = false, .field = [](int frame) -> AnyField {
            VertexField field = bent();
            for (glm::vec3& u : field.displacement) u *= static_cast<float>(frame) / 4;
            return field;
          }};
}

TEST_P(Stages, AFieldIsShownAndGrows) {
  Watched stage(kind_of(GetParam()), growing());
  ASSERT_TRUE(stage.rests());
  EXPECT_EQ(stage.state().frame, 4);
  const double whole = *stage.state().quality->jacobian_min;
  EXPECT_LT(whole, 1);
  stage.ask(Frame{0});
  ASSERT_TRUE(stage.rests());
  EXPECT_EQ(stage.state().quality->jacobian_min, 1);
  stage.ask(Play{});
  ASSERT_TRUE(stage.rests());
  EXPECT_EQ(stage.state().frame, 4);
  EXPECT_EQ(stage.state().quality->jacobian_min, whole);
  const auto refusal = [&](auto what) { return stage.answer(stage.ask(std::move(what))).value_or(Answer{}).text; };
  EXPECT_NE(refusal(Grip{glm::dvec3(0), 10}).find("hands work without it"), std::string::npos);
  EXPECT_NE(refusal(Undo{}).find("hands work without it"), std::string::npos);
  EXPECT_NE(refusal(Frame{5}).find("5 frames"), std::string::npos);
  stage.ask(Frame{2});
  EXPECT_NE(refusal(request::Save{"a", ".mha"}).find("whole field"), std::string::npos);
  stage.ask(Frame{4});
  const SaveJob job = stage.save({.name = "a", .volume = ".mha", .pictures = true});
  EXPECT_TRUE(job.scenario.empty());
  EXPECT_EQ(job.frame, 4);
  EXPECT_EQ(job.pictures.size(), static_cast<std::size_t>(kPanes));
}

TEST_P(Stages, APullFieldIsShownWithoutWhatOnlyTetrahedraHave) {
  const Geometry grid = straightened(phantom().geometry);
  Watched stage(kind_of(GetParam()), Reel{.frames = 1, .grows = false, .pulls = true, .field = [grid](int) -> AnyField {
                                            PullField field{grid, {}};
                                            field.grid.size = glm::i64vec3(2);
                                            field.grid.spacing = grid.spacing * glm::dvec3(grid.size - std::int64_t{1});
                                            field.displacement.assign(8, glm::vec3(30, 0, 0));
                                            return field;
                                          }});
  ASSERT_TRUE(stage.rests());
  EXPECT_FALSE(stage.state().quality->jacobian_min.has_value());
  EXPECT_LT(stage.state().quality->coverage, 1);
  const std::optional<Answer> refused = stage.answer(stage.ask(LayOver{Layer::folds}));
  ASSERT_TRUE(refused.has_value());
  EXPECT_NE(refused->text.find("no tetrahedra"), std::string::npos);
  stage.ask(LayOver{Layer::coverage});
  ASSERT_TRUE(stage.rests());
}

}  // namespace
}  // namespace tetwarp::viewer
