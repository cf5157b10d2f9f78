// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <cstdio>
#include <mutex>

#include "apps/cli/input.h"
#include "apps/cli/subcommands.h"
#include "apps/view/browser.h"
#include "apps/view/view_save.h"
#include "backend/devices.h"
#include "backend/factories.h"
#include "deform/phantom.h"
#include "io/scenario_file.h"
#include "view/server/messages.h"
#include "view/server/rules.h"
#include "view/server/server.h"
#include "view/session/default_scenario.h"
#include "view/session/stage.h"

namespace tetwarp::apps {

namespace {

using viewer::Answer;
using viewer::Picture;
using viewer::Scene;
using viewer::Server;
using viewer::State;

/// With --verbose: what was done how often, and how long one took.
void tell_times(const CommonOptions& common, const viewer::StageTimes& times) {
  if (!common.verbose) return;
  const auto tell = [&](const char* what, const viewer::Spent& spent) {
    if (spent.count > 0)
      say(common, std::string(what) + ": " + std::to_string(spent.count) + ", " +
                      number_text(1e3 * spent.seconds / spent.count) + " ms each");
  };
  tell("steps", times.steps);
  tell("slices", times.slices);
  tell("pictures of the volume", times.volumes);
  tell("exact volumes", times.rests);
}

/// One run of the command.
class Viewing {
 public:
  explicit Viewing(const ViewOptions& options);
  int run();

 private:
  void read();
  void serve();
  void told(Answer answer) { server_->send_text(message_of(answer)); }
  void save(const viewer::request::Save& wish, std::uint32_t number, std::string scenario);
  viewer::About about() const;

  const ViewOptions& options_;
  BackendKind backend_;
  simulate::Scenario scenario_;
  InputVolume input_;
  simulate::Patient patient_;
  // Made in this order, and ended in the opposite one.
  std::unique_ptr<Saving> saving_;
  std::unique_ptr<Scene> scene_;
  std::unique_ptr<Server> server_;
  std::unique_ptr<viewer::Stage> stage_;
  std::mutex mutex_;  ///< of `stage_` and `is_watched_`, which the server's thread uses
  bool is_watched_ = false;
};

Viewing::Viewing(const ViewOptions& options) : options_(options), backend_(chosen(options.backend)) {
  if (!options.scenario.empty()) scenario_ = read_scenario(options.scenario);
  if (!options.demo && options.input.path.empty())
    throw UsageError("tetwarp view needs INPUT, a volume to look at, or --demo; see tetwarp view --help");
}

void Viewing::read() {
  AnyVolume labels;
  Stage stage(options_.common, "read");
  if (options_.demo) {
    input_.volume = AnyVolume(make_phantom({kDemoSize[0], kDemoSize[1], kDemoSize[2]},
                                           {kDemoSpacing[0], kDemoSpacing[1], kDemoSpacing[2]}, 1));
    input_.background = -1024;
  } else {
    const InputHeader header = open_input(options_.input, options_.common);
    if (header.series)
      for (const std::string& warning : header.series->warnings) say(options_.common, "tetwarp: warning: " + warning);
    for (const std::string& note : header.notes) say(options_.common, "tetwarp: note: " + note);
    input_ = read_input(options_.input, header, options_.common, stage.control());
  }
  if (!options_.labels.empty()) {
    const InputOptions from = volume_named(options_.labels, options_.common.nifti_frame);
    labels = read_input(from, open_input(from, options_.common), options_.common, stage.control()).volume;
  }
  if (options_.scenario.empty())
    scenario_ = viewer::default_scenario(input_.volume.geometry(), runs_on_device(backend_));
  if (options_.cell_size) scenario_.cell_size = *options_.cell_size;
  const ConstVolumeView labelled = std::as_const(labels).view();
  patient_ = simulate::examine(std::as_const(input_.volume).view(), options_.labels.empty() ? nullptr : &labelled,
                               scenario_.cell_size, scenario_.body_above_hu, stage.control());
}

viewer::About Viewing::about() const {
  return {.title = options_.demo ? "Phantom" : options_.input.path.filename().string(),
          .grid = scene_->grid(),
          .backend = runs_on_device(backend_) ? describe_device(options_.device) : "CPU",
          .hounsfield = scene_->window().hounsfield,
          .styles = transfer_function_names(),
          .volume_suffixes = saved_volume_kinds(input_.is_dicom()),
          .folder = options_.output.string()};
}

void Viewing::save(const viewer::request::Save& wish, std::uint32_t number, std::string scenario) {
  server_->send_text(viewer::message_of_progress(number));
  saving_->begin({wish.name, wish.volume, std::move(scenario)}, [this, number](Saving::Result result) {
    if (result.problem.empty()) {
      server_->send_text(viewer::message_of_saved(number, result.files, result.command));
    } else {
      told({.kind = Answer::Kind::problem, .number = number, .text = result.problem});
    }
  });
}

void Viewing::serve() {
  const std::string token = viewer::make_token();
  server_ = std::make_unique<Server>(Server::Setup{.port = static_cast<std::uint16_t>(options_.port),
                                                   .token = token,
                                                   .greeting = message_of(about()),
                                                   .frames = false,
                                                   .ask =
                                                       [this](viewer::Request request) {
                                                         const std::lock_guard lock(mutex_);
                                                         if (stage_) stage_->ask(std::move(request));
                                                       },
                                                   .watch =
                                                       [this](bool somebody) {
                                                         const std::lock_guard lock(mutex_);
                                                         is_watched_ = somebody;
                                                         if (stage_) stage_->watch(somebody);
                                                       }});
  viewer::Stage::Setup setup;
  setup.scenario = scenario_;
  setup.patient = &patient_;
  setup.scene = scene_.get();
  setup.has_device = runs_on_device(backend_);
  setup.make = [this](simulate::Method method) -> simulate::MakeSimulation {
    return [this, method](const simulate::Model& model) {
      return simulate::make_simulation(backend_, method, model, options_.device, {.threads = options_.common.threads});
    };
  };
  auto stage = std::make_unique<viewer::Stage>(
      std::move(setup),
      viewer::Stage::Listener{.picture = [this](const Picture& picture) { server_->send_bytes(message_of(picture)); },
                              .state = [this](const State& state) { server_->send_text(message_of(state), true); },
                              .answer = [this](const Answer& answer) { told(answer); },
                              .save = [this](const auto& wish, std::uint32_t number,
                                             std::string scenario) { save(wish, number, std::move(scenario)); }});
  {
    const std::lock_guard lock(mutex_);
    stage_ = std::move(stage);
    if (is_watched_) stage_->watch(true);  // a page may have come before
  }
  const std::string address = "http://127.0.0.1:" + std::to_string(server_->port()) + "/#" + token;
  std::printf("%s\n", address.c_str());
  std::fflush(stdout);
  std::optional<Browser> browser;
  if (!options_.no_open) browser.emplace(address);
  if (const std::string command = forwarding_command(server_->port()); !command.empty())
    say(options_.common, "from your own machine: " + command + ", then open the address there");
  say(options_.common, "Ctrl-C ends it");
}

int Viewing::run() {
  read();
  {
    Stage stage(options_.common, "prepare");
    scene_ = std::make_unique<Scene>(Scene::Setup{.source = std::as_const(input_.volume).view(),
                                                  .background = input_.background,
                                                  .padding = input_.dicom ? input_.dicom->padding : std::nullopt,
                                                  .backend = backend_,
                                                  .device = options_.device,
                                                  .limits = {.threads = options_.common.threads}});
  }
  saving_ = std::make_unique<Saving>(options_);
  serve();
  std::mutex mutex;
  std::condition_variable_any ended;
  std::unique_lock lock(mutex);
  ended.wait(lock, interrupt_token(), [] { return false; });
  saving_.reset();  // what is being written is finished, or has been cancelled
  std::unique_ptr<viewer::Stage> stage;
  {
    const std::lock_guard of_stage(mutex_);
    stage = std::move(stage_);
  }
  tell_times(options_.common, stage->times());
  stage.reset();
  server_.reset();
  return 0;
}

}  // namespace

int run_view(const ViewOptions& options) { return Viewing(options).run(); }

}  // namespace tetwarp::apps
