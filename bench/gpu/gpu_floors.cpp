// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/gpu/gpu_floors.h"

namespace tetwarp::bench {

namespace {

constexpr const char* kSmooth[] = {"identity", "wave", "twist", "bubble", "elastic"};
constexpr const char* kGlobal[] = {"wave", "twist", "elastic"};
constexpr const char* kHard[] = {"noise", "rotation", "folds"};
constexpr std::int64_t kLargeCells = 16;

const GpuRun* find_run(const GpuResults& results, const std::string& field, std::int64_t cell_size = 1) {
  for (const GpuRun& run : results.runs) {
    if (run.size == results.size && run.field == field && run.cell_size == cell_size) return &run;
  }
  return nullptr;
}

/// A vertex on every voxel, fields without a fold.
void add_dense(const GpuResults& results, std::vector<Floor>& floors) {
  for (const std::string field : kSmooth) {
    const GpuRun* run = find_run(results, field);
    if (!run) continue;
    const double resample = run->resample_ms.median, new_field = run->new_field_ms.median;
    if (run->paper_ms) {
      floors.push_back({"paper / resample", field, run->paper_ms->median / resample, true, 6, 15});
      floors.push_back({"paper / new field", field, run->paper_ms->median / new_field, true, 4, 10});
    }
    if (run->backward_ms) {
      floors.push_back({"backward / resample", field, run->backward_ms->median / resample, true, {}, 1});
    }
    floors.push_back({"resample / bytes", field, resample / results.copies.bytes_floor_ms(), false, {}, 2});
    floors.push_back(
        {"further volume / new field", field, (run->two_ms.median - resample) / new_field, false, 1.0 / 3, {}});
  }
}

void add_coarse(const GpuResults& results, std::vector<Floor>& floors) {
  for (const GpuRun& run : results.runs) {
    if (run.cell_size == 1 || run.size != results.size) continue;
    const std::string where = run.field + ", cells of " + std::to_string(run.cell_size);
    const double new_field = run.new_field_ms.median;
    floors.push_back({"new field / copy", where, new_field / results.copies.volume_floor_ms(), false, 6, 2});
    if (run.cell_size >= kLargeCells && run.gascon_ms) {
      floors.push_back({"gascon / new field", where, run.gascon_ms->median / new_field, true, 1, {}});
    }
  }
}

void add_meshes(const GpuResults& results, std::vector<Floor>& floors) {
  for (const MeshRun& run : results.meshes) {
    floors.push_back({"gascon / mesh resample",
                      run.field + ", cells of " + std::to_string(run.cell_size),
                      run.gascon_ms.median / run.resample_ms.median,
                      true,
                      1,
                      {}});
  }
}

/// Twice the slices may cost 5 % more than twice the time; other lengths likewise.
void add_long(const GpuResults& results, std::vector<Floor>& floors) {
  constexpr double kMore = 1.05;
  for (const GpuRun& run : results.runs) {
    if (run.size == results.size) continue;
    const GpuRun* first = find_run(results, run.field);
    if (!first) continue;
    const double limit = kMore * static_cast<double>(run.size.z) / static_cast<double>(results.size.z);
    const std::string where = run.field + ", " + std::to_string(run.size.z) + " / " + std::to_string(results.size.z);
    floors.push_back({"resample, slices", where, run.resample_ms.median / first->resample_ms.median, false, limit, {}});
    floors.push_back(
        {"new field, slices", where, run.new_field_ms.median / first->new_field_ms.median, false, limit, {}});
  }
}

/// Either is enough: twice as fast as the fastest global field, or 1.5 times the bytes.
void add_local(const GpuResults& results, std::vector<Floor>& floors) {
  const GpuRun* local = find_run(results, "local");
  if (!local) return;
  const double ms = local->resample_ms.median;
  const Floor bytes{"resample / bytes", "local", ms / results.copies.bytes_floor_ms(), false, 1.5, {}};
  const GpuRun* global = nullptr;
  for (const std::string field : kGlobal) {
    const GpuRun* run = find_run(results, field);
    if (run && (!global || run->resample_ms.median < global->resample_ms.median)) global = run;
  }
  if (!global || bytes.meets(*bytes.required)) {
    floors.push_back(bytes);
  } else {
    floors.push_back({global->field + " / local, resample", "local", global->resample_ms.median / ms, true, 2, {}});
  }
}

void add_hard(const GpuResults& results, std::vector<Floor>& floors) {
  for (const std::string field : kHard) {
    const GpuRun* run = find_run(results, field);
    if (!run || !run->paper_ms) continue;
    floors.push_back({"paper / new field", field, run->paper_ms->median / run->new_field_ms.median, true, 1, {}});
  }
}

void add_memory(const GpuResults& results, std::vector<Floor>& floors) {
  for (const MemoryUse& use : results.memory) {
    const auto allowed = static_cast<double>(use.allowed());
    floors.push_back(
        {"memory / allowed", use.field + ", host views", static_cast<double>(use.host_views) / allowed, false, 1, {}});
    floors.push_back({"memory / allowed",
                      use.field + ", device views",
                      static_cast<double>(use.device_views) / allowed,
                      false,
                      1,
                      {}});
  }
}

}  // namespace

std::vector<Floor> find_floors(const GpuResults& results) {
  std::vector<Floor> floors;
  for (const auto add : {add_dense, add_hard, add_local, add_coarse, add_meshes, add_long, add_memory})
    add(results, floors);
  return floors;
}

}  // namespace tetwarp::bench
