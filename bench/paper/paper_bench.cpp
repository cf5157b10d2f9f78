// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/paper/paper_bench.h"

#include <algorithm>
#include <cstdio>

#include "bench/harness/input.h"

namespace tetwarp::bench {

namespace {

constexpr int kEndToEndFrames = 5;
constexpr std::int64_t kMainSlices = 300;
constexpr Method kCoarseMethods[] = {Method::paper, Method::gascon, Method::tetwarp};
constexpr Method kTable4Methods[] = {Method::inverse3x3_float, Method::paper, Method::inverse3x3_float_per_voxel,
                                     Method::paper_per_voxel, Method::tetwarp};

/// Whether a method on a field is there only to stand beside the paper's numbers.
bool is_for_the_paper(const std::string& field, Method method) {
  return as_written(field) || inverse_of(method) == InverseIn::every_voxel;
}

bool is_in_table_4(const std::string& field, Method method) {
  const std::optional<FieldAsWritten> written = as_written(field);
  return (written ? written->transform : field) == "wave" &&
         std::find(std::begin(kTable4Methods), std::end(kTable4Methods), method) != std::end(kTable4Methods);
}

std::optional<Summary> summary_or_none(const std::vector<double>& ms) {
  return ms.empty() ? std::nullopt : std::optional(summarize(ms));
}

/// @param run  size, field and cells; the rest is measured
Run measure(const PaperOptions& options, Backend& backend, Run run, Method method, FieldSource source) {
  const FrameCount frames{options.warmup, options.frames, std::min(options.frames, kEndToEndFrames)};
  run.method = method;
  run.source = source;
  const FrameTimes times = backend.time(method, source, frames);
  run.kernel_ms = summarize(times.kernel_ms);
  run.field_ms = summary_or_none(times.field_ms);
  run.total_ms = summary_or_none(times.total_ms);
  run.copy_in_ms = summary_or_none(times.copy_in_ms);
  run.copy_out_ms = summary_or_none(times.copy_out_ms);
  run.end_to_end_ms = summary_or_none(times.end_to_end_ms);
  run.tally = compare(backend.exact(), backend.output(), backend.count_writes(method, source));
  return run;
}

std::string describe(const Run& run) {
  char text[256];
  std::snprintf(text, sizeof text, "%s, %s, cells of %lld, %s, field in %s: %.3f ms, %llu lost, %llu more than once",
                to_string(run.size).c_str(), run.field.c_str(), static_cast<long long>(run.cell_size),
                name_of(run.method).c_str(), name_of(run.source).c_str(), run.kernel_ms.median,
                static_cast<unsigned long long>(run.tally.lost), static_cast<unsigned long long>(run.tally.multiple));
  return text;
}

/// All methods on one volume, field and lattice.
template <class Methods>
void run_methods(const PaperOptions& options, Backend& backend, const Run& common, const Methods& methods,
                 std::vector<Run>& runs, const std::function<void(const std::string&)>& say) {
  if (std::empty(methods)) return;
  backend.set_field(make_formula(common.field, common.size), common.cell_size);
  for (const Method method : methods) {
    for (const FieldSource source : {FieldSource::kernel, FieldSource::memory}) {
      if (source == FieldSource::memory && is_for_the_paper(common.field, method)) continue;
      runs.push_back(measure(options, backend, common, method, source));
      say(describe(runs.back()));
    }
  }
}

}  // namespace

std::vector<Run> run_all(const PaperOptions& options, Backend& backend,
                         const std::function<void(const std::string&)>& say) {
  const std::vector<std::int64_t> slices =
      options.input.is_phantom() ? options.input.slices : std::vector<std::int64_t>{0};
  const bool has_main = std::find(slices.begin(), slices.end(), kMainSlices) != slices.end();
  std::vector<Run> runs;
  for (const std::int64_t count : slices) {
    const Volume<std::int16_t> volume = read_input(options.input, count);
    backend.set_volume(volume, *std::min_element(volume.voxels.begin(), volume.voxels.end()));
    const glm::i64vec3 size = volume.geometry.size;
    const bool is_main = count == (has_main ? kMainSlices : slices.front());
    for (const std::string& field : options.fields) {
      Run common;
      common.size = size;
      common.field = field;
      common.formula = formula_text(field, size);
      std::vector<Method> methods = options.methods;
      std::erase_if(methods, [&](Method method) {
        return !is_main && is_for_the_paper(field, method) && !is_in_table_4(field, method);
      });
      run_methods(options, backend, common, methods, runs, say);
      if (!is_main || as_written(field)) continue;
      for (const std::int64_t cell_size : options.cell_sizes) {
        common.cell_size = cell_size;
        run_methods(options, backend, common, kCoarseMethods, runs, say);
      }
    }
  }
  return runs;
}

}  // namespace tetwarp::bench
