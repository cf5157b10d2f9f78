// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/simulate/simulate_bench.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "backend/factories.h"
#include "bench/harness/machine.h"
#include "bench/harness/statistics.h"
#include "deform/phantom.h"
#include "deform/render/renderer.h"
#include "deform/simulate/scenario_run.h"
#include "io/scenario_file.h"

namespace tetwarp::bench {

namespace {

using namespace simulate;
using Clock = std::chrono::steady_clock;

constexpr int kPicturesAround = 72;

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

class HostVolumes final : public FrameVolumes {
 public:
  HostVolumes(const Volume<std::int16_t>& source, double background)
      : source_(source), output_(source), background_(background) {}
  Target target() override {
    return {.source = tetwarp::view(source_), .output = tetwarp::view(output_), .background = background_};
  }

 private:
  const Volume<std::int16_t>& source_;
  Volume<std::int16_t> output_;
  double background_;
};

/// A picture of each frame: nothing else leaves the backend.
class FramePictures {
 public:
  FramePictures(const SimulateOptions& options, const Geometry& volume, bool on_cuda)
      : camera_{.width = options.render[0], .height = options.render[1]},
        volume_(volume),
        renderer_(on_cuda ? make_renderer(BackendKind::cuda, options.device)
                          : make_cpu_renderer({.threads = options.threads})),
        rgb_(3 * static_cast<std::size_t>(camera_.width) * static_cast<std::size_t>(camera_.height)) {
    renderer_->set_style({.transfer = transfer_function(options.transfer)});
  }

  void draw(const ConstVolumeView& volume) {
    renderer_->set_volume(volume);
    renderer_->render(view_plane(camera_, volume_), rgb_);
  }
  /// Milliseconds of pictures from all around.
  std::vector<double> turn(int pictures) {
    std::vector<double> ms;
    for (int n = 0; n < pictures; ++n) {
      camera_.angle_deg = 360.0 * n / pictures;
      const auto start = Clock::now();
      renderer_->render(view_plane(camera_, volume_), rgb_);
      ms.push_back(ms_since(start));
    }
    return ms;
  }

 private:
  Camera camera_;
  const Geometry& volume_;
  std::unique_ptr<Renderer> renderer_;
  std::vector<std::uint8_t> rgb_;
};

MakeSimulation factory_of(simulate::Method method, bool on_cuda, const SimulateOptions& options) {
  const Limits limits{.threads = options.threads};
  const BackendKind backend = on_cuda ? BackendKind::cuda : BackendKind::cpu;
  const int device = options.device;
  return [=](const Model& model) { return make_simulation(backend, method, model, device, limits); };
}

/// The first phase alone.
Scenario first_phase(Scenario scenario, simulate::Method method, int frames) {
  scenario.method = method;
  scenario.phases.resize(1);
  scenario.phases[0].frames = frames;
  return scenario;
}

class Measuring {
 public:
  Measuring(const SimulateOptions& options, const std::function<void(const std::string&)>& say)
      : options_(options), say_(say), scenario_(read_scenario(options.scenario)) {
    say_("phantom");
    volume_ = make_phantom({options.width, options.width, options.slices}, {0.8, 0.8, 1.0}, kPhantomSeed);
    const ConstVolumeView ct = tetwarp::view(std::as_const(volume_));
    patient_ = examine(ct, nullptr, scenario_.cell_size, scenario_.body_above_hu);
    results_.options = options;
    results_.scenario = scenario_.name;
    results_.volume = volume_.geometry.size;
    results_.lattice = patient_.lattice.size;
    const bool on_cuda = std::find(options.backends.begin(), options.backends.end(), "cuda") != options.backends.end();
    results_.machine = describe_machine(on_cuda ? options.device : -1, options.threads);
  }

  SimulateResults run() {
    for (const std::string& backend : options_.backends) {
      for (const std::string& method : options_.methods) {
        say_(backend + ", " + method);
        const simulate::Method which =
            method == "chainmail" ? simulate::Method::chainmail : simulate::Method::mass_spring;
        settle(which, method, backend);
        frames(which, method, backend);
      }
    }
    return std::move(results_);
  }

 private:
  void settle(simulate::Method method, const std::string& name, const std::string& backend) {
    const Scenario scenario = first_phase(scenario_, method, 1);
    ScenarioRun run(scenario, patient_, factory_of(method, backend == "cuda", options_));
    const auto start = Clock::now();
    const Frame frame = run.next();
    results_.settle.push_back({name, backend, ms_since(start) / 1000, frame.settled});
  }

  void frames(simulate::Method method, const std::string& name, const std::string& backend) {
    const bool on_cuda = backend == "cuda";
    Scenario scenario = first_phase(scenario_, method, options_.warmup + options_.frames);
    scenario.stop.steps = options_.steps;
    ScenarioRun run(scenario, patient_, factory_of(method, on_cuda, options_));
    const double background = *std::min_element(volume_.voxels.begin(), volume_.voxels.end());
    const std::unique_ptr<FrameVolumes> volumes =
        on_cuda ? make_device_volumes(volume_, background) : std::make_unique<HostVolumes>(volume_, background);
    const auto resampler = on_cuda ? make_forward_resampler(BackendKind::cuda, volume_.geometry, options_.device)
                                   : make_cpu_resampler(volume_.geometry, {.threads = options_.threads});
    const Target target = volumes->target();
    std::optional<FramePictures> pictures;
    if (!options_.render.empty()) pictures.emplace(options_, volume_.geometry, on_cuda);
    std::vector<double> simulate_ms, resample_ms, render_ms;
    FrameRun result{.method = name,
                    .backend = backend,
                    .steps = options_.steps,
                    .simulate_ms = {},
                    .resample_ms = {},
                    .render_ms = {},
                    .turn_ms = {},
                    .last = {}};
    Clock::time_point first{};
    for (int n = 0; !run.is_done(); ++n) {
      const auto start = Clock::now();
      if (n == options_.warmup) first = start;
      result.last = run.next().settled;
      const double simulated = ms_since(start);
      run.resample(*resampler, {&target, 1}, Outside::background, {}, {.jacobian_range = false});
      const double resampled = ms_since(start);
      if (pictures) pictures->draw(target.output);
      const double all = ms_since(start);
      if (n < options_.warmup) continue;
      simulate_ms.push_back(simulated);
      resample_ms.push_back(resampled - simulated);
      render_ms.push_back(all - resampled);
    }
    result.frames_per_second = options_.frames / (ms_since(first) / 1000);
    if (pictures) {
      result.render_ms = summarize(render_ms);
      result.turn_ms = summarize(pictures->turn(kPicturesAround));
    }
    result.simulate_ms = summarize(simulate_ms);
    result.resample_ms = summarize(resample_ms);
    results_.frames.push_back(result);
  }

  const SimulateOptions& options_;
  const std::function<void(const std::string&)>& say_;
  Scenario scenario_;
  Volume<std::int16_t> volume_;
  Patient patient_;
  SimulateResults results_;
};

}  // namespace

SimulateResults measure_simulate(const SimulateOptions& options, const std::function<void(const std::string&)>& say) {
  return Measuring(options, say).run();
}

}  // namespace tetwarp::bench
