// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/view/view_save.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include "apps/cli/input.h"
#include "apps/cli/output.h"
#include "apps/render/movie.h"
#include "apps/view/view_reel.h"
#include "io/shown_text.h"
#include "io/staged_output.h"

namespace tetwarp::apps {

namespace {

namespace fs = std::filesystem;

constexpr const char* kDemoFile = "phantom.nii.gz";
constexpr int kMostFilmPictures = 240;
constexpr double kFilmRate = 24;  ///< pictures a second

/// A word of a command line, in quotes where it needs them.
std::string word(const fs::path& path) {
  const std::string text = path.string();
  const auto is_safe = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_' ||
           c == '/' || c == '.';
  };
  return !text.empty() && std::all_of(text.begin(), text.end(), is_safe) ? text : shell_quoted(text);
}

/// Numbers of an option.
template <class Numbers>
std::string listed(const Numbers& numbers, const char* between = ",") {
  std::string text;
  for (const auto number : numbers)
    text += (text.empty() ? "" : between) + exact_number_text(static_cast<double>(number));
  return text;
}

/// A command line, option by option.
class CommandText {
 public:
  explicit CommandText(const char* subcommand) : text_(std::string("tetwarp ") + subcommand) {}

  CommandText& add(const std::string& text) {
    text_ += " " + text;
    return *this;
  }
  CommandText& add(const char* option, const fs::path& path) {
    if (!path.empty()) text_ += std::string(" ") + option + " " + word(path);
    return *this;
  }
  /// INPUT, and the options that say how it is read.
  CommandText& add(const InputOptions& input) {
    add(word(input.path));
    if (!input.series.empty()) add("--series", fs::path(input.series));
    if (input.single) add("--single");
    if (input.uneven) add("--uneven exact");
    if (input.nifti_frame == NiftiFrame::qform) add("--nifti-frame qform");
    return *this;
  }
  CommandText& add(const char* option, double number) {
    return add(std::string(option) + " " + exact_number_text(number));
  }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

PhantomOptions demo_phantom(const fs::path& folder) {
  PhantomOptions phantom;
  phantom.output = folder / kDemoFile;
  phantom.size.assign(std::begin(kDemoSize), std::end(kDemoSize));
  phantom.spacing.assign(std::begin(kDemoSpacing), std::end(kDemoSpacing));
  phantom.common.quiet = true;
  return phantom;
}

/// Options of `simulate` for what was done.
SimulateOptions simulate_options(const ViewOptions& view, const InputOptions& input, const fs::path& scenario) {
  SimulateOptions simulate;
  simulate.common = view.common;
  simulate.common.quiet = true;
  simulate.scenario = scenario;
  simulate.input = input;
  simulate.labels = view.labels;
  simulate.backend = view.backend;
  simulate.device = view.device;
  return simulate;
}

}  // namespace

std::vector<std::string> saved_volume_kinds(bool is_dicom) {
  std::vector<std::string> kinds = {".nii.gz", ".mha", ".nrrd"};
  if (is_dicom) kinds.insert(kinds.begin(), "dicom");
  return kinds;
}

Saving::Saving(const ViewOptions& options)
    : options_(options), thread_([this](const std::stop_token& stop) { run(stop); }) {}

Saving::~Saving() { thread_.request_stop(); }

void Saving::begin(viewer::SaveJob job, std::function<void(Saved)> done) {
  const std::lock_guard lock(mutex_);
  jobs_.emplace_back(std::move(job), std::move(done));
  wake_.notify_one();
}

/// One job.
class Saving::One {
 public:
  One(const ViewOptions& options, const viewer::SaveJob& job)
      : options_(options), job_(job), input_(options.input), is_by_hand_(job.is_by_hand) {
    if (options_.demo) input_.path = options_.output / kDemoFile;
  }

  /// Does it. Where something fails, the problem names what is there already.
  Saved saved() {
    try {
      save();
    } catch (const std::exception& error) {
      saved_.problem = error.what();
      for (const std::string& file : saved_.files)
        saved_.problem += (&file == &saved_.files.front() ? "; written before: " : ", ") + file;
    }
    return std::move(saved_);
  }

 private:
  void save();
  fs::path file(const std::string& ending) const { return options_.output / (job_.wish.name + ending); }
  fs::path claim(const fs::path& path) const;
  void write_demo();
  void write(const fs::path& path, std::string_view bytes);
  void deform(const fs::path& output, bool runs);
  void write_field(const fs::path& output);
  void write_film(const fs::path& output);
  fs::path film_fields() const { return file(job_.has_cuts ? "-film.vtk" : "-film.mha"); }
  /// Number of frames from one picture of a film to the next.
  int film_step() const { return std::max(1, (job_.frames + kMostFilmPictures - 1) / kMostFilmPictures); }
  std::vector<fs::path> write_frames();
  RenderOptions film_options() const;
  FieldArguments given_field() const;
  CommandText& add_fields(CommandText& command) const;
  void say_command(const CommandText& command) {
    saved_.command += (saved_.command.empty() ? "" : "\n") + command.text();
  }

  const ViewOptions& options_;
  const viewer::SaveJob& job_;
  InputOptions input_;
  const bool is_by_hand_;
  fs::path scenario_;
  Saved saved_;
};

/// A path where something is to be written. @throws InputError where something is
fs::path Saving::One::claim(const fs::path& path) const {
  require(!fs::exists(path), path.string() + " exists; take another name");
  return path;
}

void Saving::One::write(const fs::path& path, std::string_view bytes) {
  write_new_file(path, bytes);
  saved_.files.push_back(path.string());
}

/// Writes the phantom, of which all else is made.
void Saving::One::write_demo() {
  const PhantomOptions phantom = demo_phantom(options_.output);
  if (!fs::exists(phantom.output)) run_phantom(phantom);
}

void Saving::One::save() {
  const auto& wish = job_.wish;
  if (!wish.film.empty()) require_movie_encoder(file(wish.film));
  require(!wish.field || is_by_hand_, "the field was given; it is there already");
  std::error_code error;
  fs::create_directories(options_.output, error);
  if (error) throw Error("cannot make the folder " + options_.output.string() + ": " + error.message());
  const bool is_series = wish.volume == "dicom";
  const fs::path volume = wish.volume.empty() ? fs::path() : claim(file(is_series ? "-dicom" : wish.volume)),
                 field = wish.field ? claim(file(job_.has_cuts ? "-field.vtk" : "-field.mha")) : fs::path(),
                 film = wish.film.empty() ? fs::path() : claim(file(wish.film));
  for (const auto& [pane, bytes] : job_.pictures) claim(file("-" + pane + ".png"));
  if (!job_.scenario.empty()) claim(file(".json"));
  if (!film.empty() && is_by_hand_) {
    const fs::path fields = film_fields();
    claim(fields);
    for (int number = film_step(); number <= job_.frames; number += film_step())
      claim(frame_path(fields, number, job_.frames));
  }
  if (!job_.scenario.empty()) {
    scenario_ = file(".json");
    write(scenario_, job_.scenario);
  }
  for (const auto& [pane, bytes] : job_.pictures)
    write(file("-" + pane + ".png"), {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  if (options_.demo) {
    if (wish.field || !volume.empty() || !film.empty()) write_demo();
    say_command(CommandText("phantom")
                    .add("-o", input_.path)
                    .add("--size " + listed(kDemoSize))
                    .add("--spacing " + listed(kDemoSpacing)));
  }
  if (!volume.empty() || job_.frames > 0) deform(volume.empty() ? file(".nii.gz") : volume, !volume.empty());
  if (!field.empty()) write_field(field);
  if (!film.empty()) write_film(film);
}

/// The field that was given, of a sequence the one that is shown.
FieldArguments Saving::One::given_field() const {
  FieldArguments field = options_.field;
  if (!options_.sequence.empty()) field.forward = {options_.sequence[static_cast<std::size_t>(job_.frame)]};
  return field;
}

/// Adds the options that say what deforms.
CommandText& Saving::One::add_fields(CommandText& command) const {
  if (is_by_hand_) return command.add("--scenario", scenario_).add("--labels", options_.labels);
  const FieldArguments field = given_field();
  for (const std::string& text : field.forward) command.add("-f", fs::path(text));
  for (const std::string& text : field.pull) command.add("--pull-field", fs::path(text));
  if (field.cell_size) command.add("--cell-size " + std::to_string(*field.cell_size));
  return command;
}

/// @param runs  whether the volume is made; else only its command is told
void Saving::One::deform(const fs::path& output, bool runs) {
  CommandText command("deform");
  command.add(input_);
  add_fields(command);
  if (!is_by_hand_) command.add("--outside background");
  say_command(command.add("-o", output));
  if (!runs) return;
  DeformOptions deform;
  deform.common = options_.common;
  deform.common.quiet = true;
  deform.input = input_;
  deform.scenario = scenario_;
  if (is_by_hand_) {
    deform.labels = options_.labels;
  } else {
    deform.field = given_field();
    deform.outside = Outside::background;
  }
  deform.output = output;
  deform.backend = options_.backend;
  deform.device = options_.device;
  run_deform(deform);
  saved_.files.push_back(output.string());
}

void Saving::One::write_field(const fs::path& output) {
  SimulateOptions simulate = simulate_options(options_, input_, scenario_);
  simulate.output = output;
  say_command(
      CommandText("simulate").add(word(scenario_)).add(input_).add("--labels", options_.labels).add("-o", output));
  run_simulate(simulate);
  saved_.files.push_back(output.string());
}

/// Writes the fields that a film of a scenario shows. @return their paths
std::vector<fs::path> Saving::One::write_frames() {
  SimulateOptions simulate = simulate_options(options_, input_, scenario_);
  simulate.output = film_fields();
  simulate.every = film_step();
  say_command(CommandText("simulate")
                  .add(word(scenario_))
                  .add(input_)
                  .add("--labels", options_.labels)
                  .add("--every " + std::to_string(simulate.every))
                  .add("-o", simulate.output));
  run_simulate(simulate);
  std::vector<fs::path> frames;
  for (int number = simulate.every; number <= job_.frames; number += simulate.every)
    frames.push_back(frame_path(simulate.output, number, job_.frames));
  return frames;
}

/// How a film looks: as the pane that is filmed.
RenderOptions Saving::One::film_options() const {
  RenderOptions render;
  render.common = options_.common;
  render.common.quiet = true;
  render.input = input_;
  render.backend = options_.backend;
  render.device = options_.device;
  render.outside = Outside::background;
  render.rate = kFilmRate;
  const auto numbers = [](const glm::dvec3& v) { return std::vector<double>{v.x, v.y, v.z}; };
  const Window& window = job_.look.window;
  if (job_.wish.film_of == viewer::request::Pane::volume) {
    render.transfer = job_.style;
    render.angle = job_.camera.angle_deg;
    render.elevation = job_.camera.elevation_deg;
    render.zoom = job_.camera.zoom;
    if (job_.camera.target) render.position = numbers(*job_.camera.target);
  } else {
    constexpr const char* kViews[] = {"axial", "coronal", "sagittal"};
    render.view = kViews[static_cast<int>(job_.wish.film_of)];
    render.position = numbers(job_.cursor_mm);
    constexpr const char* kOverlays[] = {"lattice", "jacobian", "folds", "coverage"};
    if (job_.look.layer && static_cast<std::size_t>(*job_.look.layer) < std::size(kOverlays))
      render.overlays = {kOverlays[static_cast<int>(*job_.look.layer)]};
  }
  if (render.view != "volume" || (job_.style == "mip" && !window.hounsfield)) {
    render.window = window.width;
    render.level = window.level;
  }
  return render;
}

void Saving::One::write_film(const fs::path& output) {
  RenderOptions render = film_options();
  CommandText command("render");
  command.add(input_);
  if (is_by_hand_) {
    const std::vector<fs::path> frames = write_frames();
    for (const fs::path& frame : frames) render.sequence.push_back(frame.string());
    command.add("--sequence " + word(file("-film")) + ".*" + frames.front().extension().string());
  } else if (!options_.sequence.empty()) {
    render.sequence = options_.sequence;
    render.field.cell_size = options_.field.cell_size;
    if (render.field.cell_size) command.add("--cell-size " + std::to_string(*render.field.cell_size));
    std::string all = "--sequence";
    for (const std::string& field : options_.sequence) all += " " + word(field);
    command.add(all);
  } else {
    render.field = options_.field;
    render.frames = kGrowthFrames;
    add_fields(command).add("--frames " + std::to_string(render.frames));
  }
  render.output = output;
  if (render.view != "volume") command.add("--view " + render.view);
  if (!render.transfer.empty()) command.add("--transfer " + render.transfer);
  if (render.view == "volume") {
    command.add("--angle", render.angle).add("--elevation", render.elevation).add("--zoom", render.zoom);
  }
  if (!render.position.empty()) command.add("--position " + listed(render.position, "/"));
  if (render.window) command.add("--window", *render.window).add("--level", *render.level);
  for (const std::string& overlay : render.overlays) command.add("--overlay " + overlay);
  say_command(command.add("--outside background").add("--rate", render.rate).add("-o", output));
  run_render(render);
  saved_.files.push_back(output.string());
}

void Saving::run(const std::stop_token& stop) {
  for (;;) {
    std::pair<viewer::SaveJob, std::function<void(Saved)>> next;
    {
      std::unique_lock lock(mutex_);
      if (!wake_.wait(lock, stop, [this] { return !jobs_.empty(); })) return;
      next = std::move(jobs_.front());
      jobs_.pop_front();
    }
    next.second(One(options_, next.first).saved());
  }
}

}  // namespace tetwarp::apps
