// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/paper/tables.h"

#include <span>

#include "bench/harness/markdown.h"
#include "bench/harness/report.h"
#include "bench/paper/published.h"
#include "bench/paper/published_tables.h"
#include "deform/version.h"

namespace tetwarp::bench {

namespace {

constexpr char kSpeedNote[] = R"(
ms, median (q1-q3). Speed-ups are against the first method, with the field from the same place. Tetwarp's time is
set_field and resample, for kernel with the formula before them; "resample alone" is part of it.

)";

constexpr char kSizeNote[] = R"(## Table 4: the sizes

ms, median (q1-q3). Tetwarp with set_field.

)";

constexpr char kCoarseNote[] = R"(## Larger cells

ms, median (q1-q3). A vertex every few voxels, as simulators have them.

)";

constexpr char kEndToEndNote[] = R"(## From the host's memory and back

ms, median (q1-q3), wall clock, pageable memory. Copy in: the source, and the field where it is in memory. End to end:
copies, clearing the output, and the method (Tetwarp: set_field too).

)";

constexpr char kQualityNote[] = R"(## What the results are worth

Against Tetwarp's result, which gives every voxel one owner by an exact rule. Lost: covered, and never written. Spilled:
written, and not covered: on the border of the deformed volume, where the closed test takes both sides, and (cells of
several voxels) where the last cells reach more than half a voxel beyond the volume, which the texture clamps.
Differences in stored units, over voxels both covered and written.

)";

constexpr char kAppendixNote[] = R"(## Appendix A: the determinant far from the origin

The corners of the paper's Eq. 8, its order of operations, and others that a compiler or a reader may take, since the paper
names neither its compiler nor its flags. )";

std::string size_text(const Run& run) { return to_string(run.size); }

/// One run a volume, field and lattice, in the order in which they were run.
std::vector<const Run*> cases(const Results& results, bool coarse) {
  std::vector<const Run*> found;
  for (const Run& run : results.runs) {
    if ((run.cell_size > 1) != coarse) continue;
    if (!found.empty() && found.back()->size == run.size && found.back()->field == run.field &&
        found.back()->cell_size == run.cell_size) {
      continue;
    }
    found.push_back(&run);
  }
  return found;
}

/// What of a run a column shows.
std::optional<Summary> time_of(const Run* run, bool with_field) {
  if (!run) return {};
  return with_field ? run->total_ms : run->kernel_ms;
}

/// The rows of one case: a method each, two for Tetwarp; both field sources, each with its speed-up.
std::string method_rows(const Results& results, const Run& like, std::span<const Method> methods,
                        const std::vector<std::string>& labels, std::optional<Method> than) {
  std::string text;
  for (const Method method : methods) {
    const Run* sources[] = {find_run(results, like, method, FieldSource::kernel),
                            find_run(results, like, method, FieldSource::memory)};
    if (!sources[0] && !sources[1]) continue;
    for (const bool with_field : {false, true}) {
      if (with_field && method != Method::tetwarp) continue;
      const bool whole = with_field || method != Method::tetwarp;
      std::vector<std::string> cells = labels;
      cells.push_back(name_of(method) + (whole ? "" : ", resample alone"));
      for (const Run* run : sources) {
        cells.push_back(cell(time_of(run, with_field)));
        if (than) cells.push_back(whole && run ? cell(speed_up(results, *run, *than)) : "");
      }
      text += row(cells);
    }
  }
  return text;
}

std::string speed_table(const Results& results, const std::string& title, std::span<const Method> methods) {
  std::string text = "## " + title + "\n" + kSpeedNote +
                     heading({"size", "field", "method", "field in kernel", "speed-up", "field in memory", "speed-up"});
  for (const Run* like : cases(results, false)) {
    text += method_rows(results, *like, methods, {size_text(*like), like->field}, methods.front());
  }
  return text + "\n";
}

std::string size_table(const Results& results) {
  std::string text =
      std::string(kSizeNote) + heading({"size", "field", "paper, field in kernel", "tetwarp, field in kernel",
                                        "paper, field in memory", "tetwarp, field in memory"});
  for (const Run* like : cases(results, false)) {
    std::vector<std::string> cells = {size_text(*like), like->field};
    for (const FieldSource source : {FieldSource::kernel, FieldSource::memory}) {
      cells.push_back(cell(time_of(find_run(results, *like, Method::paper, source), false)));
      cells.push_back(cell(time_of(find_run(results, *like, Method::tetwarp, source), true)));
    }
    text += row(cells);
  }
  return text + "\n";
}

std::string coarse_table(const Results& results) {
  const std::vector<const Run*> found = cases(results, true);
  if (found.empty()) return "";
  constexpr Method kMethods[] = {Method::paper, Method::gascon, Method::tetwarp};
  std::string text =
      std::string(kCoarseNote) + heading({"size", "field", "cell", "method", "field in kernel", "field in memory"});
  for (const Run* like : found) {
    text += method_rows(results, *like, kMethods, {size_text(*like), like->field, std::to_string(like->cell_size)}, {});
  }
  return text + "\n";
}

std::string end_to_end_table(const Results& results) {
  if (results.backend == "cpu") return "";  // nothing is copied: the tables above say it all
  std::string text = std::string(kEndToEndNote) +
                     heading({"size", "field", "cell", "method", "field in", "copy in", "copy out", "end to end"});
  for (const Run& run : results.runs) {
    text += row({size_text(run), run.field, std::to_string(run.cell_size), name_of(run.method), name_of(run.source),
                 cell(run.copy_in_ms), cell(run.copy_out_ms), cell(run.end_to_end_ms)});
  }
  return text + "\n";
}

std::vector<std::string> tally_cells(const Tally& tally) {
  const auto count = [](std::uint64_t n) { return std::to_string(n); };
  return {count(tally.covered),
          count(tally.writes),
          count(tally.lost),
          count(tally.multiple),
          count(tally.spilled),
          format("%.0f", tally.largest_difference),
          format("%.4f", tally.mean_difference)};
}

std::string quality_table(const Results& results) {
  std::string text = std::string(kQualityNote) +
                     heading({"size", "field", "cell", "method", "field in", "covered", "writes", "lost",
                              "written more than once", "spilled", "largest difference", "mean difference"});
  for (const Run& run : results.runs) {
    const Run* kernel = find_run(results, run, run.method, FieldSource::kernel);
    const Run* memory = find_run(results, run, run.method, FieldSource::memory);
    const bool same = kernel && memory && kernel->tally == memory->tally;
    if (same && run.source == FieldSource::memory) continue;
    std::vector<std::string> cells = {size_text(run), run.field, std::to_string(run.cell_size), name_of(run.method),
                                      same ? "either" : name_of(run.source)};
    for (const std::string& text_of : tally_cells(run.tally)) cells.push_back(text_of);
    text += row(cells);
  }
  return text + "\n";
}

std::string inverse_text(const AppendixResult<double>& in_double, const AppendixResult<float>& in_float) {
  const PublishedAppendix& paper = published_appendix();
  std::string text = heading({"the inverse begins", "the paper, double", "ours", "the paper, float", "ours"});
  constexpr const char* kOf[] = {"A", "B", "C", "D"};
  for (std::size_t n = 0; n < 4; ++n) {
    text += row({std::string("x of ") + kOf[n], format("%.6f", paper.inverse_in_double[n]),
                 format("%.6f", in_double.inverse[n]), format("%.6f", paper.inverse_in_float[n]),
                 format("%.6f", static_cast<double>(in_float.inverse[n]))});
  }
  return text + "\n";
}

std::string appendix_text(const Appendix& appendix) {
  const auto point = [](const char* name, const Point<double>& p) {
    return format("%s (%g, %g, %g)", name, p.x, p.y, p.z);
  };
  const Corners<double>& t = published_appendix().corners;
  std::string text = kAppendixNote + point("A", t.a) + ", " + point("B", t.b) + ", " + point("C", t.c) + ", " +
                     point("D", t.d) + ".\n\n" + heading({"form", "the paper", "ours", "difference"});
  for (const DeterminantForm& form : appendix.forms) {
    text += row({form.name, form.printed ? format("%.7g", *form.printed) : "-", format("%.9g", form.value),
                 form.printed ? format("%.1e", form.value - *form.printed) : "-"});
  }
  text +=
      "\n" + inverse_text(appendix.in_double, appendix.in_float) +
      "Relative errors of the float forms (4 x 4 by minors of differences), random tetrahedra of about one cell.\n\n" +
      heading(
          {"coordinates up to", "tetrahedra", "4 x 4, largest", "4 x 4, median", "3 x 3, largest", "3 x 3, median"});
  for (const DeterminantErrors& errors : appendix.errors) {
    text +=
        row({format("%.0f", errors.distance), std::to_string(errors.tetrahedra), format("%.2g", errors.largest_4x4),
             format("%.2g", errors.median_4x4), format("%.2g", errors.largest_3x3), format("%.2g", errors.median_3x3)});
  }
  return text;
}

std::string introduction(const Results& results) {
  const Machine& machine = results.machine;
  const PaperOptions& options = results.options;
  std::string text = std::string("# tetwarp-bench paper, ") + version() + " (" + commit() + ")\n\n";
  if (results.backend == "cuda") {
    text += "- CUDA: " + cuda_text(machine) + "\n";
  } else {
    text += "- CPU: the same loops in plain C++, sampling in software, float; no copies\n";
  }
  text += "- host: " + machine.cpu + ", " + std::to_string(machine.threads) +
          " threads\n- input: " + results.input_kind + ", int16, linear interpolation\n";
  text += format("- %d timed frames after %d\n", options.frames, options.warmup);
  text += "- inverse: as compiled. The source says every candidate voxel; a compiler may move it out of that loop, ";
  text += "to once a tetrahedron. In the methods -per-voxel it is kept there\n";
  return text + "\n";
}

}  // namespace

std::string to_markdown(const Results& results) {
  constexpr Method kTable2[] = {Method::inverse4x4_double,
                                Method::inverse3x3_double,
                                Method::inverse3x3_float,
                                Method::inverse4x4_double_per_voxel,
                                Method::inverse3x3_double_per_voxel,
                                Method::inverse3x3_float_per_voxel,
                                Method::tetwarp};
  constexpr Method kTable3[] = {Method::inverse3x3_float, Method::paper, Method::inverse3x3_float_per_voxel,
                                Method::paper_per_voxel, Method::tetwarp};
  return introduction(results) + published_tables(results) + speed_table(results, "Table 2: the inverse", kTable2) +
         speed_table(results, "Table 3: what is interpolated", kTable3) + size_table(results) + coarse_table(results) +
         end_to_end_table(results) + quality_table(results) + appendix_text(results.appendix);
}

}  // namespace tetwarp::bench
