// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/cpu/cpu_bench.h"

#include <algorithm>
#include <span>

#include "bench/cpu/cpu_methods.h"
#include "bench/harness/input.h"
#include "bench/harness/machine.h"
#include "bench/peers/peers.h"

namespace tetwarp::bench {

namespace {

constexpr const char* kCoarseFields[] = {"wave", "twist", "bubble", "elastic"};
constexpr const char* kRestingField = "local";
constexpr const char* kGrowingField = "wave";

using Say = std::function<void(const std::string&)>;

bool contains(std::span<const std::string> names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

Volume<std::int16_t> make_volume(const glm::i64vec3& size) {
  Volume<std::int16_t> volume = read_input({.width = size.x}, size.z);
  require(volume.geometry.size == size,
          "the phantom is " + to_string(volume.geometry.size) + ", not what was asked for");
  return volume;
}

void run_on_whole(const Volume<std::int16_t>& volume, CpuResults& results, const Say& say) {
  const CpuOptions& options = results.options;
  const int threads = results.machine.threads;
  for (const std::string& field : options.fields) {
    say(field + ", a vertex on every voxel");
    const bool peers = field != kRestingField;
    const Beside beside{.second_volume = true,
                        .bytes = true,
                        .paper = peers && contains(options.peers, "paper"),
                        .itk_warp = peers && contains(options.peers, "itk-warp")};
    results.runs.push_back(measure_run(volume, {field}, beside, threads, options.repeats));
  }
  for (const std::int64_t cell_size : options.cell_sizes) {
    for (const std::string field : kCoarseFields) {
      if (!contains(options.fields, field)) continue;
      say(field + ", cells of " + std::to_string(cell_size));
      results.coarse.push_back(measure_run(volume, {field, cell_size}, {}, threads, options.repeats));
    }
  }
  if (threads > 1 && contains(options.fields, kGrowingField)) {
    say(std::string(kGrowingField) + ", one thread and all");
    results.scaling = measure_scaling(volume, kGrowingField, threads, options.repeats);
  }
}

void run_slow(CpuResults& results, const Say& say) {
  const CpuOptions& options = results.options;
  const Beside beside{.itk_invert_and_warp = contains(options.peers, "itk-invert") && results.itk,
                      .vtk_probe = contains(options.peers, "vtk-probe") && results.vtk};
  if (!beside.itk_invert_and_warp && !beside.vtk_probe) return;
  const Volume<std::int16_t> volume = make_volume({options.width, options.width, options.slow_slices});
  for (const std::string& field : options.fields) {
    if (field == kRestingField) continue;
    say(field + ", slow peers, " + to_string(volume.geometry.size));
    const FieldOnLattice middle{.name = field, .like = glm::i64vec3(options.width, options.width, options.slices)};
    results.slow.push_back(measure_run(volume, middle, beside, results.machine.threads, options.repeats));
  }
}

/// Field, source, Tetwarp's output and that of the bytes moved, a tenth more for the rest.
bool fits_memory(const glm::i64vec3& size) {
  constexpr double kBytesAVoxel = 1.1 * (sizeof(glm::vec3) + 3 * sizeof(std::int16_t));
  const double voxels = static_cast<double>(size.x) * static_cast<double>(size.y) * static_cast<double>(size.z);
  return kBytesAVoxel * voxels < static_cast<double>(available_bytes());
}

/// Of 512 columns: 128^3, 256^3, and the slices asked for once and twice.
void run_growth(CpuResults& results, const Say& say) {
  const CpuOptions& options = results.options;
  if (!contains(options.fields, kGrowingField)) return;
  const std::int64_t width = options.width, quarter = width / 4, half = width / 2;
  for (const glm::i64vec3& size : {glm::i64vec3(quarter),
                                   glm::i64vec3(half),
                                   {width, width, options.slices},
                                   {width, width, 2 * options.slices}}) {
    if (!fits_memory(size)) {
      results.left_out.push_back(size);
      continue;
    }
    say(std::string(kGrowingField) + ", " + to_string(size));
    results.growth.push_back(
        measure_run(make_volume(size), {kGrowingField}, {.bytes = true}, results.machine.threads, options.repeats));
  }
}

}  // namespace

CpuResults measure_cpu(const CpuOptions& options, const std::function<void(const std::string&)>& say) {
  CpuResults results;
  results.options = options;
  results.machine = describe_machine(-1, options.threads);
  results.itk = itk_version();
  results.vtk = vtk_version();
  run_on_whole(make_volume({options.width, options.width, options.slices}), results, say);
  run_slow(results, say);
  run_growth(results, say);
  return results;
}

}  // namespace tetwarp::bench
