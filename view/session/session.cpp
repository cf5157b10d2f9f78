// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "view/session/session.h"

#include <algorithm>

#include "deform/errors.h"
#include "deform/simulate/cuts/cut_surface.h"

namespace tetwarp::viewer {

using namespace simulate;

namespace {

constexpr int kMostFrames = 10000;  // of a phase in a file

// What a file may say (docs/scenario.schema.json), so that all that is recorded can be read.
constexpr double kFarthestMm = 1e6, kLargestMm = 1e5, kMostShiftMm = 1e4;
constexpr std::size_t kMostEntries = 1000, kLongestName = 200;

void require_place(const glm::dvec3& mm, double most, const char* what) {
  for (int axis = 0; axis < 3; ++axis)
    require(mm[axis] >= -most && mm[axis] <= most, std::string(what) + " lies beyond all places, or is none");
}
void require_radius(double mm) {
  require(mm > 0 && mm <= kLargestMm, "a radius of " + std::to_string(mm) + " mm; above 0 to 100000 is expected");
}

/// A direction as it is read from a file: another length may give other last bits.
void scale(glm::dvec3& direction) {
  require_place(direction, kFarthestMm, "a direction");
  require(direction != glm::dvec3(0), "a direction has no length");
  direction = scaled_direction(direction);
}

/// All directions of a zone or cut.
struct ScaleDirections {
  template <class Other>
  void operator()(Other&) const {}
  void operator()(HalfSpace& half) const { scale(half.normal); }
  void operator()(AllOf& all) const { each(all.parts); }
  void operator()(AnyOf& any) const { each(any.parts); }
  void operator()(Not& other) const { each(other.part); }
  void operator()(PlaneCutPlan& plane) const { scale(plane.normal); }
  void operator()(DiscCutPlan& disc) const { scale(disc.normal); }
  void operator()(SweptCutPlan& swept) const { scale(swept.along); }
  void each(std::vector<Zone>& zones) const {
    for (Zone& zone : zones) std::visit(*this, zone.shape);
  }
};

Scenario without_phases(Scenario scenario) {
  scenario.phases.clear();
  scenario.deadband_mm = 0;
  for (HeldZone& held : scenario.hold) std::visit(ScaleDirections{}, held.zone.shape);
  for (CutPlan& cut : scenario.cuts) std::visit(ScaleDirections{}, cut.shape);
  return scenario;
}

bool has(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace

Session::Session(Scenario scenario, const Patient& patient, MakeSimulation make, std::size_t most_snapshot_bytes)
    : scenario_(without_phases(std::move(scenario))),
      patient_(patient),
      player_(scenario_, patient, std::move(make)),
      most_snapshot_bytes_(most_snapshot_bytes) {}

/// The phase that begins with the next step, of one frame.
Phase Session::phase_of(const Hand& hand) const {
  Phase phase;
  if (hand.handle) phase.moves = {{*hand.handle, Drag{{hand.by_mm - hand.done_mm}}, "the grip"}};
  if (hand.ball_radius_mm) phase.push = Push{*hand.ball_radius_mm, {hand.ball_mm}};
  phase.pins = hand.pins;
  phase.closed_cuts = hand.closed_cuts;
  return phase;
}

/// @throws InputError while phases are being played, which are recorded as a whole
void Session::require_hand() const {
  require(to_play_.empty(), "a scenario is being played; wait for its end, or take it back");
}

/// Begins an action. @param checks  whether the hand might ask for what cannot be
/// @throws InputError, and then nothing has changed
void Session::act(Hand hand, bool checks) {
  require_hand();
  if (checks) PhaseLoads(scenario_, phase_of(hand), patient_);
  mark();
  undone_.clear();
  hand_ = std::move(hand);
}

/// Marks the place to which `undo` goes back.
void Session::mark() {
  marks_.push_back({scenario_.phases.size(), scenario_.cuts.size(), hand_, Snapshot(player_.state())});
  snapshot_bytes_ += marks_.back().state->bytes();
  thin_out();
  begins_ = true;
}

void Session::grip(const glm::dvec3& at_mm, double radius_mm) {
  require_place(at_mm, kFarthestMm, "the grip");
  require_radius(radius_mm);
  Hand hand = hand_;
  hand.handle = Handle{{at_mm}, {radius_mm}};
  hand.by_mm = hand.done_mm = glm::dvec3(0);
  act(std::move(hand), true);
}

void Session::move(const glm::dvec3& by_mm) {
  require_hand();
  require(hand_.handle.has_value(), "the hand holds nothing that it could move");
  require_place(by_mm, kMostShiftMm / 2, "the hand");  // a drag may go from one end to the other
  hand_.by_mm = by_mm;
}

void Session::release() {
  if (!hand_.handle) return;
  Hand hand = hand_;
  hand.handle.reset();
  act(std::move(hand), false);
}

void Session::pin(const Zone& zone) {
  require(hand_.pins.size() < kMostEntries, "more than 1000 pins; free some first");
  Hand hand = hand_;
  hand.pins.push_back({zone, "pin[" + std::to_string(hand.pins.size()) + "]"});
  std::visit(ScaleDirections{}, hand.pins.back().zone.shape);
  act(std::move(hand), true);
}

void Session::unpin() {
  if (hand_.pins.empty()) return;
  Hand hand = hand_;
  hand.pins.clear();
  act(std::move(hand), false);
}

void Session::cut(CutPlan plan) {
  require(!plan.name.empty() && plan.name.size() <= kLongestName, "a cut needs a name of at most 200 bytes");
  require(scenario_.cuts.size() < kMostEntries, "more than 1000 cuts");
  std::visit(ScaleDirections{}, plan.shape);
  for (const CutPlan& other : scenario_.cuts)
    require(other.name != plan.name, "\"" + plan.name + "\" is the name of another cut");
  Scenario alone;
  alone.cuts = {plan};
  for (const Cut& one : open_cuts(alone, Phase{}, patient_)) CutSurface{one};  // throws for a cut that is none
  act(hand_, false);
  add_cuts({plan});
}

/// In all that was recorded before they were made, cuts are closed.
void Session::add_cuts(const std::vector<CutPlan>& plans) {
  for (const CutPlan& plan : plans) {
    scenario_.cuts.push_back(plan);
    for (Phase& phase : scenario_.phases) phase.closed_cuts.push_back(plan.name);
  }
}

void Session::suture(const std::string& name) {
  find_cut(name);
  if (has(hand_.closed_cuts, name)) return;
  Hand hand = hand_;
  hand.closed_cuts.push_back(name);
  act(std::move(hand), false);
}

void Session::reopen(const std::string& name) {
  find_cut(name);
  if (!has(hand_.closed_cuts, name)) return;
  Hand hand = hand_;
  std::erase(hand.closed_cuts, name);
  act(std::move(hand), false);
}

void Session::find_cut(const std::string& name) const {
  for (const CutPlan& cut : scenario_.cuts)
    if (cut.name == name) return;
  throw InputError("no cut has the name \"" + name + "\"");
}

void Session::ball(const glm::dvec3& at_mm, double radius_mm) {
  require_hand();
  require_place(at_mm, kFarthestMm, "the ball");
  require_radius(radius_mm);
  if (hand_.ball_radius_mm == radius_mm) {
    hand_.ball_mm = at_mm;
    return;
  }
  Hand hand = hand_;
  hand.ball_radius_mm = radius_mm;
  hand.ball_mm = at_mm;
  act(std::move(hand), true);
}

void Session::lift_ball() {
  if (!hand_.ball_radius_mm) return;
  Hand hand = hand_;
  hand.ball_radius_mm.reset();
  act(std::move(hand), false);
}

void Session::play(std::vector<Phase> phases) {
  for (Phase& phase : phases) {
    for (const CutPlan& cut : scenario_.cuts)  // those that the hand made are not known to the scenario
      if (!is_open(cut.name) && !has(phase.closed_cuts, cut.name)) phase.closed_cuts.push_back(cut.name);
    PhaseLoads(scenario_, phase, patient_);
  }
  Hand hand = hand_;
  hand.handle.reset();
  act(std::move(hand), false);
  to_play_.assign(phases.begin(), phases.end());
}

bool Session::is_behind() const {
  const bool ball_moved = hand_.ball_radius_mm && !scenario_.phases.empty() && scenario_.phases.back().push &&
                          scenario_.phases.back().push->at_mm.back() != hand_.ball_mm;
  return plays() || (begins_ && can_undo()) || hand_.by_mm != hand_.done_mm || ball_moved;
}

std::optional<glm::dvec4> Session::ball_now() const {
  if (!hand_.ball_radius_mm) return std::nullopt;
  return glm::dvec4(hand_.ball_mm, *hand_.ball_radius_mm);
}

bool Session::is_open(const std::string& cut) const { return !has(hand_.closed_cuts, cut); }

Convergence Session::step(const Control& control) {
  try {
    if (plays()) return played_frame(control);
    begins_ = begins_ || scenario_.phases.back().frames == kMostFrames;
    return begins_ ? first_frame(control) : further_frame(control);
  } catch (...) {
    to_play_.clear();
    go_to(marks_.size(), scenario_.phases.size());
    throw;
  }
}

/// The next frame of the phases that are played. A phase is recorded when it has ended.
Convergence Session::played_frame(const Control& control) {
  Phase& phase = to_play_.front();
  if (begins_) player_.begin(phase);
  begins_ = false;
  Convergence convergence = player_.next(control);
  if (player_.frames_done() < phase.frames) {
    convergence.reached = false;  // there is more to come
    return convergence;
  }
  scenario_.phases.push_back(std::move(phase));
  to_play_.pop_front();
  begins_ = true;
  undone_.clear();
  convergence.reached = convergence.reached && to_play_.empty();
  return convergence;
}

Convergence Session::first_frame(const Control& control) {
  const Phase phase = phase_of(hand_);
  player_.begin(phase);
  const Convergence convergence = player_.next(control);
  scenario_.phases.push_back(phase);
  phase_from_mm_ = hand_.done_mm;
  hand_.done_mm = hand_.by_mm;
  begins_ = false;
  undone_.clear();
  return convergence;
}

Convergence Session::further_frame(const Control& control) {
  std::vector<glm::dvec3> drags;
  if (hand_.handle) drags.push_back(hand_.by_mm - phase_from_mm_);
  std::optional<glm::dvec3> ball;
  if (hand_.ball_radius_mm) ball = hand_.ball_mm;
  player_.extend(drags, ball);
  const Convergence convergence = player_.next(control);
  Phase& phase = scenario_.phases.back();
  if (hand_.handle) std::get<Drag>(phase.moves[0].how).by_mm.push_back(drags[0]);
  if (ball) phase.push->at_mm.push_back(*ball);
  ++phase.frames;
  hand_.done_mm = hand_.by_mm;
  undone_.clear();
  return convergence;
}

/// Plays phases that were played before.
void Session::replay(std::size_t begin, std::size_t end) {
  for (std::size_t n = begin; n < end; ++n) {
    player_.begin(scenario_.phases[n]);
    for (int frame = 0; frame < scenario_.phases[n].frames; ++frame) player_.next();
  }
}

/// Brings the tissue to where it was after so many phases. @param marks  those before that place
void Session::go_to(std::size_t marks, std::size_t phases) {
  std::size_t from = marks;
  while (from > 0 && (!marks_[from - 1].state || marks_[from - 1].phases > phases)) --from;
  const std::size_t begin = from > 0 ? marks_[from - 1].phases : 0;
  player_.set_state(from > 0 ? marks_[from - 1].state->state() : PhasePlayer::State{});
  replay(begin, phases);
  begins_ = true;
}

/// Forgets the cuts after the first few, which are closed in all that is recorded.
void Session::drop_cuts(std::size_t keep) {
  for (std::size_t n = keep; n < scenario_.cuts.size(); ++n)
    for (Phase& phase : scenario_.phases) std::erase(phase.closed_cuts, scenario_.cuts[n].name);
  scenario_.cuts.resize(keep);
}

void Session::drop_mark() {
  if (marks_.back().state) snapshot_bytes_ -= marks_.back().state->bytes();
  marks_.pop_back();
}

bool Session::undo() {
  if (marks_.empty()) return false;
  to_play_.clear();
  const Mark& mark = marks_.back();
  const auto first = static_cast<std::ptrdiff_t>(mark.phases), first_cut = static_cast<std::ptrdiff_t>(mark.cuts);
  std::vector<Phase>& phases = scenario_.phases;
  std::vector<CutPlan>& cuts = scenario_.cuts;
  Undone undone{{phases.begin() + first, phases.end()}, {cuts.begin() + first_cut, cuts.end()}, hand_};
  go_to(marks_.size(), mark.phases);
  phases.erase(phases.begin() + first, phases.end());
  drop_cuts(mark.cuts);
  hand_ = mark.hand;
  drop_mark();
  undone_.push_back(std::move(undone));
  return true;
}

bool Session::redo() {
  if (undone_.empty()) return false;
  const Undone undone = undone_.back();
  mark();
  const std::size_t begin = scenario_.phases.size(), cuts = scenario_.cuts.size();
  try {
    add_cuts(undone.cuts);
    scenario_.phases.insert(scenario_.phases.end(), undone.phases.begin(), undone.phases.end());
    replay(begin, scenario_.phases.size());
  } catch (...) {
    scenario_.phases.resize(begin);
    drop_cuts(cuts);
    go_to(marks_.size(), begin);
    drop_mark();
    throw;
  }
  hand_ = undone.hand;
  undone_.pop_back();
  return true;
}

/// Lets go of every other state, but the first and the last, while they need too much memory.
void Session::thin_out() {
  while (snapshot_bytes_ > most_snapshot_bytes_) {
    bool lets_go = false, any = false;
    for (std::size_t n = 1; n + 1 < marks_.size(); ++n) {
      if (!marks_[n].state) continue;
      lets_go = !lets_go;
      if (!lets_go) continue;
      snapshot_bytes_ -= marks_[n].state->bytes();
      marks_[n].state.reset();
      any = true;
    }
    if (!any) return;
  }
}

}  // namespace tetwarp::viewer
