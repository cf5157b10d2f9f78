// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/simulate/simulate.h"

#include <algorithm>
#include <utility>

#include "backend/factories.h"
#include "backend/frame_loop.h"
#include "bench/harness/files.h"
#include "bench/harness/results.h"
#include "deform/phantom.h"
#include "deform/simulate/scenario_run.h"
#include "io/scenario_file.h"

namespace tetwarp::bench {

namespace {

using namespace simulate;

constexpr int kPicturesAround = 72;

FrameVolumes make_host_volumes(const Volume<std::int16_t>& source, double background) {
  const auto output = std::make_shared<Volume<std::int16_t>>(source);
  return {{.source = tetwarp::view(source), .output = tetwarp::view(*output), .background = background}, output};
}

/// A picture of each frame: nothing else leaves the backend.
class FramePictures {
 public:
  FramePictures(const Options& options, const Geometry& volume, bool on_cuda)
      : style_{.transfer = transfer_function(options.transfer)},
        camera_{.width = options.render[0], .height = options.render[1]},
        volume_(volume),
        renderer_(make_renderer(on_cuda ? BackendKind::cuda : BackendKind::cpu, options.device,
                                {.threads = options.threads})),
        rgb_(3 * static_cast<std::size_t>(camera_.width) * static_cast<std::size_t>(camera_.height)) {
    renderer_->set_style(style_);
  }

  void draw(const ConstVolumeView& volume) {
    renderer_->set_volume(volume);
    renderer_->render(view_plane(camera_, volume_), rgb_);
  }
  /// Pictures from all around.
  void turn(Samples& times) {
    for (int n = 0; n < kPicturesAround; ++n) {
      camera_.angle_deg = 360.0 * n / kPicturesAround;
      const Stopwatch watch;
      renderer_->render(view_plane(camera_, volume_), rgb_);
      times["turn_ms"].push_back(watch.ms());
    }
  }

  Renderer& renderer() { return *renderer_; }
  ViewPlane plane() const { return view_plane(camera_, volume_); }
  std::vector<ValueRange> seen() const { return seen_values(style_); }

 private:
  const RenderStyle style_;
  Camera camera_;
  const Geometry& volume_;
  std::unique_ptr<Renderer> renderer_;
  std::vector<std::uint8_t> rgb_;
};

Json convergence_json(const Convergence& convergence) {
  return {{"steps", convergence.steps},
          {"motion_mm", convergence.motion_mm},
          {"residual", convergence.residual},
          {"reached", convergence.reached}};
}

/// The first phase of a scenario by one method on one backend.
class Measure {
 public:
  Measure(const Options& options, const Scenario& scenario, const Volume<std::int16_t>& volume, const Patient& patient,
          const std::string& method, const std::string& backend)
      : options_(options),
        scenario_(scenario),
        volume_(volume),
        patient_(patient),
        row_{{"method", method}, {"backend", backend}},
        is_chainmail_(method == "chainmail"),
        on_cuda_(backend == "cuda") {
    options.say(backend + ", " + method);
    scenario_.method = is_chainmail_ ? Method::chainmail : Method::mass_spring;
    scenario_.phases.resize(1);
  }

  /// In one go, from rest until it has converged. The time is that of `advance` alone.
  Json settle() {
    scenario_.phases[0].frames = 1;
    ScenarioRun run(scenario_, patient_, factory());
    Json row = row_;
    const Stopwatch watch;
    const FrameResult frame = run.next();
    row["seconds"] = watch.ms() / 1000;
    row.update(convergence_json(frame.convergence));
    return row;
  }

  /// The same way in many frames, each resampled, with set_field, and drawn, with what set_volume finds. With pictures
  /// frames a second are those of `FrameLoop`; times of parts are those of one part after the other.
  Json frames() {
    scenario_.phases[0].frames = options_.warmup + options_.frames;
    scenario_.stop.steps = options_.steps_a_frame;
    scenario_.deadband_mm = options_.deadband_mm;
    ScenarioRun run(scenario_, patient_, factory());
    const double background = *std::min_element(volume_.voxels.begin(), volume_.voxels.end());
    const FrameVolumes volumes =
        on_cuda_ ? make_device_volumes(volume_, background) : make_host_volumes(volume_, background);
    const auto resampler =
        make_forward_resampler(backend(), volume_.geometry, options_.device, {.threads = options_.threads});
    const Target& target = volumes.target;
    std::optional<FramePictures> pictures;
    if (!options_.render.empty()) pictures.emplace(options_, volume_.geometry, on_cuda_);
    Convergence last;
    Stopwatch whole;
    const auto one_frame = [&](Samples& times) {
      const Stopwatch watch;
      if (times.empty()) whole = watch;
      last = run.next().convergence;
      const double simulated = watch.ms();
      run.resample(*resampler, {&target, 1}, Outside::background, {}, {.jacobian_range = false});
      const double resampled = watch.ms();
      if (pictures) pictures->draw(target.output);
      const double all = watch.ms();
      times["simulate_ms"].push_back(simulated);
      times["resample_ms"].push_back(resampled - simulated);
      if (pictures) times["render_ms"].push_back(all - resampled);
    };
    Samples times = take_turns({{"frame", one_frame}}, options_.warmup, options_.frames).front();
    Json row = row_;
    row.update({{"steps", options_.steps_a_frame}, {"frames_per_second", 1000 * options_.frames / whole.ms()}});
    if (pictures) {
      row["parts_per_second"] = row["frames_per_second"];
      row["frames_per_second"] = loop(*resampler, target, *pictures);
      pictures->turn(times);
    }
    for (const auto& [name, ms] : times) row[name] = summarize(ms);
    row["last"] = convergence_json(last);
    return row;
  }

 private:
  /// Frames a second of a FrameLoop, of which nothing but pictures is wanted.
  double loop(ForwardResampler& resampler, const Target& target, FramePictures& pictures) {
    ScenarioRun run(scenario_, patient_, factory());
    FrameLoop frames({run, resampler, pictures.renderer(), target, Outside::background, pictures.seen()}, backend(),
                     options_.device);
    for (int n = 0; n < options_.warmup; ++n) frames.next(pictures.plane());
    const Stopwatch watch;
    while (!frames.is_done()) frames.next(pictures.plane());
    return 1000 * options_.frames / watch.ms();
  }
  MakeSimulation factory() const {
    return [backend = backend(), method = scenario_.method, device = options_.device,
            limits = Limits{.threads = options_.threads}](const Model& model) {
      return make_simulation(backend, method, model, device, limits);
    };
  }
  BackendKind backend() const { return on_cuda_ ? BackendKind::cuda : BackendKind::cpu; }

  const Options& options_;
  Scenario scenario_;
  const Volume<std::int16_t>& volume_;
  const Patient& patient_;
  const Json row_;
  const bool is_chainmail_, on_cuda_;
};

/// A run that has not converged misses its floor however short it was.
Floors find_floors(const Json& document) {
  Floors floors;
  const auto where = [](const Json& run) {
    return run["method"].get<std::string>() + ", " + run["backend"].get<std::string>();
  };
  for (const Json& run : document["settle"]) {
    const bool is_chainmail = run["method"] == "chainmail";
    floors.at_least("has settled", where(run), run["reached"] ? 1 : 0, 1, 1);
    if (run["backend"] == "cpu")
      floors.at_most("seconds until it has settled", where(run), number(run, "/seconds"), 1, is_chainmail ? 10 : 30,
                     is_chainmail ? std::nullopt : Floors::Limit(10));
  }
  for (const Json& run : document["frames"]) {
    const bool on_cuda = run["backend"] == "cuda", is_chainmail = run["method"] == "chainmail";
    const auto frames_a_second = [&](double required, double aim) {
      floors.at_least("frames per second", where(run), number(run, "/frames_per_second"), 1, required, aim);
    };
    if (on_cuda && !run.contains("render_ms")) {
      frames_a_second(60, 400);
    } else if (on_cuda && is_chainmail) {
      frames_a_second(600, 1000);
    } else if (on_cuda) {
      frames_a_second(300, 500);
    }
    floors.at_most("ms of a picture", where(run), number(run, "/turn_ms"), 1, on_cuda ? 1.5 : 200);
  }
  return floors;
}

}  // namespace

int run_simulate(const Options& options) {
  require_writable(options.json, {options.scenario});
  const Scenario scenario = read_scenario(options.scenario);
  options.say("phantom");
  const Volume<std::int16_t> volume = make_phantom(options.input.phantom_size(), {0.8, 0.8, 1.0}, kPhantomSeed);
  const Patient patient = examine(tetwarp::view(volume), nullptr, scenario.cell_size, scenario.body_above_hu);
  const bool on_cuda = std::find(options.backends.begin(), options.backends.end(), "cuda") != options.backends.end();
  Json document = begin_document(
      "simulate", {{"frames", options.frames}, {"warmup", options.warmup}, {"deadband_mm", options.deadband_mm}},
      describe_machine(on_cuda ? options.device : -1, options.threads), "phantom");
  document.update({{"scenario", scenario.name},
                   {"volume", size_json(volume.geometry.size)},
                   {"lattice", size_json(patient.lattice.size)},
                   {"settle", Json::array()},
                   {"frames", Json::array()}});
  for (const std::string& backend : options.backends) {
    for (const std::string& method : options.methods) {
      Measure measure(options, scenario, volume, patient, method, backend);
      document["settle"].push_back(measure.settle());
      document["frames"].push_back(measure.frames());
    }
  }
  return conclude(document, find_floors(document), options);
}

}  // namespace tetwarp::bench
