// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/cpu/cpu_report.h"
#include "bench/harness/markdown.h"
#include "deform/version.h"

namespace tetwarp::bench {

namespace {

constexpr char kFieldsNote[] = R"(## A vertex on every voxel

ms, median (q1-q3). New field is set_field (with the range of Jacobian determinants) and resample. Bytes: reading field
and source once and writing the output once, plain copies on the same threads. Paper: Algorithm 2, field in memory. ITK
warp: WarpImageFilter, given the inverse. Further volume: what a second int16 volume adds to resample.

)";

constexpr char kRatiosNote[] = R"(## Against the paper, ITK and memory

"Differ": part of the voxels covered by Tetwarp whose values differ by more than 1. ITK truncates where Tetwarp rounds;
the paper's method leaves voxels out.

)";

constexpr char kSlowNote[] = R"(## Slow peers

On fewer slices, under the middle of the same fields; the peers once, Tetwarp on this volume too. ms, and ns a voxel. ITK invert and warp:
InvertDisplacementFieldImageFilter with its defaults, then WarpImageFilter. VTK probe: vtkProbeFilter on the deformed
vtkStructuredGrid. "Differ" as above.

)";

constexpr char kCoarseNote[] = R"(## Larger cells

)";

constexpr char kGrowthNote[] = R"(## From small to large

)";

constexpr char kScalingNote[] = R"(## Threads

Efficiency: the time on one thread, over the time on all times their number.

)";

std::string peer_text(const char* name, const std::optional<std::string>& version) {
  return std::string(name) + " " + version.value_or("not in this build, left out");
}

std::string introduction(const CpuResults& results) {
  const CpuOptions& options = results.options;
  return std::string("# tetwarp-bench cpu, ") + version() + " (" + commit() + ")\n\n- CPU: " + results.machine.cpu +
         ", " + std::to_string(results.machine.threads) +
         " threads, the same for everything\n- beside it: " + peer_text("ITK", results.itk) + "; " +
         peer_text("VTK", results.vtk) + "\n- input: phantom, " +
         to_string({options.width, options.width, options.slices}) + ", int16, linear interpolation\n" +
         format("- %d timed repeats, in turn\n\n", options.repeats);
}

std::string ns_cell(const Summary& ms, const glm::i64vec3& size) { return format("%.2f", ns_a_voxel(ms, size)); }

std::string ms_cell(const std::optional<PeerTimes>& peer) {
  return cell(peer ? std::optional(peer->ms) : std::nullopt);
}

std::string ratio_cell(const std::optional<PeerTimes>& peer, const Summary& ours) {
  return cell(peer ? std::optional(peer->ms.median / ours.median) : std::nullopt);
}

std::string differing_cell(const std::optional<PeerTimes>& peer) {
  return peer ? format("%.3f %%", 100 * peer->differing) : "-";
}

std::string bytes_cell(const Summary& ours, const std::optional<Summary>& bytes) {
  return cell(bytes ? std::optional(ours.median / bytes->median) : std::nullopt);
}

std::string further_cell(const CpuRun& run) {
  return cell(run.two_ms ? std::optional(run.two_ms->median - run.ours.resample_ms.median) : std::nullopt);
}

std::string dense_table(const CpuResults& results) {
  std::string text = kFieldsNote + heading({"field", "at rest", "set_field", "resample", "new field",
                                            "new field, ns a voxel", "further volume", "bytes", "paper", "ITK warp"});
  for (const CpuRun& run : results.runs) {
    text += row({run.field, format("%.1f %%", 100 * run.at_rest), cell(run.ours.set_field_ms),
                 cell(run.ours.resample_ms), cell(run.ours.new_field_ms), ns_cell(run.ours.new_field_ms, run.size),
                 further_cell(run), cell(run.bytes_ms), ms_cell(run.paper), ms_cell(run.itk_warp)});
  }
  for (const CpuRun& run : results.runs) {
    if (!run.resting) continue;
    text +=
        format(
            "\n%s: %.1f %% of the slices rest, and so do those beside them. Resampling these, and set_field of them ",
            run.field.c_str(), 100 * run.resting->share) +
        "alone: " + cell(run.resting->new_field_ms) + " ms.\n";
  }
  return text + "\n";
}

std::string ratio_table(const CpuResults& results) {
  std::string text = kRatiosNote + heading({"field", "paper / new field", "ITK warp / resample", "new field / bytes",
                                            "resample / bytes", "paper: differ", "ITK warp: differ"});
  for (const CpuRun& run : results.runs) {
    const OwnTimes& ours = run.ours;
    text += row({run.field, ratio_cell(run.paper, ours.new_field_ms), ratio_cell(run.itk_warp, ours.resample_ms),
                 bytes_cell(ours.new_field_ms, run.bytes_ms), bytes_cell(ours.resample_ms, run.bytes_ms),
                 differing_cell(run.paper), differing_cell(run.itk_warp)});
  }
  return text + "\n";
}

std::string slow_peer_row(const CpuRun& run, const char* name, const std::optional<PeerTimes>& peer) {
  if (!peer) return "";
  const Summary& ours = run.ours.new_field_ms;
  return row({run.field, to_string(run.size), name, format("%.0f", peer->ms.median), ns_cell(peer->ms, run.size),
              cell(ours), ns_cell(ours, run.size), ratio_cell(peer, ours), differing_cell(peer)});
}

std::string slow_table(const CpuResults& results) {
  std::string rows;
  for (const CpuRun& run : results.slow) {
    rows += slow_peer_row(run, "ITK invert and warp", run.itk_invert_and_warp) +
            slow_peer_row(run, "VTK probe", run.vtk_probe);
  }
  if (rows.empty()) return "";
  return kSlowNote +
         heading({"field", "size", "peer", "ms", "ns a voxel", "new field, ms", "new field, ns a voxel",
                  "peer / new field", "differ"}) +
         rows + "\n";
}

std::string coarse_table(const CpuResults& results) {
  std::string rows;
  for (const CpuRun& run : results.coarse) {
    rows += row({run.field, std::to_string(run.cell_size), cell(run.ours.set_field_ms), cell(run.ours.resample_ms),
                 cell(run.ours.new_field_ms), ns_cell(run.ours.new_field_ms, run.size)});
  }
  if (rows.empty()) return "";
  return kCoarseNote + heading({"field", "cell", "set_field", "resample", "new field", "new field, ns a voxel"}) +
         rows + "\n";
}

std::string growth_table(const CpuResults& results) {
  std::string rows;
  for (const CpuRun& run : results.growth) {
    const OwnTimes& ours = run.ours;
    rows +=
        row({run.field, to_string(run.size), ns_cell(ours.set_field_ms, run.size), ns_cell(ours.resample_ms, run.size),
             ns_cell(ours.new_field_ms, run.size), run.bytes_ms ? ns_cell(*run.bytes_ms, run.size) : "-"});
  }
  if (rows.empty()) return "";
  std::string text =
      kGrowthNote + heading({"field", "size", "set_field, ns a voxel", "resample", "new field", "bytes"}) + rows;
  for (const glm::i64vec3& size : results.left_out) {
    text += "\nLeft out, " + to_string(size) + ": not enough memory is free.\n";
  }
  return text + "\n";
}

std::string scaling_table(const CpuResults& results) {
  if (!results.scaling) return "";
  const Scaling& scaling = *results.scaling;
  const auto line = [](int threads, const OwnTimes& times) {
    return row({std::to_string(threads), cell(times.set_field_ms), cell(times.resample_ms), cell(times.new_field_ms)});
  };
  return kScalingNote + heading({scaling.field + ", threads", "set_field", "resample", "new field"}) +
         line(1, scaling.one) + line(scaling.threads, scaling.all) +
         format("\nEfficiency of a new field: %.2f.\n\n", scaling.efficiency());
}

}  // namespace

std::string to_markdown(const CpuResults& results, const std::vector<Floor>& floors) {
  return introduction(results) + dense_table(results) + ratio_table(results) + slow_table(results) +
         coarse_table(results) + growth_table(results) + scaling_table(results) + to_markdown(floors);
}

}  // namespace tetwarp::bench
