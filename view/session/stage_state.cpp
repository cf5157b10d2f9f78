// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// What a page is told of a stage beside pictures.

#include "deform/points.h"
#include "view/session/stage.h"

namespace tetwarp::viewer {

/// Where what is pinned lies now. It does not move while it is pinned, so it is sought once. While phases are played
/// nothing is pinned by hand.
std::vector<glm::dvec4> Stage::pin_places() {
  if (session_->plays()) {
    pins_.clear();
    return {};
  }
  std::vector<glm::dvec4> pins;
  for (const simulate::HeldZone& pin : session_->pins())
    if (const auto* const ball = std::get_if<simulate::Sphere>(&pin.zone.shape))
      pins.emplace_back(ball->at.at, ball->radius.value);
  if (pins == pins_) return pins_now_;
  pins_ = pins_now_ = std::move(pins);
  if (pins_.empty()) return {};
  const VertexField now = session_->player().field();
  const PointMover mover(scene_.grid(), tetwarp::view(now));
  for (glm::dvec4& pin : pins_now_) {
    glm::dvec3 at(pin);
    mover.move(at);
    pin = glm::dvec4(at, pin.w);
  }
  return pins_now_;
}

void Stage::tell_state() {
  State state;
  state.request = number_;
  state.frames = frames();
  state.is_moving = is_moving_;
  if (session_) {
    state.can_undo = session_->can_undo();
    state.can_redo = session_->can_redo();
    state.holds = session_->holds();
    state.pins = pin_places();
    state.ball = session_->ball_now();
    for (const simulate::CutPlan& cut : session_->recorded().cuts)
      state.cuts.emplace_back(cut.name, session_->is_open(cut.name));
    for (const simulate::TissueClass& tissue : setup_.scenario.tissues) state.tissues.push_back(tissue.tissue);
    state.can_play = !setup_.scenario.phases.empty();
    state.plays = session_->plays();
    state.method = method_;
  } else {
    state.can_play = setup_.reel->frames > 1;
    state.plays = is_moving_;
    state.frame = frame_;
  }
  state.quality = quality_;
  state.fold_at = fold_at_;
  state.cursor_mm = cursor_mm_;
  state.look = look_;
  state.style = style_;
  for (std::size_t n = 0; n < lines_.size(); ++n)
    state.pictures[n] = lines_[n]->number() + (lines_[n]->is_sharp() ? 0 : 1);
  listener_.state(std::move(state));
}

}  // namespace tetwarp::viewer
