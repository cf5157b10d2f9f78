// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <cstdio>
#include <mutex>
#include <optional>

#include "apps/cli/input.h"
#include "apps/cli/subcommands.h"
#include "apps/view/view_save.h"
#include "backend/devices.h"
#include "deform/phantom.h"
#include "io/scenario_file.h"
#include "view/server/browser.h"
#include "view/server/viewer.h"
#include "view/session/default_scenario.h"

namespace tetwarp::apps {

namespace {

using viewer::Viewer;

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
  void prepare();
  void tell_where() const;

  const ViewOptions& options_;
  BackendKind backend_;
  simulate::Scenario scenario_;
  InputVolume input_;
  simulate::Patient patient_;
  std::unique_ptr<Saving> saving_;  ///< tells the viewer what became of a wish, so it ends before it
  std::unique_ptr<Viewer> viewer_;
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

void Viewing::prepare() {
  saving_ = std::make_unique<Saving>(options_);
  Viewer::Setup setup;
  setup.source = std::as_const(input_.volume).view();
  setup.background = input_.background;
  if (input_.dicom) setup.padding = input_.dicom->padding;
  setup.patient = std::move(patient_);
  setup.scenario = std::move(scenario_);
  setup.backend = backend_;
  setup.device = options_.device;
  setup.limits = {.threads = options_.common.threads};
  setup.title = options_.demo ? "Phantom" : options_.input.path.filename().string();
  setup.volume_kinds = saved_volume_kinds(input_.is_dicom());
  setup.folder = options_.output.string();
  setup.port = static_cast<std::uint16_t>(options_.port);
  setup.save = [this](Viewer::Wish wish, std::function<void(Viewer::Saved)> done) {
    saving_->begin({std::move(wish.name), std::move(wish.volume), std::move(wish.scenario)},
                   [done = std::move(done)](Saving::Result result) {
                     done({std::move(result.files), std::move(result.command), std::move(result.problem)});
                   });
  };
  const Stage stage(options_.common, "prepare");
  viewer_ = std::make_unique<Viewer>(std::move(setup));
}

void Viewing::tell_where() const {
  std::printf("%s\n", viewer_->address().c_str());
  std::fflush(stdout);
  if (viewer::came_by_ssh())
    say(options_.common,
        "from your own machine: " + viewer::forwarding_command(viewer_->port()) + ", then open the address there");
  say(options_.common, "Ctrl-C ends it");
}

int Viewing::run() {
  read();
  prepare();
  tell_where();
  std::optional<viewer::Browser> browser;
  if (!options_.no_open) browser.emplace(viewer_->address());
  std::mutex mutex;
  std::condition_variable_any ended;
  std::unique_lock lock(mutex);
  ended.wait(lock, interrupt_token(), [] { return false; });
  viewer_->stop();
  saving_.reset();  // what is being written is finished, or has been cancelled
  tell_times(options_.common, viewer_->times());
  viewer_.reset();
  return 0;
}

}  // namespace

int run_view(const ViewOptions& options) { return Viewing(options).run(); }

}  // namespace tetwarp::apps
