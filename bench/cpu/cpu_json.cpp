// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <nlohmann/json.hpp>

#include "bench/cpu/cpu_report.h"
#include "bench/harness/report.h"
#include "deform/version.h"

namespace tetwarp::bench {

namespace {

using Json = nlohmann::json;

Json to_json(const std::optional<PeerTimes>& peer) {
  return peer ? Json{{"ms", to_json(peer->ms)}, {"differing", peer->differing}} : Json(nullptr);
}

Json to_json(const OwnTimes& times) {
  return {{"set_field_ms", to_json(times.set_field_ms)},
          {"resample_ms", to_json(times.resample_ms)},
          {"new_field_ms", to_json(times.new_field_ms)}};
}

Json to_json(const CpuRun& run) {
  Json json = {{"size", size_json(run.size)},
               {"field", run.field},
               {"cell_size", run.cell_size},
               {"at_rest", run.at_rest},
               {"covered", run.covered},
               {"new_field_ns_a_voxel", ns_a_voxel(run.ours.new_field_ms, run.size)},
               {"resting",
                run.resting ? Json{{"share", run.resting->share}, {"new_field_ms", to_json(run.resting->new_field_ms)}}
                            : Json(nullptr)},
               {"two_volumes_ms", to_json(run.two_ms)},
               {"bytes_ms", to_json(run.bytes_ms)},
               {"paper", to_json(run.paper)},
               {"itk_warp", to_json(run.itk_warp)},
               {"itk_invert_and_warp", to_json(run.itk_invert_and_warp)},
               {"vtk_probe", to_json(run.vtk_probe)}};
  json.update(to_json(run.ours));
  return json;
}

Json to_json(const Scaling& scaling) {
  return {{"field", scaling.field},
          {"threads", scaling.threads},
          {"one", to_json(scaling.one)},
          {"all", to_json(scaling.all)},
          {"efficiency", scaling.efficiency()}};
}

Json list(const std::vector<CpuRun>& runs) {
  Json array = Json::array();
  for (const CpuRun& run : runs) array.push_back(to_json(run));
  return array;
}

Json options_json(const CpuOptions& options) {
  return {{"fields", options.fields},  {"peers", options.peers},   {"cell_sizes", options.cell_sizes},
          {"width", options.width},    {"slices", options.slices}, {"slow_slices", options.slow_slices},
          {"repeats", options.repeats}};
}

Json version_json(const std::optional<std::string>& version) { return version ? Json(*version) : Json(nullptr); }

}  // namespace

nlohmann::json to_json(const CpuResults& results, const std::vector<Floor>& floors) {
  Json left_out = Json::array();
  for (const glm::i64vec3& size : results.left_out) left_out.push_back(size_json(size));
  return {{"program", "tetwarp-bench cpu"},
          {"version", version()},
          {"commit", commit()},
          {"options", options_json(results.options)},
          {"machine", to_json(results.machine)},
          {"itk", version_json(results.itk)},
          {"vtk", version_json(results.vtk)},
          {"input", input_json("phantom")},
          {"runs", list(results.runs)},
          {"slow_peers", list(results.slow)},
          {"larger_cells", list(results.coarse)},
          {"growth", list(results.growth)},
          {"growth_left_out", left_out},
          {"scaling", results.scaling ? to_json(*results.scaling) : Json(nullptr)},
          {"floors", to_json(floors)}};
}

}  // namespace tetwarp::bench
