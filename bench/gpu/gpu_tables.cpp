// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/gpu/gpu_report.h"
#include "bench/harness/markdown.h"
#include "deform/version.h"

namespace tetwarp::bench {

namespace {

constexpr char kFieldsNote[] = R"(## A vertex on every voxel

ms, median (q1-q3). New field is set_field and resample. Paper: Algorithm 2, field in memory. Backward: a warp that is
given the inverse, float3 coordinates in memory, trilinear. Further volume: what a second int16 volume adds to resample.

)";

constexpr char kCoarseNote[] = R"(## Larger cells

)";

constexpr char kMeshNote[] = R"(## Meshes

The tetrahedra of a field with large cells, given as a mesh on the host: set_field snaps and checks it there, uploads it
and lists its tetrahedra, for what lies outside is background.

)";

constexpr char kLongNote[] = R"(## Other lengths

)";

constexpr char kLoopNote[] = R"(## Frames per second

One resampler, an elastic field of another amplitude in every frame. Kernels: all data on the device. With copies: fields
from pinned host memory and outputs into it while kernels run, the source stays. Copies alone: the same without kernels.
Host views: source, field and output in pageable host memory, as a program without CUDA calls it.

)";

constexpr char kMemoryNote[] = R"(## Memory

MB (10^6 bytes). Data: source, field and output. Allowed: 10 % or 128 MB more. Host views: most that a resampler holds
on the device, given all of it on the host. Device views: most that it holds beside data that the caller has there.

)";

std::string introduction(const GpuResults& results) {
  const GpuOptions& options = results.options;
  return std::string("# tetwarp-bench gpu, ") + version() + " (" + commit() +
         ")\n\n- CUDA: " + cuda_text(results.machine) + "\n- host: " + results.machine.cpu + ", " +
         std::to_string(results.machine.threads) + " threads\n- input: " + results.input_kind + ", " +
         to_string(results.size) + ", int16, linear interpolation in float\n" +
         format("- %d timed frames after %d\n", options.frames, options.warmup) + "- copy on the device, ms: volume " +
         cell(results.copies.volume_ms) + ", field " + cell(results.copies.field_ms) +
         format("\n- floors, ms: source and output %.3f, source, field and output %.3f\n\n",
                results.copies.volume_floor_ms(), results.copies.bytes_floor_ms());
}

std::optional<double> ratio(const std::optional<Summary>& other, const Summary& ours) {
  return other ? std::optional(other->median / ours.median) : std::nullopt;
}

std::string further_cell(const GpuRun& run) { return format("%.3f", run.two_ms.median - run.resample_ms.median); }

std::string dense_table(const GpuResults& results) {
  std::string text =
      kFieldsNote + heading({"field", "at rest", "set_field", "resample", "new field", "further volume", "paper",
                             "backward", "paper / resample", "paper / new field", "resample / bytes"});
  for (const GpuRun& run : results.runs) {
    if (run.cell_size != 1 || run.size != results.size) continue;
    text += row({run.field, format("%.1f %%", 100 * run.at_rest), cell(run.set_field_ms), cell(run.resample_ms),
                 cell(run.new_field_ms), further_cell(run), cell(run.paper_ms), cell(run.backward_ms),
                 cell(ratio(run.paper_ms, run.resample_ms)), cell(ratio(run.paper_ms, run.new_field_ms)),
                 format("%.2f", run.resample_ms.median / results.copies.bytes_floor_ms())});
  }
  return text + "\n";
}

std::string coarse_table(const GpuResults& results) {
  std::string rows;
  for (const GpuRun& run : results.runs) {
    if (run.cell_size == 1) continue;
    rows += row({run.field, std::to_string(run.cell_size), cell(run.set_field_ms), cell(run.resample_ms),
                 cell(run.new_field_ms), further_cell(run), cell(run.paper_ms), cell(run.gascon_ms),
                 format("%.2f", run.new_field_ms.median / results.copies.volume_floor_ms())});
  }
  if (rows.empty()) return "";
  return kCoarseNote +
         heading({"field", "cell", "set_field", "resample", "new field", "further volume", "paper", "gascon",
                  "new field / copy"}) +
         rows + "\n";
}

std::string mesh_table(const GpuResults& results) {
  if (results.meshes.empty()) return "";
  std::string text =
      kMeshNote + heading({"field", "cell", "tetrahedra", "set_field", "resample", "gascon", "gascon / resample"});
  for (const MeshRun& run : results.meshes) {
    text += row({run.field, std::to_string(run.cell_size), std::to_string(run.tetrahedra), cell(run.set_field_ms),
                 cell(run.resample_ms), cell(run.gascon_ms),
                 format("%.2f", run.gascon_ms.median / run.resample_ms.median)});
  }
  return text + "\n";
}

std::string long_table(const GpuResults& results) {
  std::string rows;
  for (const GpuRun& run : results.runs) {
    if (run.size == results.size) continue;
    rows +=
        row({to_string(run.size), run.field, cell(run.set_field_ms), cell(run.resample_ms), cell(run.new_field_ms)});
  }
  if (rows.empty()) return "";
  return kLongNote + heading({"size", "field", "set_field", "resample", "new field"}) + rows + "\n";
}

std::string loop_table(const GpuResults& results) {
  std::string text = kLoopNote + heading({"cell", "kernels", "with copies", "copies alone", "host views"});
  for (const FrameLoop& loop : results.loops) {
    text += row({std::to_string(loop.cell_size), format("%.1f", loop.kernels), format("%.1f", loop.with_copies),
                 format("%.1f", loop.copies_alone), format("%.1f", loop.host_views)});
  }
  return text + "\n";
}

std::string memory_table(const GpuResults& results) {
  const auto mb = [](std::uint64_t bytes) { return format("%.1f", static_cast<double>(bytes) / 1e6); };
  std::string text = kMemoryNote + heading({"field", "data", "allowed", "host views", "device views"});
  for (const MemoryUse& use : results.memory) {
    text += row({use.field, mb(use.data), mb(use.allowed()), mb(use.host_views), mb(use.device_views)});
  }
  return text + "\n";
}

}  // namespace

std::string to_markdown(const GpuResults& results, const std::vector<Floor>& floors) {
  return introduction(results) + dense_table(results) + coarse_table(results) + mesh_table(results) +
         long_table(results) + loop_table(results) + memory_table(results) + to_markdown(floors);
}

}  // namespace tetwarp::bench
