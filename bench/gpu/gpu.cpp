// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/gpu/gpu.h"

#include <span>

#include "backend/devices.h"
#include "bench/harness/files.h"
#include "bench/harness/input.h"

namespace tetwarp::bench {

namespace {

constexpr const char* kCoarseFields[] = {"wave", "twist", "bubble", "elastic"};
constexpr std::int64_t kMeshCells[] = {16, 32};  ///< tetrahedra of a few dozen voxels a side
constexpr const char* kLongField = "wave";
constexpr std::int64_t kLargeCells = 16;

Json case_json(const std::string& field, std::int64_t cell_size) {
  return {{"field", field}, {"cell_size", cell_size}};
}

Json run_json(const glm::i64vec3& size, const std::string& field, std::int64_t cell_size, const GpuMeasure& found) {
  Json row{{"size", size_json(size)}};
  row.update(case_json(field, cell_size));
  row["at_rest"] = found.at_rest;
  for (const char* name :
       {"set_field_ms", "resample_ms", "new_field_ms", "two_volumes_ms", "paper_ms", "gascon_ms", "backward_ms"})
    row[name] = summary_of(found.times, name);
  row["report"] = {{"covered", found.report.covered},
                   {"uncovered", found.report.uncovered},
                   {"inverted", found.report.inverted},
                   {"degenerate", found.report.degenerate}};
  return row;
}

/// Every field on cells of one voxel, the smooth ones on larger cells and as meshes.
void run_methods(const Volume<std::int16_t>& volume, const Options& options, Json& document) {
  const std::unique_ptr<GpuMethods> methods = make_gpu_methods(volume, options);
  const glm::i64vec3 size = volume.geometry.size;
  for (const std::string& field : options.fields) {
    options.say(field + ", a vertex on every voxel");
    document["runs"].push_back(run_json(size, field, 1, methods->measure(field, 1, {.paper = true, .backward = true})));
  }
  const auto on_cells = [&](const auto& cell_sizes, const auto& run) {
    for (const std::int64_t cell_size : cell_sizes)
      for (const std::string field : kCoarseFields)
        if (options.has_field(field)) run(field, cell_size);
  };
  on_cells(options.cell_sizes, [&](const std::string& field, std::int64_t cells) {
    options.say(field + ", cells of " + std::to_string(cells));
    document["runs"].push_back(
        run_json(size, field, cells, methods->measure(field, cells, {.paper = true, .gascon = true})));
  });
  on_cells(kMeshCells, [&](const std::string& field, std::int64_t cells) {
    options.say(field + ", a mesh, cells of " + std::to_string(cells));
    const GpuMeasure found = methods->measure_mesh(field, cells);
    Json row = case_json(field, cells);
    row["tetrahedra"] = found.tetrahedra;
    for (const char* name : {"set_field_ms", "resample_ms", "gascon_ms"}) row[name] = summary_of(found.times, name);
    document["meshes"].push_back(row);
  });
}

void run_on_first(const Volume<std::int16_t>& volume, const Options& options, Json& document) {
  document["size"] = size_json(volume.geometry.size);
  options.say("copies");
  document["copies"] = copies_json(measure_copies(volume.geometry, options));
  for (const char* list : {"runs", "meshes", "frame_loops", "memory"}) document[list] = Json::array();
  run_methods(volume, options, document);
  std::vector<std::int64_t> cell_sizes = options.cell_sizes;
  cell_sizes.insert(cell_sizes.begin(), 1);
  for (const std::int64_t cell_size : cell_sizes) {
    options.say("frame after frame, cells of " + std::to_string(cell_size));
    const FrameLoop loop = measure_frame_loop(volume, cell_size, options);
    document["frame_loops"].push_back({{"cell_size", cell_size},
                                       {"kernels_per_s", loop.kernels},
                                       {"with_copies_per_s", loop.with_copies},
                                       {"copies_alone_per_s", loop.copies_alone},
                                       {"host_views_per_s", loop.host_views}});
  }
  for (const std::string& field : options.fields) {
    options.say("memory, " + field);
    document["memory"].push_back(memory_json(field, measure_memory(volume, field, options)));
  }
}

/// Before a phantom is made. @throws DeviceError, NotCompiled
void require_device(int device) {
  if (!has_cuda())
    throw NotCompiled("CUDA is not in this build; `tetwarp bench cpu` and `paper --backend cpu` need none");
  const int count = device_count();
  if (device < count) return;
  throw DeviceError("no CUDA device " + std::to_string(device) + ", " + std::to_string(count) +
                    " found; see tetwarp --version, or use tetwarp bench paper --backend cpu");
}

/// What floors are found in: the rows of the first volume, and what copies cost on it.
struct Found {
  const Json& document;
  std::optional<double> bytes_ms = number(document, "/copies/bytes_floor_ms");
  std::optional<double> volume_ms = number(document, "/copies/volume_floor_ms");

  const Json* run(const std::string& field) const {
    return find_row(rows_of(document, "runs"), {{"size", document["size"]}, {"field", field}, {"cell_size", 1}});
  }
};

/// A vertex on every voxel: fields without a fold, and hard ones.
void add_dense(const Found& found, Floors& floors) {
  for (const std::string field : {"identity", "wave", "twist", "bubble", "elastic"}) {
    const Json* run = found.run(field);
    if (!run) continue;
    const auto resample = number(*run, "/resample_ms"), new_field = number(*run, "/new_field_ms");
    floors.at_least("paper / resample", field, number(*run, "/paper_ms"), resample, 6, 15);
    floors.at_least("paper / new field", field, number(*run, "/paper_ms"), new_field, 4, 10);
    floors.at_least("backward / resample", field, number(*run, "/backward_ms"), resample, {}, 1);
    floors.at_most("resample / bytes", field, resample, found.bytes_ms, {}, 2);
    if (const auto two = number(*run, "/two_volumes_ms"))
      floors.at_most("further volume / new field", field, *two - *resample, new_field, 1.0 / 3);
  }
  for (const std::string field : {"noise", "rotation", "folds"})
    if (const Json* run = found.run(field))
      floors.at_least("paper / new field", field, number(*run, "/paper_ms"), number(*run, "/new_field_ms"), 1);
}

/// Either is enough: twice as fast as the fastest global field, or 1.5 times the bytes.
void add_local(const Found& found, Floors& floors) {
  const Json* local = found.run("local");
  if (!local) return;
  const auto ms = number(*local, "/resample_ms");
  const Json* global = nullptr;
  for (const char* field : {"wave", "twist", "elastic"}) {
    const Json* run = found.run(field);
    if (run && (!global || number(*run, "/resample_ms") < number(*global, "/resample_ms"))) global = run;
  }
  if (!global || *ms / *found.bytes_ms <= 1.5)
    floors.at_most("resample / bytes", "local", ms, found.bytes_ms, 1.5);
  else
    floors.at_least((*global)["field"].get<std::string>() + " / local, resample", "local",
                    number(*global, "/resample_ms"), ms, 2);
}

std::string where_of(const Json& run) {
  return run["field"].get<std::string>() + ", cells of " + run["cell_size"].dump();
}

void add_coarse(const Found& found, Floors& floors) {
  for (const Json& run : rows_of(found.document, "runs")) {
    if (run["cell_size"] == 1 || run["size"] != found.document["size"]) continue;
    const auto new_field = number(run, "/new_field_ms");
    floors.at_most("new field / copy", where_of(run), new_field, found.volume_ms, 6, 2);
    if (run["cell_size"] >= kLargeCells)
      floors.at_least("gascon / new field", where_of(run), number(run, "/gascon_ms"), new_field, 1);
  }
  for (const Json& run : rows_of(found.document, "meshes"))
    floors.at_least("gascon / mesh resample", where_of(run), number(run, "/gascon_ms"), number(run, "/resample_ms"), 1);
}

/// N times the slices may cost 5 % more than N times the time.
void add_long(const Found& found, Floors& floors) {
  constexpr double kMore = 1.05;
  const Json& size = found.document["size"];
  for (const Json& run : rows_of(found.document, "runs")) {
    const Json* first = found.run(run["field"]);
    if (run["size"] == size || !first) continue;
    const double limit = kMore * run["size"][2].get<double>() / size[2].get<double>();
    const std::string where = run["field"].get<std::string>() + ", " + run["size"][2].dump() + " / " + size[2].dump();
    floors.at_most("resample, slices", where, number(run, "/resample_ms"), number(*first, "/resample_ms"), limit);
    floors.at_most("new field, slices", where, number(run, "/new_field_ms"), number(*first, "/new_field_ms"), limit);
  }
}

void add_memory(const Found& found, Floors& floors) {
  for (const Json& use : rows_of(found.document, "memory")) {
    const std::string field = use["field"];
    const auto allowed = number(use, "/allowed_bytes");
    floors.at_most("memory / allowed", field + ", host views", number(use, "/host_views_bytes"), allowed, 1);
    floors.at_most("memory / allowed", field + ", device views", number(use, "/device_views_bytes"), allowed, 1);
  }
}

}  // namespace

Json copies_json(const Samples& copies) {
  Json json{{"volume_ms", summary_of(copies, "volume_ms")}, {"field_ms", summary_of(copies, "field_ms")}};
  const double volume = *number(json, "/volume_ms"), field = *number(json, "/field_ms");
  json["volume_floor_ms"] = volume;
  json["bytes_floor_ms"] = volume + field / 2;
  return json;
}

Json memory_json(const std::string& field, const MemoryUse& use) {
  return {{"field", field},
          {"data_bytes", use.data},
          {"allowed_bytes", use.allowed()},
          {"host_views_bytes", use.host_views},
          {"device_views_bytes", use.device_views}};
}

Floors find_gpu_floors(const Json& document) {
  Floors floors;
  for (const auto add : {add_dense, add_local, add_coarse, add_long, add_memory}) add({document}, floors);
  return floors;
}

int run_gpu(const Options& options) {
  const InputOptions& input = options.input;
  require_writable(options.json, {input.path, input.raw});
  require_device(options.device);
  Json document = begin_document("gpu",
                                 {{"frames", options.frames},
                                  {"warmup", options.warmup},
                                  {"fields", options.fields},
                                  {"cell_sizes", options.cell_sizes},
                                  {"slices", input.is_phantom() ? Json(input.slices) : Json(nullptr)}},
                                 describe_machine(options.device, 0), input_kind(input));
  run_on_first(read_input(input, input.slices.front()), options, document);
  if (input.is_phantom() && options.has_field(kLongField)) {
    for (const std::int64_t count : std::span(input.slices).subspan(1)) {
      options.say(std::string(kLongField) + ", " + std::to_string(count) + " slices");
      const Volume<std::int16_t> volume = read_input(input, count);
      const GpuMeasure found = make_gpu_methods(volume, options)->measure(kLongField, 1, {});
      document["runs"].push_back(run_json(volume.geometry.size, kLongField, 1, found));
    }
  }
  return conclude(document, find_gpu_floors(document), options);
}

}  // namespace tetwarp::bench
