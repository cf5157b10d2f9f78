// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "view/session/stage.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "deform/errors.h"
#include "io/scenario_file.h"

namespace tetwarp::viewer {

using namespace request;

namespace {

using std::chrono::milliseconds;

constexpr milliseconds kPace(16);               ///< between two steps at least: a screen shows no more
constexpr milliseconds kUntilRest(80);          ///< without a request, before exact pictures are made
constexpr std::chrono::seconds kUntilRetry(1);  ///< after something failed that nobody asked for
/// Steps after which tissue that still moves a little is let be, if the hand is still.
constexpr int kMostRestingSteps = 60;
constexpr int kMostMovingPixels = 256;  ///< on a side of the volume's picture while it moves, without a device
constexpr int kMostPixels = 1600;       ///< on a side of the volume's picture
constexpr std::size_t kSlices = 3;

AnatomicalPlane plane_of(Pane pane) { return static_cast<AnatomicalPlane>(pane); }

/// Whether the second of two requests in a row makes the first one superfluous.
bool supersedes(const Request& later, const Request& earlier) {
  if (later.what.index() != earlier.what.index()) return false;
  return std::visit(
      [&](const auto& one) {
        using One = std::decay_t<decltype(one)>;
        if constexpr (std::is_same_v<One, Ball>) return one.radius_mm == std::get<Ball>(earlier.what).radius_mm;
        return std::is_same_v<One, Look> || std::is_same_v<One, Turn> || std::is_same_v<One, Levels> ||
               std::is_same_v<One, Compare> || std::is_same_v<One, Move> || std::is_same_v<One, Probe>;
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
  begin_session(method_);
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
      fail(number_, error);
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
  if (Clock::now() < changed_ + kUntilRest) return changed_ + kUntilRest;
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
    fail(request.number, error);
  }
}

/// Tells why something could not be done. The session may have gone back to an earlier state on the way.
void Stage::fail(std::uint32_t number, const std::exception& error) {
  is_moving_ = false;
  changed_field();
  listener_.answer({.kind = Answer::Kind::problem, .number = number, .text = error.what()});
}

void Stage::step() {
  stepped_ = Clock::now();
  const bool is_behind = session_->is_behind();
  const simulate::Convergence convergence = [this] {
    const Timer timer(*this, &StageTimes::steps);
    return session_->step();
  }();
  resting_steps_ = is_behind ? 0 : resting_steps_ + 1;
  is_moving_ = session_->plays() || (!convergence.reached && resting_steps_ < kMostRestingSteps);
  changed_field();
  tell_state();
}

/// Whether a pane is to be shown before the next step. Without a device the volume, which takes longer than all slices,
/// is shown after every second step.
bool Stage::is_due(const PaneLine& line) const {
  const bool waits = &line == lines_[kSlices].get() && is_moving_ && !setup_.has_device && session_->frames() % 2 != 0;
  return line.is_stale() && !waits;
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
    if (quality_) return;
    quality_ = scene_.quality();
    fold_at_.reset();
    if (quality_->inverted + quality_->degenerate > 0) fold_at_ = worst_place(session_->player().field());
    tell_state();
  } catch (const Cancelled&) {
  }
}

/// The plane of the volume's picture. @param most  pixels on a side
ViewPlane Stage::plane(const PaneLine& line, int most) const {
  Camera camera = camera_;
  const double scale = std::min(1.0, static_cast<double>(most) / std::max(line.width(), line.height()));
  camera.width = std::max(1, static_cast<int>(std::lround(scale * line.width())));
  camera.height = std::max(1, static_cast<int>(std::lround(scale * line.height())));
  return view_plane(camera, scene_.grid());
}

void Stage::all_stale(bool slices, bool volume) {
  for (std::size_t n = 0; n < lines_.size(); ++n)
    if (n < kSlices ? slices : volume) lines_[n]->make_stale();
}

/// The field is another one.
void Stage::changed_field() {
  const simulate::PhasePlayer& player = session_->player();
  if (player.simulation() && !player.divides_cells()) {
    scene_.set_field(simulate::view(*player.simulation(), player.model(), Outside::background));
  } else {
    scene_.set_field(player.field());
  }
  quality_.reset();
  fold_at_.reset();
  changed_ = Clock::now();
  all_stale(true, true);
}

void Stage::tell_state() {
  State state;
  state.request = number_;
  state.frames = session_->frames();
  state.is_moving = is_moving_;
  state.can_undo = session_->can_undo();
  state.can_redo = session_->can_redo();
  state.holds = session_->holds();
  state.pins = session_->pins();
  state.ball = session_->ball_now();
  for (const simulate::CutPlan& cut : session_->recorded().cuts)
    state.cuts.emplace_back(cut.name, session_->is_open(cut.name));
  state.can_play = !setup_.scenario.phases.empty();
  state.plays = session_->plays();
  state.method = method_;
  state.quality = quality_;
  state.fold_at = fold_at_;
  state.cursor_mm = cursor_mm_;
  state.look = look_;
  state.style = style_;
  listener_.state(std::move(state));
}

void Stage::begin_session(simulate::Method method) {
  simulate::Scenario scenario = setup_.scenario;
  scenario.method = method;
  auto session =
      std::make_unique<Session>(std::move(scenario), *setup_.patient, setup_.make(method), setup_.most_snapshot_bytes);
  scene_.set_field(session->player().field());  // before the other one goes, whose field the scene reads
  session_ = std::move(session);
  method_ = method;
  is_moving_ = false;
  changed_field();
}

/// What is pointed to, in the deformed picture; empty where nothing is seen.
std::optional<glm::dvec3> Stage::place(const Pointed& pointed) {
  if (const auto* const at = std::get_if<glm::dvec3>(&pointed)) return *at;
  const glm::dvec2 at = std::get<glm::dvec2>(pointed);
  const PaneLine& line = *lines_[kSlices];
  require(line.is_seen(), "the volume's picture is not shown");
  const ViewPlane picture = plane(line, kMostPixels);
  const auto pixel = [](double share, int count) { return std::clamp(static_cast<int>(share * count), 0, count - 1); };
  return scene_.pick(picture, pixel(at.x, picture.width), pixel(at.y, picture.height));
}

/// The place that is pointed to. @throws InputError where nothing is seen
glm::dvec3 Stage::seen(const Pointed& pointed) {
  const std::optional<glm::dvec3> at = place(pointed);
  require(at.has_value(), "nothing is seen there");
  listener_.answer({.kind = Answer::Kind::held, .number = number_, .at_mm = *at});
  return *at;
}

/// Where the tissue at a place was before it was deformed. @throws InputError where there is none
glm::dvec3 Stage::undeformed(const glm::dvec3& at_mm) {
  const std::optional<glm::dvec3> from = scene_.undeformed(at_mm);
  require(from.has_value(), "there is no tissue at this place");
  return *from;
}

void Stage::on(const Size& size) { lines_[static_cast<std::size_t>(size.pane)]->set_size(size.width, size.height); }

void Stage::on(const Look& look) {
  const glm::dvec3 before = cursor_mm_;
  cursor_mm_ = look.at_mm;
  for (std::size_t n = 0; n < kSlices; ++n) {
    const AnatomicalPlane plane = plane_of(static_cast<Pane>(n));
    if (scene_.slice_near(plane, before).voxel != scene_.slice_near(plane, cursor_mm_).voxel) lines_[n]->make_stale();
  }
}

void Stage::on(const Turn& turn) {
  Camera camera = camera_;
  camera.angle_deg = turn.angle_deg;
  camera.elevation_deg = turn.elevation_deg;
  camera.zoom = turn.zoom;
  camera.target = turn.target_mm;
  view_plane(camera, scene_.grid());  // throws
  camera_ = camera;
  all_stale(false, true);
}

void Stage::on(const Levels& levels) {
  require(levels.width > 0, "the width of a window is above 0");
  look_.window.width = levels.width;
  look_.window.level = levels.level;
  all_stale(true, false);
}

void Stage::on(const Style& style) {
  RenderStyle chosen;
  chosen.transfer = transfer_function(style.name);
  if (chosen.transfer.projection == Projection::maximum && !look_.window.hounsfield) {
    chosen.transfer.points = {{look_.window.level - 0.5 * look_.window.width, glm::dvec3(0), 0},
                              {look_.window.level + 0.5 * look_.window.width, glm::dvec3(1), 0}};
  }
  scene_.set_style(chosen);
  style_ = style.name;
  all_stale(false, true);
}

void Stage::on(const Compare& compare) {
  look_.compared = compare.compared;
  look_.swipe = std::clamp(compare.swipe, 0.0, 1.0);
  all_stale(true, false);
}

void Stage::on(const LayOver& over) {
  look_.overlay = over.kind;
  all_stale(true, false);
}

void Stage::on(const Probe& probe) {
  const std::optional<Scene::Values> values = scene_.values_at(probe.at_mm);
  Answer answer{.kind = values ? Answer::Kind::value : Answer::Kind::nothing, .number = number_, .at_mm = probe.at_mm};
  if (values) answer.after = values->after, answer.before = values->before;
  listener_.answer(std::move(answer));
}

void Stage::on(const Shown& shown) { lines_[static_cast<std::size_t>(shown.pane)]->shown(); }

void Stage::on(const Grip& grip) {
  const glm::dvec3 at = seen(grip.at);
  session_->grip(undeformed(at), grip.radius_mm);
}

void Stage::on(const Move& move) {
  session_->move(move.by_mm);
  is_moving_ = true;
}

void Stage::on(const Release&) {
  session_->release();
  is_moving_ = true;
}

void Stage::on(const Pin& pin) {
  const glm::dvec3 at = seen(pin.at);
  session_->pin({simulate::Sphere{{undeformed(at)}, {pin.radius_mm}}});
  is_moving_ = true;
}

void Stage::on(const Unpin&) {
  session_->unpin();
  is_moving_ = true;
}

void Stage::on(const request::Cut& cut) {
  require(cut.path.size() >= 2, "a cut follows a line of at least two places");
  const double length = glm::length(cut.along);
  require(length > 0, "a cut needs a direction");
  const glm::dvec3 along = cut.along / length, back = along * (cut.is_centred ? 0.5 * cut.depth_mm : 0);
  simulate::SweptCutPlan swept;
  for (const Pointed& pointed : cut.path) {
    const std::optional<glm::dvec3> at = place(pointed);
    if (!at) continue;  // a line may go beyond what is seen
    const glm::dvec3 from = *at - back;
    const std::optional<glm::dvec3> rest = scene_.undeformed(*at);
    if (rest) swept.path.push_back({from + (*rest - *at)});
  }
  require(swept.path.size() >= 2, "the line meets no tissue");
  swept.along = along;
  swept.depth = {cut.depth_mm};
  session_->cut({"cut " + std::to_string(++cuts_made_), swept});
  is_moving_ = true;
}

void Stage::on(const Suture& suture) {
  session_->suture(suture.name);
  is_moving_ = true;
}

void Stage::on(const Reopen& reopen) {
  session_->reopen(reopen.name);
  is_moving_ = true;
}

void Stage::on(const Ball& ball) {
  const std::optional<glm::dvec3> at = place(ball.at);
  require(at.has_value(), "nothing is seen there");
  const bool is_new = !session_->ball_now();
  session_->ball(*at, ball.radius_mm);
  if (is_new) listener_.answer({.kind = Answer::Kind::held, .number = number_, .at_mm = *at});
  is_moving_ = true;
}

void Stage::on(const LiftBall&) {
  session_->lift_ball();
  is_moving_ = true;
}

void Stage::on(const Play&) {
  require(!setup_.scenario.phases.empty(), "there is no scenario whose phases could be played");
  session_->play(setup_.scenario.phases);
  is_moving_ = true;
}

void Stage::on(const Undo&) {
  if (session_->undo()) changed_field();
  is_moving_ = false;
}

void Stage::on(const Redo&) {
  if (session_->redo()) changed_field();
  is_moving_ = false;
}

void Stage::on(const Reset&) {
  bool any = false;
  while (session_->undo()) any = true;
  if (any) changed_field();
  is_moving_ = false;
}

void Stage::on(const Use& use) {
  if (use.method != method_) begin_session(use.method);
}

void Stage::on(const request::Save& save) {
  require(session_->frames() > 0, "nothing has been done yet that could be saved");
  listener_.save(save, number_, scenario_text(session_->recorded()));
}

}  // namespace tetwarp::viewer
