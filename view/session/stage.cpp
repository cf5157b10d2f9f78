// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "view/session/stage.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "deform/errors.h"
#include "deform/field_quality.h"

namespace tetwarp::viewer {

using namespace request;

namespace {

using std::chrono::milliseconds;

constexpr milliseconds kPace(16);  ///< between two pictures at least: a screen shows no more
/// While tissue comes to rest, further steps begin so long after the first one of a picture at least.
constexpr milliseconds kSettling(10);
/// A step with all its pictures takes no longer where what moves is seen to move smoothly: 15 pictures a second.
constexpr milliseconds kSmooth(66);
/// Without a request, before exact pictures are made.
constexpr milliseconds kUntilRest(80), kUntilRestOnDevice(30);
constexpr std::chrono::seconds kUntilRetry(1);  ///< after something failed that nobody asked for
/// Steps after which tissue that still moves a little is let be, if the hand is still.
constexpr int kMostRestingSteps = 60;
constexpr int kMostMovingPixels = 256;  ///< on a side of the volume's picture while it moves, without a device

/// Whether the second of two requests in a row makes the first one superfluous.
bool supersedes(const Request& later, const Request& earlier) {
  if (later.what.index() != earlier.what.index()) return false;
  return std::visit(
      [&](const auto& one) {
        using One = std::decay_t<decltype(one)>;
        if constexpr (std::is_same_v<One, Ball>) return one.radius_mm == std::get<Ball>(earlier.what).radius_mm;
        return std::is_same_v<One, Look> || std::is_same_v<One, Turn> || std::is_same_v<One, Levels> ||
               std::is_same_v<One, Compare> || std::is_same_v<One, Move> || std::is_same_v<One, Probe> ||
               std::is_same_v<One, Frame>;
      },
      later.what);
}

/// Whether a request asks for nothing that pictures at rest would show differently.
bool lets_rest(const Request& request) {
  return std::holds_alternative<Probe>(request.what) || std::holds_alternative<Shown>(request.what) ||
         std::holds_alternative<request::Save>(request.what);
}

}  // namespace

/// Adds its lifetime to what was spent.
class Stage::Timer {
 public:
  Timer(Stage& stage, Spent StageTimes::*what) : stage_(stage), what_(what) {}
  ~Timer() {
    const std::lock_guard lock(stage_.mutex_);
    Spent& spent = stage_.times_.*what_;
    ++spent.count;
    spent.seconds += std::chrono::duration<double>(Clock::now() - begun_).count();
  }
  Timer(const Timer&) = delete;
  Timer& operator=(const Timer&) = delete;

 private:
  Stage& stage_;
  Spent StageTimes::*what_;
  Clock::time_point begun_ = Clock::now();
};

Stage::Stage(Setup setup, Listener listener)
    : setup_(std::move(setup)),
      listener_(std::move(listener)),
      scene_(*setup_.scene),
      method_(setup_.scenario.method),
      cursor_mm_(centre(scene_.grid())),
      encoders_(setup_.has_device ? 4 : 1) {
  const auto free = [this] {
    const std::lock_guard lock(mutex_);
    woken_ = true;
    wake_.notify_one();
  };
  for (std::size_t n = 0; n < lines_.size(); ++n)
    lines_[n] = std::make_unique<PaneLine>(static_cast<Pane>(n), encoders_, listener_.picture, free);
  look_.window = scene_.window();
  camera_.every_angle = true;
  on(Style{look_.window.hounsfield ? "ct-bone" : "mip"});
  if (setup_.reel) {
    show_frame(setup_.reel->grows ? setup_.reel->frames - 1 : 0);
  } else {
    begin_session(method_);
  }
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

Stage::~Stage() {
  thread_.request_stop();
  const std::lock_guard lock(mutex_);
  resting_.request_stop();
  woken_ = true;
  wake_.notify_one();
}

void Stage::ask(Request request) {
  const std::lock_guard lock(mutex_);
  if (!lets_rest(request)) resting_.request_stop();
  asked_.push_back(std::move(request));
  woken_ = true;
  wake_.notify_one();
}

void Stage::watch(bool somebody) {
  const std::lock_guard lock(mutex_);
  watched_ = somebody;
  watch_changed_ = woken_ = true;
  if (!somebody) resting_.request_stop();
  wake_.notify_one();
}

std::future<void> Stage::visit(std::function<void(const Session&)> see) {
  const std::lock_guard lock(mutex_);
  std::future<void> seen = visits_.emplace_back(std::move(see)).get_future();
  woken_ = true;
  wake_.notify_one();
  return seen;
}

StageTimes Stage::times() {
  const std::lock_guard lock(mutex_);
  return times_;
}

void Stage::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    Clock::time_point next;
    try {
      next = work();
    } catch (const std::exception& error) {
      is_moving_ = false;
      refuse(number_, error);
      next = Clock::now() + kUntilRetry;
    }
    std::unique_lock lock(mutex_);
    wake_.wait_until(lock, next, [&] { return woken_ || stop.stop_requested(); });
    woken_ = false;
  }
}

/// Does what is to be done. @return when to look again, if nothing wakes before
Stage::Clock::time_point Stage::work() {
  const Clock::time_point never = Clock::now() + std::chrono::hours(1);
  const bool is_watched = take_requests();
  receive_visits();
  if (!is_watched) return never;
  const auto is_stale = [this](const auto& line) { return is_due(*line); };
  if (is_moving_ && std::none_of(lines_.begin(), lines_.end(), is_stale)) {
    if (Clock::now() < stepped_ + kPace) return stepped_ + kPace;
    step();
  }
  if (show_panes()) return Clock::now();
  if (is_moving_ || std::any_of(lines_.begin(), lines_.end(), is_stale)) return never;  // a pane that is free wakes
  const Clock::time_point rests = changed_ + (setup_.has_device ? kUntilRestOnDevice : kUntilRest);
  if (Clock::now() < rests) return rests;
  rest();
  return never;
}

/// @return whether somebody looks
bool Stage::take_requests() {
  std::deque<Request> asked;
  bool begins = false, watched = false;
  {
    const std::lock_guard lock(mutex_);
    asked.swap(asked_);
    begins = std::exchange(watch_changed_, false);
    watched = watched_;
    resting_ = {};
  }
  if (begins && watched) {
    for (const auto& line : lines_) line->begin_anew();
    tell_state();
  }
  for (std::size_t n = 0; n < asked.size(); ++n) {
    if (asked[n].number != 0) number_ = asked[n].number;
    if (n + 1 == asked.size() || !supersedes(asked[n + 1], asked[n])) take(asked[n]);
  }
  return watched;
}

void Stage::receive_visits() {
  std::vector<std::packaged_task<void(const Session&)>> visits;
  {
    const std::lock_guard lock(mutex_);
    visits.swap(visits_);
  }
  if (!session_) return;  // those who wait are told that nothing comes
  for (auto& visit : visits) visit(*session_);
}

void Stage::take(const Request& request) {
  try {
    std::visit([this](const auto& what) { on(what); }, request.what);
    if (!lets_rest(request)) {
      changed_ = Clock::now();
      tell_state();
    }
  } catch (const Error& error) {
    refuse(request.number, error);
    all_stale(true, true);  // so that pictures say that they know of the request
    changed_ = Clock::now();
    tell_state();
  }
}

/// Tells why something could not be done.
void Stage::refuse(std::uint32_t number, const std::exception& error) {
  listener_.answer({.kind = Answer::Kind::problem, .number = number, .text = error.what()});
}

void Stage::step() {
  stepped_ = Clock::now();
  if (setup_.reel) return next_frame();
  // Without a device pictures take longer than steps, so there are as many steps as a smooth motion leaves time for.
  const Clock::duration settling =
      setup_.has_device ? kSettling : std::max<Clock::duration>(kSettling, kSmooth - pictures_took());
  change([&] {
    bool follows = false;  // whether the hand asked for something before this step
    do {
      follows = session_->is_behind();
      const Clock::time_point begun = Clock::now();
      const simulate::Convergence convergence = [this] {
        const Timer timer(*this, &StageTimes::steps);
        return session_->step();
      }();
      step_took_ = Clock::now() - begun;
      resting_steps_ = follows ? 0 : resting_steps_ + 1;
      is_moving_ = session_->plays() || (!convergence.reached && resting_steps_ < kMostRestingSteps);
    } while (is_moving_ && !follows && Clock::now() < stepped_ + settling);
  });
  tell_state();
}

/// Shows the next frame of the reel that is played.
void Stage::next_frame() {
  const Timer timer(*this, &StageTimes::steps);
  show_frame(frame_ + 1);
  is_moving_ = frame_ + 1 < setup_.reel->frames;
  step_took_ = Clock::now() - stepped_;
  tell_state();
}

/// Shows a frame of the reel. Where it cannot be made, the last one stays.
void Stage::show_frame(int frame) {
  scene_.keep_field(setup_.reel->field(frame));
  frame_ = frame;
  all_is_new();
}

/// Whether a pane is to be shown before the next step. Where not all can be shown smoothly, the volume, which takes
/// longer than all slices, is shown after every second step.
bool Stage::is_due(const PaneLine& line) const {
  const bool waits = &line == lines_[kSlices].get() && is_moving_ && frames() % 2 != 0 && !is_smooth();
  return line.is_stale() && !waits;
}

/// Whether a step and a picture of each pane took no longer than a smooth motion allows.
bool Stage::is_smooth() const { return step_took_ + pictures_took() <= kSmooth; }

/// What the last pictures of all panes took that were not exact.
Stage::Clock::duration Stage::pictures_took() const {
  return std::accumulate(took_.begin(), took_.end(), Clock::duration{});
}

/// Shows what is due and may be shown. @return whether there was something
bool Stage::show_panes() {
  bool any = false;
  for (std::size_t n = 0; n < lines_.size(); ++n) {
    if (!is_due(*lines_[n]) || !lines_[n]->is_free()) continue;
    show(*lines_[n], static_cast<Pane>(n), false, {});
    any = true;
  }
  return any;
}

void Stage::show(PaneLine& line, Pane pane, bool is_exact, const Control& control) {
  const Clock::time_point begun = Clock::now();
  const Timer timer(*this, pane == Pane::volume ? &StageTimes::volumes : &StageTimes::slices);
  Picture about;
  about.request = number_;
  about.is_exact = is_exact;
  if (pane == Pane::volume) {
    const bool is_small = !is_exact && !setup_.has_device;
    about.plane = plane(line, is_small ? kMostMovingPixels : kMostPixels);
    PaneImage image = scene_.volume(*about.plane, control);
    line.take(std::move(image), std::move(about));
  } else {
    const Slice slice = scene_.slice_near(plane_of(pane), cursor_mm_);
    about.voxel = slice.voxel;
    const bool moves = !is_exact && is_moving_;
    line.take(moves ? scene_.moving_slice(slice, look_) : scene_.slice(slice, look_), std::move(about));
  }
  if (!is_exact) took_[static_cast<std::size_t>(pane)] = Clock::now() - begun;
}

/// Makes exact pictures of what has come to rest. Requests end it.
void Stage::rest() {
  const Control control{.stop = [this] {
    const std::lock_guard lock(mutex_);
    if (!asked_.empty()) resting_.request_stop();
    return resting_.get_token();
  }()};
  try {
    for (std::size_t n = 0; n < kSlices; ++n)
      if (!lines_[n]->is_sharp() && lines_[n]->is_free()) show(*lines_[n], static_cast<Pane>(n), true, control);
    if (control.stop.stop_requested()) return;
    {
      const Timer timer(*this, &StageTimes::rests);
      scene_.make_exact(control);
    }
    PaneLine& volume = *lines_[kSlices];
    if (!volume.is_sharp() && volume.is_free()) show(volume, Pane::volume, true, control);
    if (!quality_) {
      const Quality quality = scene_.quality();
      if (quality.inverted + quality.degenerate > 0) fold_at_ = worst(control);
      quality_ = quality;
    }
    tell_state();
  } catch (const Cancelled&) {
  }
}

/// Does what may change the field. Where that fails the session may have gone back to an earlier state on the way.
void Stage::change(const std::function<void()>& how) {
  try {
    how();
  } catch (...) {
    is_moving_ = false;
    changed_field();
    throw;
  }
  changed_field();
}

/// The plane of the volume's picture. @param most  pixels on a side
ViewPlane Stage::plane(const PaneLine& line, int most) const {
  Camera camera = camera_;
  const double scale = std::min(1.0, static_cast<double>(most) / std::max(line.width(), line.height()));
  camera.width = std::max(1, static_cast<int>(std::lround(scale * line.width())));
  camera.height = std::max(1, static_cast<int>(std::lround(scale * line.height())));
  return view_plane(camera, scene_.grid());
}

/// The exact image of a pane.
PaneImage Stage::image(Pane pane) {
  if (pane != Pane::volume) return scene_.slice(scene_.slice_near(plane_of(pane), cursor_mm_), look_);
  return scene_.volume(plane(*lines_[kSlices], kMostPixels));
}

void Stage::all_stale(bool slices, bool volume) {
  for (std::size_t n = 0; n < lines_.size(); ++n)
    if (n < kSlices ? slices : volume) lines_[n]->make_stale();
}

/// The session. @throws InputError where there is none
Session& Stage::session() const {
  require(session_ != nullptr, "a field that was made before is shown; hands work without it");
  return *session_;
}

int Stage::frames() const { return setup_.reel ? frame_ : session_->frames(); }

/// Where the field is worst that is shown. @throws Cancelled
std::optional<glm::dvec3> Stage::worst(const Control& control) const {
  if (setup_.reel) return worst_place(std::get<VertexField>(scene_.kept_field()), {}, control);
  return worst_place(session_->player().field(), {}, control);
}

/// The session's field is another one.
void Stage::changed_field() {
  const simulate::PhasePlayer* const player = &session_->player();
  if (player->simulation() && !player->divides_cells()) {
    scene_.set_field(simulate::view(*player->simulation(), player->model(), Outside::background));
  } else {
    scene_.keep_field(player->field());
  }
  all_is_new();
}

/// Nothing is known any more of the field, and no picture shows it.
void Stage::all_is_new() {
  quality_.reset();
  fold_at_.reset();
  changed_ = Clock::now();
  all_stale(true, true);
}

void Stage::begin_session(simulate::Method method) {
  simulate::Scenario scenario = setup_.scenario;
  scenario.method = method;
  // The one before lives until the scene, which reads its field, has another.
  const std::unique_ptr<Session> before = std::exchange(
      session_,
      std::make_unique<Session>(std::move(scenario), *setup_.patient, setup_.make(method), setup_.most_snapshot_bytes));
  method_ = method;
  is_moving_ = false;
  changed_field();
}

}  // namespace tetwarp::viewer
