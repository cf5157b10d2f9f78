// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/invert/invert_report.h"

#include <nlohmann/json.hpp>

#include "bench/harness/markdown.h"
#include "bench/harness/report.h"
#include "deform/version.h"

namespace tetwarp::bench {

namespace {

using Json = nlohmann::json;

constexpr char kAccuracyNote[] = R"(## Time and error

ms, median (q1-q3), and CPU ms of all threads. tetwarp: set_field, without the range of Jacobian determinants, and resample
to the inverse alone. ITK invert: InvertDisplacementFieldImageFilter with its defaults; border free: with
EnforceBoundaryCondition off. ITK iterative: IterativeInverseDisplacementFieldImageFilter with its defaults; its iterations
run in one thread. Errors: voxels, distance from the known inverse, over all voxels with a source that have a vector.

)";

constexpr char kSourceNote[] = R"(## Sources

Voxels. With a source: the undeformed place lies in the lattice. Left out: of these, without a vector. Written: vectors of
voxels without a source; of these zero vectors, and vectors to a place in the lattice, from where a warp takes a value.

)";

std::string introduction(const InvertResults& results) {
  const InvertOptions& options = results.options;
  return std::string("# tetwarp-bench invert, ") + version() + " (" + commit() + ")\n\n- CPU: " + results.machine.cpu +
         ", " + std::to_string(results.machine.threads) + " threads, the same for everything\n- beside it: ITK " +
         results.itk.value_or("not in this build, left out") +
         "\n- fields: " + to_string({options.width, options.width, options.slices}) +
         " vertices, one on every voxel\n" + format("- %d timed repeats, in turn\n\n", options.repeats);
}

std::string error_cell(double voxels) { return std::isnan(voxels) ? "-" : format("%.2g", voxels); }

std::string accuracy_table(const InvertResults& results) {
  std::string text =
      kAccuracyNote + heading({"field", "by", "ms", "CPU ms", "mean error", "99 % below", "largest error"});
  for (const InverseRun& run : results.runs) {
    const Accuracy& found = run.accuracy;
    text += row({run.field, run.by, cell(run.ms), cell(run.cpu_ms), error_cell(found.mean),
                 error_cell(found.percentile_99), error_cell(found.largest)});
  }
  return text + "\n";
}

std::string source_table(const InvertResults& results) {
  std::string text = kSourceNote + heading({"field", "by", "with a source", "left out", "without a source", "written",
                                            "zero", "into the lattice"});
  for (const InverseRun& run : results.runs) {
    const Accuracy& found = run.accuracy;
    std::vector<std::string> cells{run.field, run.by};
    for (const std::uint64_t count :
         {found.with_source, found.left_out, found.without_source, found.written, found.zero, found.pointing_in}) {
      cells.push_back(std::to_string(count));
    }
    text += row(cells);
  }
  return text + "\n";
}

Json error_json(double voxels) { return std::isnan(voxels) ? Json(nullptr) : Json(voxels); }

Json to_json(const InverseRun& run) {
  const Accuracy& found = run.accuracy;
  return {{"field", run.field},
          {"by", run.by},
          {"ms", to_json(run.ms)},
          {"cpu_ms", to_json(run.cpu_ms)},
          {"mean_error", error_json(found.mean)},
          {"percentile_99_error", error_json(found.percentile_99)},
          {"largest_error", error_json(found.largest)},
          {"with_source", found.with_source},
          {"left_out", found.left_out},
          {"without_source", found.without_source},
          {"written_without_source", found.written},
          {"zero_without_source", found.zero},
          {"pointing_in_without_source", found.pointing_in}};
}

Json options_json(const InvertOptions& options) {
  return {{"fields", options.fields},
          {"peers", options.peers},
          {"width", options.width},
          {"slices", options.slices},
          {"repeats", options.repeats}};
}

}  // namespace

nlohmann::json to_json(const InvertResults& results, const std::vector<Floor>& floors) {
  Json runs = Json::array();
  for (const InverseRun& run : results.runs) runs.push_back(to_json(run));
  return {{"program", "tetwarp-bench invert"},
          {"version", version()},
          {"commit", commit()},
          {"options", options_json(results.options)},
          {"machine", to_json(results.machine)},
          {"itk", results.itk ? Json(*results.itk) : Json(nullptr)},
          {"runs", runs},
          {"floors", to_json(floors)}};
}

std::string to_markdown(const InvertResults& results, const std::vector<Floor>& floors) {
  return introduction(results) + accuracy_table(results) + source_table(results) + to_markdown(floors);
}

}  // namespace tetwarp::bench
