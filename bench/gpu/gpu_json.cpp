// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <nlohmann/json.hpp>

#include "bench/gpu/gpu_report.h"
#include "bench/harness/report.h"
#include "deform/version.h"

namespace tetwarp::bench {

namespace {

using Json = nlohmann::json;

Json to_json(const Report& report) {
  return {{"covered", report.covered},
          {"uncovered", report.uncovered},
          {"inverted", report.inverted},
          {"degenerate", report.degenerate}};
}

Json to_json(const GpuRun& run) {
  return {{"size", size_json(run.size)},
          {"field", run.field},
          {"cell_size", run.cell_size},
          {"at_rest", run.at_rest},
          {"set_field_ms", to_json(run.set_field_ms)},
          {"resample_ms", to_json(run.resample_ms)},
          {"new_field_ms", to_json(run.new_field_ms)},
          {"two_volumes_ms", to_json(run.two_ms)},
          {"paper_ms", to_json(run.paper_ms)},
          {"gascon_ms", to_json(run.gascon_ms)},
          {"backward_ms", to_json(run.backward_ms)},
          {"report", to_json(run.report)}};
}

Json to_json(const MeshRun& run) {
  return {{"field", run.field},
          {"cell_size", run.cell_size},
          {"tetrahedra", run.tetrahedra},
          {"set_field_ms", to_json(run.set_field_ms)},
          {"resample_ms", to_json(run.resample_ms)},
          {"gascon_ms", to_json(run.gascon_ms)}};
}

Json to_json(const CopyTimes& copies) {
  return {{"volume_ms", to_json(copies.volume_ms)},
          {"field_ms", to_json(copies.field_ms)},
          {"volume_floor_ms", copies.volume_floor_ms()},
          {"bytes_floor_ms", copies.bytes_floor_ms()}};
}

Json to_json(const FrameLoop& loop) {
  return {{"cell_size", loop.cell_size},
          {"kernels_per_s", loop.kernels},
          {"with_copies_per_s", loop.with_copies},
          {"copies_alone_per_s", loop.copies_alone},
          {"host_views_per_s", loop.host_views}};
}

Json to_json(const MemoryUse& use) {
  return {{"field", use.field},
          {"data_bytes", use.data},
          {"allowed_bytes", use.allowed()},
          {"host_views_bytes", use.host_views},
          {"device_views_bytes", use.device_views}};
}

template <class T>
Json list(const std::vector<T>& items) {
  Json array = Json::array();
  for (const T& item : items) array.push_back(to_json(item));
  return array;
}

Json options_json(const GpuOptions& options) {
  return {{"frames", options.frames},
          {"warmup", options.warmup},
          {"fields", options.fields},
          {"cell_sizes", options.cell_sizes},
          {"slices", options.input.is_phantom() ? Json(options.input.slices) : Json(nullptr)}};
}

}  // namespace

nlohmann::json to_json(const GpuResults& results, const std::vector<Floor>& floors) {
  return {{"program", "tetwarp-bench gpu"},
          {"version", version()},
          {"commit", commit()},
          {"options", options_json(results.options)},
          {"machine", to_json(results.machine)},
          {"input", input_json(results.input_kind)},
          {"size", size_json(results.size)},
          {"copies", to_json(results.copies)},
          {"runs", list(results.runs)},
          {"meshes", list(results.meshes)},
          {"frame_loops", list(results.loops)},
          {"memory", list(results.memory)},
          {"floors", to_json(floors)}};
}

}  // namespace tetwarp::bench
