// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/cpu/cpu_floors.h"

#include <algorithm>

namespace tetwarp::bench {

namespace {

void add_peer(const std::string& ratio, const std::string& where, const std::optional<PeerTimes>& peer,
              const Summary& ours, std::optional<double> required, std::optional<double> aim,
              std::vector<Floor>& floors) {
  if (peer) floors.push_back({ratio, where, peer->ms.median / ours.median, true, required, aim});
}

/// A field that rests everywhere is held against memory, and so are the slices of a local one that rest. All of a local
/// one is told, and not held against anything.
void add_bytes(const CpuRun& run, std::vector<Floor>& floors) {
  if (!run.bytes_ms || (run.field != "identity" && run.field != "local")) return;
  const std::optional<double> limit = run.field == "identity" ? std::optional(2.0) : std::nullopt;
  const double bytes = run.bytes_ms->median;
  floors.push_back({"new field / bytes", run.field, run.ours.new_field_ms.median / bytes, false, limit, {}});
  floors.push_back({"resample / bytes", run.field, run.ours.resample_ms.median / bytes, false, limit, {}});
  if (!run.resting) return;
  const std::string where = run.field + ", slices at rest";
  const double ratio = run.resting->new_field_ms.median / (run.resting->share * bytes);
  floors.push_back({"new field / bytes", where, ratio, false, 2, {}});
}

/// What a further volume may add to resample: a third of it, or 1.5 ns a voxel, whichever is more.
void add_further(const CpuRun& run, std::vector<Floor>& floors) {
  constexpr double kMsAVoxel = 1.5e-6;
  if (!run.two_ms) return;
  const double first = run.ours.resample_ms.median, voxels = static_cast<double>(run.size.x * run.size.y * run.size.z);
  const double allowed = std::max(first / 3, kMsAVoxel * voxels);
  floors.push_back({"further volume / allowed", run.field, (run.two_ms->median - first) / allowed, false, 1, {}});
}

void add_dense(const CpuResults& results, std::vector<Floor>& floors) {
  for (const CpuRun& run : results.runs) {
    add_peer("paper / new field", run.field, run.paper, run.ours.new_field_ms, 6, 20, floors);
    add_peer("ITK warp / resample", run.field, run.itk_warp, run.ours.resample_ms, 1, 3, floors);
    add_bytes(run, floors);
    add_further(run, floors);
  }
}

/// ITK's inverter stops at once on identity: the ratio is told and not held against anything. That field is held
/// against memory.
void add_slow(const CpuResults& results, std::vector<Floor>& floors) {
  for (const CpuRun& run : results.slow) {
    const std::string where = run.field + ", " + std::to_string(run.size.z) + " slices";
    const Summary& ours = run.ours.new_field_ms;
    const bool inverts = run.field != "identity";
    add_peer("ITK invert and warp / new field", where, run.itk_invert_and_warp, ours,
             inverts ? std::optional(50.0) : std::nullopt, inverts ? std::optional(200.0) : std::nullopt, floors);
    add_peer("VTK probe / new field", where, run.vtk_probe, ours, 20, 60, floors);
  }
}

/// A voxel may cost a quarter more in a large volume than in the smallest, which caches hold in part.
void add_growth(const CpuResults& results, std::vector<Floor>& floors) {
  constexpr double kMore = 1.25;
  for (std::size_t n = 1; n < results.growth.size(); ++n) {
    const CpuRun &run = results.growth[n], &first = results.growth.front();
    const double ratio = ns_a_voxel(run.ours.new_field_ms, run.size) / ns_a_voxel(first.ours.new_field_ms, first.size);
    const std::string where = run.field + ", " + to_string(run.size) + " to " + to_string(first.size);
    floors.push_back({"new field, a voxel", where, ratio, false, kMore, {}});
  }
}

void add_scaling(const CpuResults& results, std::vector<Floor>& floors) {
  if (!results.scaling) return;
  const Scaling& scaling = *results.scaling;
  const std::string where = scaling.field + ", " + std::to_string(scaling.threads) + " threads";
  floors.push_back({"efficiency of threads, new field", where, scaling.efficiency(), true, {}, {}});
}

}  // namespace

std::vector<Floor> find_floors(const CpuResults& results) {
  std::vector<Floor> floors;
  for (const auto add : {add_dense, add_slow, add_growth, add_scaling}) add(results, floors);
  return floors;
}

}  // namespace tetwarp::bench
