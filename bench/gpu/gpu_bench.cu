// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/gpu/gpu_bench.h"

#include <algorithm>
#include <span>

#include "bench/gpu/gpu_parts.h"
#include "bench/harness/input.h"
#include "cuda/runtime/check.h"

namespace tetwarp::bench {

namespace {

constexpr const char* kCoarseFields[] = {"wave", "twist", "bubble", "elastic"};
constexpr std::int64_t kMeshCells[] = {16, 32};  ///< tetrahedra of a few dozen voxels a side
constexpr const char* kLongField = "wave";

bool contains(std::span<const std::string> names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// Every field on cells of one voxel, the smooth ones on larger cells.
void run_methods(const Volume<std::int16_t>& volume, GpuResults& results,
                 const std::function<void(const std::string&)>& say) {
  const GpuOptions& options = results.options;
  GpuMethods methods(volume, options);
  for (const std::string& field : options.fields) {
    say(field + ", a vertex on every voxel");
    results.runs.push_back(methods.measure(field, 1, {.paper = true, .backward = true}));
  }
  for (const std::int64_t cell_size : options.cell_sizes) {
    for (const std::string field : kCoarseFields) {
      if (!contains(options.fields, field)) continue;
      say(field + ", cells of " + std::to_string(cell_size));
      results.runs.push_back(methods.measure(field, cell_size, {.paper = true, .gascon = true}));
    }
  }
  for (const std::int64_t cell_size : kMeshCells) {
    for (const std::string field : kCoarseFields) {
      if (!contains(options.fields, field)) continue;
      say(field + ", a mesh, cells of " + std::to_string(cell_size));
      results.meshes.push_back(methods.measure_mesh(field, cell_size));
    }
  }
}

void run_on_first(const Volume<std::int16_t>& volume, GpuResults& results,
                  const std::function<void(const std::string&)>& say) {
  const GpuOptions& options = results.options;
  results.size = volume.geometry.size;
  say("copies");
  results.copies = measure_copies(volume.geometry, options);
  run_methods(volume, results, say);
  std::vector<std::int64_t> cell_sizes = options.cell_sizes;
  cell_sizes.insert(cell_sizes.begin(), 1);
  for (const std::int64_t cell_size : cell_sizes) {
    say("frame after frame, cells of " + std::to_string(cell_size));
    results.loops.push_back(measure_frame_loop(volume, cell_size, options));
  }
  for (const std::string& field : options.fields) {
    say("memory, " + field);
    results.memory.push_back(measure_memory(volume, field, options));
  }
}

}  // namespace

GpuResults measure_gpu(const GpuOptions& options, const std::function<void(const std::string&)>& say) {
  TETWARP_CUDA_TRY(cudaSetDevice(options.device));
  GpuResults results;
  results.options = options;
  const std::vector<std::int64_t>& slices = options.input.slices;
  run_on_first(read_input(options.input, slices.front()), results, say);
  if (!options.input.is_phantom() || !contains(options.fields, kLongField)) return results;
  for (const std::int64_t count : std::span(slices).subspan(1)) {
    say(std::string(kLongField) + ", " + std::to_string(count) + " slices");
    const Volume<std::int16_t> volume = read_input(options.input, count);
    results.runs.push_back(GpuMethods(volume, options).measure(kLongField, 1, {}));
  }
  return results;
}

}  // namespace tetwarp::bench
