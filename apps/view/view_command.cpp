// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <cstdio>
#include <mutex>
#include <optional>

#include "apps/cli/input.h"
#include "apps/cli/subcommands.h"
#include "apps/view/view_reel.h"
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
  AnyVolume read_labels(const Control& control) const;
  void prepare();
  void tell_where() const;

  const ViewOptions& options_;
  BackendKind backend_;
  ViewFields fields_;
  simulate::Scenario scenario_;
  InputVolume input_;
  AnyVolume labels_;
  simulate::Patient patient_;
  std::optional<viewer::Reel> reel_;
  std::unique_ptr<Viewer> viewer_;
  std::unique_ptr<Saving> saving_;  ///< tells the viewer what became of a wish, so it ends before it
};

Viewing::Viewing(const ViewOptions& options) : options_(options), backend_(chosen(options.backend)) {
  fields_ = parse_view_fields(options);
  if (!options.scenario.empty()) scenario_ = read_scenario(options.scenario);
  if (!options.demo && options.input.path.empty())
    throw UsageError("tetwarp view needs INPUT, a volume to look at, or --demo; see tetwarp view --help");
}

void Viewing::read() {
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
  if (!options_.labels.empty()) labels_ = read_labels(stage.control());
  if (fields_.any()) {
    reel_ = read_reel(fields_, input_.volume.geometry(), straightened(input_.volume.geometry()),
                      options_.common.threads, stage.control());
    return;
  }
  if (options_.scenario.empty())
    scenario_ = viewer::default_scenario(input_.volume.geometry(), runs_on_device(backend_));
  if (options_.field.cell_size) scenario_.cell_size = *options_.field.cell_size;
  const ConstVolumeView labelled = std::as_const(labels_).view();
  patient_ = simulate::examine(std::as_const(input_.volume).view(), options_.labels.empty() ? nullptr : &labelled,
                               scenario_.cell_size, scenario_.body_above_hu, stage.control());
}

AnyVolume Viewing::read_labels(const Control& control) const {
  const InputOptions from = volume_named(options_.labels, options_.common.nifti_frame);
  return read_input(from, open_input(from, options_.common), options_.common, control).volume;
}

void Viewing::prepare() {
  saving_ = std::make_unique<Saving>(options_);
  Viewer::Setup setup;
  setup.source = std::as_const(input_.volume).view();
  if (labels_.data()) setup.labels = std::as_const(labels_).view();
  setup.background = input_.background;
  if (input_.dicom) setup.padding = input_.dicom->padding;
  setup.patient = std::move(patient_);
  setup.scenario = std::move(scenario_);
  setup.reel = std::move(reel_);
  setup.backend = backend_;
  setup.device = options_.device;
  setup.limits = {.threads = options_.common.threads};
  setup.title = options_.demo ? "Phantom" : options_.input.path.filename().string();
  setup.volume_kinds = saved_volume_kinds(input_.is_dicom());
  setup.film_kinds = {".mp4", ".gif"};
  setup.folder = options_.output.string();
  setup.port = static_cast<std::uint16_t>(options_.port);
  setup.save = [this](viewer::SaveJob job, std::function<void(Viewer::Saved)> done) {
    saving_->begin(std::move(job), std::move(done));
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
