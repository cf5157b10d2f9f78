// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <nlohmann/json.hpp>

#include "bench/harness/markdown.h"
#include "bench/harness/report.h"
#include "bench/simulate/simulate_bench.h"
#include "deform/version.h"

namespace tetwarp::bench {

namespace {

using Json = nlohmann::json;

constexpr char kSettleNote[] = R"(## Until it has settled

The first phase in one go, from rest: largest motion of a vertex in the last step, and largest net force on a free vertex
over the largest by which placed ones are kept in their places (mass-spring).

)";

constexpr char kFrameNote[] = R"(## Frame by frame

The same way in equal frames, each with a few steps, then set_field and resample of the volume, then a picture of it if one is asked
for: its empty blocks are found and its rays cast. "Turning" are pictures of a volume that stands, from all around. ms, median (q1-q3).

)";

std::string introduction(const SimulateResults& results) {
  const SimulateOptions& options = results.options;
  std::string text = std::string("# tetwarp-bench simulate, ") + version() + " (" + commit() +
                     ")\n\n- CPU: " + results.machine.cpu + ", " + std::to_string(results.machine.threads) +
                     " threads\n";
  if (results.machine.gpu) text += "- GPU: " + cuda_text(results.machine) + "\n";
  return text + "- scenario: " + results.scenario + ", on a phantom of " + to_string(results.volume) + " voxels, " +
         to_string(results.lattice) + " vertices\n" +
         format("- %d timed frames after %d\n\n", options.frames, options.warmup);
}

Json to_json(const simulate::Settled& settled) {
  return {{"steps", settled.steps},
          {"motion_mm", settled.motion_mm},
          {"residual", settled.residual},
          {"reached", settled.reached}};
}

/// Within the rule, by the time given; a run that has not settled misses it however short it was.
void add_settle(const SettleRun& run, std::vector<Floor>& floors) {
  const bool is_chainmail = run.method == "chainmail";
  const std::string where = run.method + ", " + run.backend;
  floors.push_back({"has settled", where, run.settled.reached ? 1.0 : 0.0, true, 1, {}});
  if (run.backend != "cpu") return;
  const std::optional<double> aim = is_chainmail ? std::nullopt : std::optional(10.0);
  floors.push_back({"seconds until it has settled", where, run.seconds, false, is_chainmail ? 10.0 : 30.0, aim});
}

}  // namespace

std::vector<Floor> find_floors(const SimulateResults& results) {
  std::vector<Floor> floors;
  for (const SettleRun& run : results.settle) add_settle(run, floors);
  for (const FrameRun& run : results.frames) {
    const std::string where = run.method + ", " + run.backend;
    if (run.backend != "cuda") {
      if (run.turn_ms) floors.push_back({"ms of a picture", where, run.turn_ms->median, false, 200, {}});
      continue;
    }
    floors.push_back({"frames per second", where, run.frames_per_second, true, run.render_ms ? 120.0 : 60.0, 400});
    if (run.turn_ms) floors.push_back({"ms of a picture", where, run.turn_ms->median, false, 1.5, {}});
  }
  return floors;
}

std::string to_markdown(const SimulateResults& results, const std::vector<Floor>& floors) {
  std::string text = introduction(results) + kSettleNote +
                     heading({"method", "backend", "seconds", "steps", "last motion, mm", "residual", "settled"});
  for (const SettleRun& run : results.settle) {
    text += row({run.method, run.backend, format("%.3f", run.seconds), std::to_string(run.settled.steps),
                 format("%.2g", run.settled.motion_mm), format("%.2g", run.settled.residual),
                 run.settled.reached ? "yes" : "no"});
  }
  text += std::string("\n") + kFrameNote +
          heading({"method", "backend", "steps", "simulate", "resample", "picture", "frames a second", "turning",
                   "last motion, mm"});
  for (const FrameRun& run : results.frames) {
    text += row({run.method, run.backend, std::to_string(run.steps), cell(run.simulate_ms), cell(run.resample_ms),
                 run.render_ms ? cell(*run.render_ms) : "", format("%.1f", run.frames_per_second),
                 run.turn_ms ? cell(*run.turn_ms) : "", format("%.2g", run.last.motion_mm)});
  }
  return text + "\n" + to_markdown(floors);
}

Json to_json(const SimulateResults& results, const std::vector<Floor>& floors) {
  Json document{{"version", version()},
                {"commit", commit()},
                {"machine", to_json(results.machine)},
                {"scenario", results.scenario},
                {"volume", size_json(results.volume)},
                {"lattice", size_json(results.lattice)},
                {"floors", to_json(floors)}};
  for (const SettleRun& run : results.settle) {
    Json one{{"method", run.method}, {"backend", run.backend}, {"seconds", run.seconds}};
    one.update(to_json(run.settled));
    document["settle"].push_back(one);
  }
  for (const FrameRun& run : results.frames) {
    document["frames"].push_back({{"method", run.method},
                                  {"backend", run.backend},
                                  {"steps", run.steps},
                                  {"simulate_ms", to_json(run.simulate_ms)},
                                  {"resample_ms", to_json(run.resample_ms)},
                                  {"frames_per_second", run.frames_per_second},
                                  {"last", to_json(run.last)}});
    if (run.render_ms) document["frames"].back()["render_ms"] = to_json(*run.render_ms);
    if (run.turn_ms) document["frames"].back()["turn_ms"] = to_json(*run.turn_ms);
  }
  return document;
}

}  // namespace tetwarp::bench
