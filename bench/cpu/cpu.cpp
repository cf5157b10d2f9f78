// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/cpu/cpu.h"

#include <algorithm>

#include "bench/harness/files.h"
#include "bench/harness/input.h"
#include "bench/peers/peers.h"

namespace tetwarp::bench {

namespace {

constexpr const char* kRestingField = "local";
constexpr const char* kGrowingField = "wave";

std::string text(const Json& row, const char* name) { return row[name].get<std::string>(); }

glm::i64vec3 size_of(const Json& row) { return {row["size"][0], row["size"][1], row["size"][2]}; }

Volume<std::int16_t> make_volume(const glm::i64vec3& size) {
  Volume<std::int16_t> volume = read_input({.width = size.x}, size.z);
  require(volume.geometry.size == size,
          "the phantom is " + to_string(volume.geometry.size) + ", not what was asked for");
  return volume;
}

void run_on_whole(const Options& options, int threads, Json& document) {
  const Volume<std::int16_t> volume = make_volume(options.input.phantom_size());
  for (const std::string& field : options.fields) {
    options.say(field + ", a vertex on every voxel");
    const bool peers = field != kRestingField;
    const Beside beside{.second_volume = true,
                        .bytes = true,
                        .paper = peers && options.has_peer("paper"),
                        .itk_warp = peers && options.has_peer("itk-warp")};
    document["runs"].push_back(measure_run(volume, {field}, beside, threads, options.repeats));
  }
  for (const std::int64_t cell_size : options.cell_sizes) {
    for (const std::string field : {"wave", "twist", "bubble", "elastic"}) {
      if (!options.has_field(field)) continue;
      options.say(field + ", cells of " + std::to_string(cell_size));
      document["larger_cells"].push_back(measure_run(volume, {field, cell_size}, {}, threads, options.repeats));
    }
  }
  if (threads == 1 || !options.has_field(kGrowingField)) return;
  options.say(std::string(kGrowingField) + ", one thread and all");
  document["scaling"] = measure_scaling(volume, kGrowingField, threads, options.repeats);
}

void run_slow(const Options& options, int threads, Json& document) {
  const Beside beside{.itk_invert_and_warp = options.has_peer("itk-invert") && itk_version(),
                      .vtk_probe = options.has_peer("vtk-probe") && vtk_version()};
  if (!beside.itk_invert_and_warp && !beside.vtk_probe) return;
  const std::int64_t width = options.input.width;
  const Volume<std::int16_t> volume = make_volume({width, width, options.slow_slices});
  for (const std::string& field : options.fields) {
    if (field == kRestingField) continue;
    options.say(field + ", slow peers, " + to_string(volume.geometry.size));
    const FieldOnLattice middle{.name = field, .like = options.input.phantom_size()};
    document["slow_peers"].push_back(measure_run(volume, middle, beside, threads, options.repeats));
  }
}

/// Field, source, Tetwarp's output and that of the bytes moved, a tenth more for the rest.
bool fits_memory(const glm::i64vec3& size) {
  constexpr double kBytesAVoxel = 1.1 * (sizeof(glm::vec3) + 3 * sizeof(std::int16_t));
  return kBytesAVoxel * static_cast<double>(voxel_count({.size = size})) < static_cast<double>(available_bytes());
}

/// Of 512 columns: 128^3, 256^3, and the slices asked for once and twice.
void run_growth(const Options& options, int threads, Json& document) {
  if (!options.has_field(kGrowingField)) return;
  const glm::i64vec3 whole = options.input.phantom_size();
  for (const glm::i64vec3& size :
       {glm::i64vec3(whole.x / 4), glm::i64vec3(whole.x / 2), whole, {whole.x, whole.x, 2 * whole.z}}) {
    if (!fits_memory(size)) {
      document["growth_left_out"].push_back(size_json(size));
      continue;
    }
    options.say(std::string(kGrowingField) + ", " + to_string(size));
    document["growth"].push_back(
        measure_run(make_volume(size), {kGrowingField}, {.bytes = true}, threads, options.repeats));
  }
}

/// A field that rests everywhere is held against memory, and so are the slices of a local one that rest. All of a local
/// one is told, and not held against anything.
void add_bytes(const Json& run, Floors& floors) {
  const std::string field = text(run, "field");
  if (field != "identity" && field != "local") return;
  const Floors::Limit limit = field == "identity" ? Floors::Limit(2) : std::nullopt;
  const auto bytes = number(run, "/bytes_ms"), share = number(run, "/resting/share");
  floors.at_most("new field / bytes", field, number(run, "/new_field_ms"), bytes, limit);
  floors.at_most("resample / bytes", field, number(run, "/resample_ms"), bytes, limit);
  if (share && bytes)
    floors.at_most("new field / bytes", field + ", slices at rest", number(run, "/resting/new_field_ms"),
                   *share * *bytes, 2);
}

/// What a further volume may add to resample: a third of it, or 1.5 ns a voxel, whichever is more.
void add_further(const Json& run, Floors& floors) {
  constexpr double kMsAVoxel = 1.5e-6;
  const auto two = number(run, "/two_volumes_ms"), first = number(run, "/resample_ms");
  if (!two) return;
  const double voxels = static_cast<double>(voxel_count({.size = size_of(run)}));
  floors.at_most("further volume / allowed", text(run, "field"), *two - *first,
                 std::max(*first / 3, kMsAVoxel * voxels), 1);
}

/// ITK's inverter stops at once on identity: the ratio is told and not held against anything. That field is held
/// against memory.
void add_slow(const Json& run, Floors& floors) {
  const std::string where = text(run, "field") + ", " + run["size"][2].dump() + " slices";
  const auto ours = number(run, "/new_field_ms");
  const auto if_it_inverts = [&](double limit) {
    return text(run, "field") == "identity" ? std::nullopt : Floors::Limit(limit);
  };
  floors.at_least("ITK invert and warp / new field", where, number(run, "/itk_invert_and_warp/ms"), ours,
                  if_it_inverts(50), if_it_inverts(200));
  floors.at_least("VTK probe / new field", where, number(run, "/vtk_probe/ms"), ours, 20, 60);
}

/// A voxel may cost a quarter more in a large volume than in the smallest, which caches hold in part.
void add_growth(const Json& run, const Json& first, Floors& floors) {
  floors.at_most("new field, a voxel",
                 text(run, "field") + ", " + to_string(size_of(run)) + " to " + to_string(size_of(first)),
                 number(run, "/new_field_ns_a_voxel"), number(first, "/new_field_ns_a_voxel"), 1.25);
}

}  // namespace

Floors find_cpu_floors(const Json& document) {
  Floors floors;
  for (const Json& run : rows_of(document, "runs")) {
    const std::string field = text(run, "field");
    floors.at_least("paper / new field", field, number(run, "/paper/ms"), number(run, "/new_field_ms"), 6, 20);
    floors.at_least("ITK warp / resample", field, number(run, "/itk_warp/ms"), number(run, "/resample_ms"), 1, 3);
    add_bytes(run, floors);
    add_further(run, floors);
  }
  for (const Json& run : rows_of(document, "slow_peers")) add_slow(run, floors);
  const Json& growth = rows_of(document, "growth");
  for (std::size_t n = 1; n < growth.size(); ++n) add_growth(growth[n], growth[0], floors);
  if (const auto efficiency = number(document, "/scaling/efficiency")) {
    const Json& scaling = document["scaling"];
    floors.at_least("efficiency of threads, new field",
                    text(scaling, "field") + ", " + scaling["threads"].dump() + " threads", efficiency, 1, {});
  }
  return floors;
}

int run_cpu(const Options& options) {
  require_writable(options.json);
  const Json machine = describe_machine(-1, options.threads);
  const auto or_null = [](const std::optional<std::string>& name) { return name ? Json(*name) : Json(nullptr); };
  Json document = begin_document("cpu",
                                 {{"fields", options.fields},
                                  {"peers", options.peers},
                                  {"cell_sizes", options.cell_sizes},
                                  {"width", options.input.width},
                                  {"slices", options.input.slices.front()},
                                  {"slow_slices", options.slow_slices},
                                  {"repeats", options.repeats}},
                                 machine, "phantom");
  document["itk"] = or_null(itk_version());
  document["vtk"] = or_null(vtk_version());
  for (const char* list : {"runs", "slow_peers", "larger_cells", "growth", "growth_left_out"})
    document[list] = Json::array();
  document["scaling"] = nullptr;
  for (const auto run : {run_on_whole, run_slow, run_growth}) run(options, machine["threads"], document);
  return conclude(document, find_cpu_floors(document), options);
}

}  // namespace tetwarp::bench
