// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// What a stage does at each request.

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "deform/errors.h"
#include "io/scenario_file.h"
#include "view/session/stage.h"

namespace tetwarp::viewer {

using namespace request;

namespace {

constexpr const char* kPaneNames[] = {"axial", "coronal", "sagittal", "volume"};

}  // namespace

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
  const bool of_tetrahedra =
      over.layer == Layer::lattice || over.layer == Layer::jacobian || over.layer == Layer::folds;
  require(!of_tetrahedra || !setup_.reel || !setup_.reel->pulls,
          "a pull field has no tetrahedra: no lattice, Jacobian or folds");
  const bool of_labels = over.layer == Layer::labels || over.layer == Layer::contours;
  require(!of_labels || scene_.has_labels(), "there are no labels; --labels names them");
  look_.layer = over.layer;
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
  session();
  const glm::dvec3 at = seen(grip.at);
  session().grip(undeformed(at), grip.radius_mm);
}

void Stage::on(const Move& move) {
  session().move(move.by_mm);
  is_moving_ = true;
}

void Stage::on(const Release&) {
  session().release();
  is_moving_ = true;
}

void Stage::on(const Pin& pin) {
  session();
  const glm::dvec3 at = seen(pin.at);
  session().pin({simulate::Sphere{{undeformed(at)}, {pin.radius_mm}}});
  is_moving_ = true;
}

void Stage::on(const Unpin&) {
  session().unpin();
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
  swept.is_closed = cut.is_closed;
  const auto& cuts = session().recorded().cuts;
  std::string name;
  do {
    name = "cut " + std::to_string(++cuts_made_);
  } while (std::any_of(cuts.begin(), cuts.end(), [&](const simulate::CutPlan& one) { return one.name == name; }));
  session().cut({name, swept});
  is_moving_ = true;
}

void Stage::on(const Suture& suture) {
  session().suture(suture.name);
  is_moving_ = true;
}

void Stage::on(const Reopen& reopen) {
  session().reopen(reopen.name);
  is_moving_ = true;
}

void Stage::on(const Ball& ball) {
  session();
  const std::optional<glm::dvec3> at = place(ball.at);
  require(at.has_value(), "nothing is seen there");
  const bool is_new = !session().ball_now();
  session().ball(*at, ball.radius_mm);
  if (is_new) listener_.answer({.kind = Answer::Kind::held, .number = number_, .at_mm = *at});
  is_moving_ = true;
}

void Stage::on(const LiftBall&) {
  session().lift_ball();
  is_moving_ = true;
}

void Stage::on(const Play&) {
  if (setup_.reel) {
    if (!is_moving_ && frame_ + 1 == setup_.reel->frames) on(Frame{0});
    is_moving_ = !is_moving_ && frame_ + 1 < setup_.reel->frames;
    return;
  }
  require(!setup_.scenario.phases.empty(), "there is no scenario whose phases could be played");
  session().play(setup_.scenario.phases);
  is_moving_ = true;
}

void Stage::on(const Frame& frame) {
  require(setup_.reel.has_value(), "there is no field whose frames could be shown");
  require(frame.number >= 0 && frame.number < setup_.reel->frames,
          "there are " + std::to_string(setup_.reel->frames) + " frames, the first is 0");
  is_moving_ = false;
  if (frame.number != frame_) show_frame(frame.number);
}

void Stage::on(const Undo&) {
  is_moving_ = false;
  if (session().can_undo()) change([this] { session_->undo(); });
}

void Stage::on(const Redo&) {
  is_moving_ = false;
  if (session().can_redo()) change([this] { session_->redo(); });
}

void Stage::on(const Reset&) {
  is_moving_ = false;
  if (!session().can_undo()) return;
  change([this] {
    while (session_->undo()) {
    }
  });
}

void Stage::on(const Use& use) {
  session();
  if (use.method != method_) begin_session(use.method);
}

void Stage::on(const request::Tissues& wish) {
  session();
  std::vector<simulate::TissueClass>& tissues = setup_.scenario.tissues;
  require(wish.tissues.size() == tissues.size(), "there are " + std::to_string(tissues.size()) + " tissues");
  for (std::size_t n = 0; n < tissues.size(); ++n)
    require(wish.tissues[n].name == tissues[n].tissue.name, "the tissues have other names, or another order");
  const std::vector<simulate::TissueClass> before = tissues;
  for (std::size_t n = 0; n < tissues.size(); ++n) tissues[n].tissue = wish.tissues[n];
  try {
    begin_session(method_);
  } catch (...) {
    tissues = before;
    throw;
  }
}

void Stage::on(const request::Save& save) {
  SaveJob job;
  job.wish = save;
  job.number = number_;
  job.is_by_hand = session_ != nullptr;
  job.frame = frame_;
  job.camera = camera_;
  job.cursor_mm = cursor_mm_;
  job.look = look_;
  job.style = style_;
  if (session_) {
    require(session_->frames() > 0 || (save.volume.empty() && !save.field && save.film.empty() && save.pictures),
            "nothing has been done yet that could be saved");
    job.frames = session_->frames();
    if (job.frames > 0) job.scenario = scenario_text(session_->recorded());
    require(job.scenario.size() <= kMostScenarioBytes,
            "what was done is more than a scenario file may hold, 8 MiB; take something back");
    job.has_cuts = !session_->recorded().cuts.empty();
  } else {
    require(!setup_.reel->grows || save.volume.empty() || frame_ + 1 == setup_.reel->frames,
            "a volume is deformed by the whole field; show its last frame first");
  }
  if (save.pictures) {
    scene_.make_exact();
    for (std::size_t n = 0; n < lines_.size(); ++n)
      if (lines_[n]->is_seen()) job.pictures.emplace_back(kPaneNames[n], encode_png(image(static_cast<Pane>(n))));
    require(!job.pictures.empty(), "no pane is seen of which there could be a picture");
  }
  listener_.save(std::move(job));
}

}  // namespace tetwarp::viewer
