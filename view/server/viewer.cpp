// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "view/server/viewer.h"

#include <algorithm>
#include <future>
#include <utility>

#include "backend/devices.h"
#include "backend/factories.h"
#include "deform/errors.h"
#include "io/scenario_file.h"
#include "view/server/rules.h"

namespace tetwarp::viewer {

Viewer::Viewer(Setup setup) : setup_(std::move(setup)) {
  scene_ = std::make_unique<Scene>(Scene::Setup{.source = setup_.source,
                                                .labels = setup_.labels,
                                                .background = setup_.background,
                                                .padding = setup_.padding,
                                                .backend = setup_.backend,
                                                .device = setup_.device,
                                                .limits = setup_.limits});
  server_ = std::make_unique<Server>(Server::Setup{.port = setup_.port,
                                                   .greeting = message_of(about()),
                                                   .frames = setup_.frames,
                                                   .ask =
                                                       [this](Request request) {
                                                         const std::lock_guard lock(mutex_);
                                                         if (stage_) stage_->ask(std::move(request));
                                                       },
                                                   .watch =
                                                       [this](bool somebody) {
                                                         const std::lock_guard lock(mutex_);
                                                         is_watched_ = somebody;
                                                         if (stage_) stage_->watch(somebody);
                                                       }});
  auto stage = std::make_unique<Stage>(stage_setup(), listener());
  const std::lock_guard lock(mutex_);
  stage_ = std::move(stage);
  if (is_watched_) stage_->watch(true);  // a page may have come before
}

Viewer::~Viewer() { stop(); }

std::string Viewer::address() const {
  return "http://127.0.0.1:" + std::to_string(server_->port()) + "/#" + server_->token();
}

Viewer::Done Viewer::done(bool with_field, bool with_scenario) {
  Done done;
  std::future<void> seen;
  {
    const std::lock_guard lock(mutex_);
    if (!stage_) throw Error("the viewer has ended");
    seen = stage_->visit([&](const Session& session) {
      done.frames = session.frames();
      if (with_field) done.field = session.player().field();
      if (with_scenario && done.frames > 0) done.scenario = scenario_text(session.recorded());
    });
  }
  try {
    seen.get();
  } catch (const std::future_error&) {
    throw Error("the viewer has ended");
  }
  return done;
}

void Viewer::stop() {
  std::unique_ptr<Stage> stage;
  {
    const std::lock_guard lock(mutex_);
    stage = std::move(stage_);
    if (stage) times_ = stage->times();
  }
}

StageTimes Viewer::times() {
  const std::lock_guard lock(mutex_);
  return stage_ ? stage_->times() : times_;
}

About Viewer::about() const {
  return {.title = setup_.title,
          .grid = scene_->grid(),
          .backend = runs_on_device(setup_.backend) ? describe_device(setup_.device) : "CPU",
          .hounsfield = scene_->window().hounsfield,
          .styles = transfer_function_names(),
          .volume_suffixes = setup_.volume_kinds,
          .film_suffixes = setup_.film_kinds,
          .folder = setup_.folder,
          .labels = scene_->has_labels(),
          .frames = setup_.reel ? setup_.reel->frames : 0,
          .grows = setup_.reel && setup_.reel->grows,
          .pulls = setup_.reel && setup_.reel->pulls};
}

Stage::Setup Viewer::stage_setup() {
  Stage::Setup setup;
  setup.scenario = setup_.scenario;
  setup.patient = &setup_.patient;
  setup.reel = setup_.reel;
  setup.scene = scene_.get();
  setup.has_device = runs_on_device(setup_.backend);
  setup.make = [this](simulate::Method method) -> simulate::MakeSimulation {
    return [this, method](const simulate::Model& model) {
      return simulate::make_simulation(setup_.backend, method, model, setup_.device, setup_.limits);
    };
  };
  return setup;
}

Stage::Listener Viewer::listener() {
  return {.picture = [this](const Picture& picture) { server_->send_bytes(message_of(picture)); },
          .state = [this](const State& state) { server_->send_text(message_of(state), true); },
          .answer = [this](const Answer& answer) { server_->send_text(message_of(answer)); },
          .save = [this](SaveJob job) { save(std::move(job)); }};
}

/// @throws InputError for a name that is no plain one, and for kinds that were not offered
void Viewer::save(SaveJob job) {
  const auto is_offered = [](const std::vector<std::string>& kinds, const std::string& kind) {
    return kind.empty() || std::find(kinds.begin(), kinds.end(), kind) != kinds.end();
  };
  require_plain_name(job.wish.name);
  require(is_offered(setup_.volume_kinds, job.wish.volume), "no volume is written as that");
  require(is_offered(setup_.film_kinds, job.wish.film), "no film is written as that");
  const std::uint32_t number = job.number;
  server_->send_text(message_of_progress(number));
  setup_.save(std::move(job), [this, number](const Saved& saved) {
    if (saved.problem.empty()) {
      server_->send_text(message_of_saved(number, saved.files, saved.command));
    } else {
      server_->send_text(message_of(Answer{.kind = Answer::Kind::problem, .number = number, .text = saved.problem}));
    }
  });
}

}  // namespace tetwarp::viewer
