// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/itk/itk_report.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "bench/harness/markdown.h"
#include "bench/harness/report.h"
#include "deform/version.h"

namespace tetwarp::bench {

namespace {

using Json = nlohmann::json;

constexpr char kPairsNote[] = R"(## Beside ITK's filters

ITK's / ours. s: Update() of a new filter in a process of its own, inputs in memory, medians in turn. MB: the largest resident
set up to the end of Update() less the resident set before it, so the output and all that is made on the way, but not the
inputs; in brackets the output alone. Error: rms and largest. Of warps: HU, against the source read linearly, in double, at the true
undeformed place, half a voxel or more inside the volume. Of inverses: voxels of the volume, against the true inverse, wherever the undeformed
place lies in the field. Of determinants: against the formula's, where each filter has its values (ours at the deformed
place, ITK's at the undeformed one), a voxel or more inside. Of the B-spline: voxels, against its closed form.

)";

constexpr char kRunsNote[] = R"(## Every filter

ms, median (q1-q3), and CPU ms of all threads. Bytes in MB (10^6); beyond: the inputs, as above. Missing: values that are not finite where there is
a truth.

)";

constexpr char kStreamsNote[] = R"(## In pieces

An .mha file, not compressed, is read, warped and written, as many times in turn as everything else; ms and memory are of all three.
Ours: the forward field with cells of 8; the reader gives slices back behind each piece (ReleaseDataFlagOn). WarpImageFilter: the
inverse with cells of 8; it asks for the whole volume for each piece, so that the reader keeps it. MB: beyond the field. Bytes
that differ from the file that was written whole, in all repeats.

)";

std::string megabytes(std::uint64_t bytes) {
  const double value = 1e-6 * static_cast<double>(bytes);
  return format(value < 10 ? "%.1f" : "%.0f", value);
}

std::string seconds(const Summary& ms) {
  const double value = 1e-3 * ms.median;
  return format(value < 1 ? "%.3f" : (value < 10 ? "%.2f" : "%.1f"), value);
}

std::string errors(const std::optional<Deviation>& found) {
  return found && !std::isnan(found->rms) ? format("%.2g, %.2g", found->rms, found->largest) : "-";
}

std::string introduction(const ItkResults& results) {
  const ItkOptions& options = results.options;
  const auto load = [](const std::array<double, 2>& averages) {
    return format("%.1f, %.1f", averages[0], averages[1]);
  };
  return std::string("# tetwarp-bench itk, ") + version() + " (" + commit() + ")\n\n- CPU: " + results.machine.cpu +
         ", " + std::to_string(results.machine.threads) +
         " threads, the same for everything\n- load averages of 1 and 15 minutes: " + load(results.load_before) +
         " before, " + load(results.load_after) + " after\n- beside it: ITK " + results.itk + "\n- input: phantom, " +
         to_string({options.width, options.width, options.slices}) +
         format(", int16\n- %d repeats, in turn, each in a process of its own\n\n", options.repeats);
}

std::string pair_table(const ItkResults& results) {
  std::string text = kPairsNote + heading({"ITK's filter", "ours", "field, cells", "s", "times", "MB", "error"});
  for (const ItkRun& run : results.runs) {
    const ItkRun* own = run.by.own ? nullptr : find_own(results, run);
    if (!own) continue;
    const std::string unit = itk_task(run.task).unit;
    text +=
        row({run.by.filters, own->by.filters, run.field + ", " + std::to_string(run.cell_size),
             seconds(run.ms) + " / " + seconds(own->ms), format("%.3g", run.ms.median / own->ms.median),
             megabytes(run.peak_bytes) + " / " + megabytes(own->peak_bytes) + " (" + megabytes(own->output_bytes) + ")",
             errors(run.deviation) + " / " + errors(own->deviation) + (unit.empty() ? "" : " " + unit)});
  }
  return text + "\n";
}

std::string run_table(const ItkResults& results) {
  std::string text = kRunsNote + heading({"field, cells", "filter", "ms", "CPU ms", "inputs", "output", "beyond", "rms",
                                          "mean", "largest", "compared", "missing"});
  for (const ItkRun& run : results.runs) {
    std::vector<std::string> cells{run.field + ", " + std::to_string(run.cell_size),
                                   run.by.filters,
                                   cell(run.ms),
                                   cell(run.cpu_ms),
                                   megabytes(run.input_bytes),
                                   megabytes(run.output_bytes),
                                   megabytes(run.peak_bytes)};
    if (const auto& found = run.deviation) {
      for (const double value : {found->rms, found->mean, found->largest}) cells.push_back(format("%.2g", value));
      for (const std::uint64_t count : {found->compared, found->missing}) cells.push_back(std::to_string(count));
    } else {
      cells.resize(cells.size() + 5, "-");
    }
    text += row(cells);
  }
  return text + "\n";
}

std::string stream_table(const ItkResults& results) {
  if (results.streams.empty()) return "";
  std::string text = kStreamsNote + heading({"filter", "pieces", "ms", "CPU ms", "MB", "bytes that differ"});
  for (const ItkStream& stream : results.streams) {
    text += row({stream.by.filters, std::to_string(stream.divisions), cell(stream.ms), cell(stream.cpu_ms),
                 megabytes(stream.peak_bytes), std::to_string(stream.differing_bytes)});
  }
  return text + "\n";
}

Json number_json(double value) { return std::isnan(value) ? Json(nullptr) : Json(value); }

Json to_json(const Deviation& found, const std::string& unit) {
  return {{"unit", unit},
          {"rms", number_json(found.rms)},
          {"mean", number_json(found.mean)},
          {"largest", number_json(found.largest)},
          {"compared", found.compared},
          {"missing", found.missing}};
}

Json to_json(const ItkRun& run) {
  const ItkTask& task = itk_task(run.task);
  return {{"task", run.task},
          {"field", run.field},
          {"cell_size", run.cell_size},
          {"filters", run.by.filters},
          {"own", run.by.own},
          {"ms", to_json(run.ms)},
          {"cpu_ms", to_json(run.cpu_ms)},
          {"input_bytes", run.input_bytes},
          {"output_bytes", run.output_bytes},
          {"peak_bytes_beyond_inputs", run.peak_bytes},
          {"error", run.deviation ? to_json(*run.deviation, task.unit) : Json(nullptr)}};
}

Json to_json(const ItkStream& stream) {
  return {{"filters", stream.by.filters},
          {"own", stream.by.own},
          {"pieces", stream.divisions},
          {"ms", to_json(stream.ms)},
          {"cpu_ms", to_json(stream.cpu_ms)},
          {"peak_bytes_beyond_field", stream.peak_bytes},
          {"differing_bytes", stream.differing_bytes}};
}

Json options_json(const ItkOptions& options) {
  return {{"tasks", options.tasks}, {"fields", options.fields}, {"cell_sizes", options.cell_sizes},
          {"width", options.width}, {"slices", options.slices}, {"repeats", options.repeats}};
}

}  // namespace

nlohmann::json to_json(const ItkResults& results, const std::vector<Floor>& floors) {
  Json runs = Json::array(), streams = Json::array();
  for (const ItkRun& run : results.runs) runs.push_back(to_json(run));
  for (const ItkStream& stream : results.streams) streams.push_back(to_json(stream));
  return {{"program", "tetwarp-bench itk"},
          {"version", version()},
          {"commit", commit()},
          {"options", options_json(results.options)},
          {"machine", to_json(results.machine)},
          {"load_averages", {{"minutes", {1, 15}}, {"before", results.load_before}, {"after", results.load_after}}},
          {"itk", results.itk},
          {"input", input_json("phantom")},
          {"runs", runs},
          {"streams", streams},
          {"floors", to_json(floors)}};
}

std::string to_markdown(const ItkResults& results, const std::vector<Floor>& floors) {
  return introduction(results) + pair_table(results) + run_table(results) + stream_table(results) + to_markdown(floors);
}

}  // namespace tetwarp::bench
