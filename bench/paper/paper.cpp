// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/paper/paper.h"

#include <tbb/global_control.h>

#include <algorithm>
#include <cstdio>
#include <iostream>

#include "backend/devices.h"
#include "bench/harness/files.h"
#include "bench/harness/input.h"
#include "bench/paper/appendix.h"

namespace tetwarp::bench {

namespace {

constexpr int kEndToEndFrames = 5;
constexpr std::int64_t kMainSlices = 300;

/// Whether a method on a field is there only to stand beside the paper's numbers.
bool is_for_the_paper(const std::string& field, Method method) {
  return as_written(field) || inverse_of(method) == InverseIn::every_voxel;
}

bool is_in_table_4(const std::string& field, Method method) {
  const std::optional<FieldAsWritten> written = as_written(field);
  return (written ? written->transform : field) == "wave" &&
         (method == Method::inverse3x3_float || method == Method::paper ||
          method == Method::inverse3x3_float_per_voxel || method == Method::paper_per_voxel ||
          method == Method::tetwarp);
}

/// What is measured of one field on one volume.
struct Case {
  glm::i64vec3 size{0};
  std::string field;
  std::int64_t cell_size = 1;
};

Json measure(const Options& options, Backend& backend, const Case& one, Method method, FieldSource source) {
  const FrameCount frames{options.warmup, options.frames, std::min(options.frames, kEndToEndFrames)};
  const Samples times = backend.time(method, source, frames);
  const Tally tally = compare(backend.exact(), backend.output(), backend.count_writes(method, source));
  Json row{{"size", size_json(one.size)}, {"field", one.field},        {"formula", formula_text(one.field, one.size)},
           {"cell_size", one.cell_size},  {"method", name_of(method)}, {"field_source", name_of(source)}};
  for (const char* name : {"kernel_ms", "field_ms", "total_ms", "copy_in_ms", "copy_out_ms", "end_to_end_ms"})
    row[name] = summary_of(times, name);
  row.update({{"writes", tally.writes},
              {"voxels_lost", tally.lost},
              {"voxels_multiple", tally.multiple},
              {"voxels_spilled", tally.spilled},
              {"largest_difference", tally.largest_difference},
              {"mean_difference", tally.mean_difference},
              {"exact_covered", tally.covered},
              {"inverse", inverse_of(method) == InverseIn::every_voxel ? "every voxel" : "as compiled"}});
  if (method == Method::tetwarp) row["inverse"] = nullptr;  // none of the paper's
  options.say(format("%s, %s, cells of %lld, %s, field in %s: %.3f ms, %llu lost, %llu more than once",
                     to_string(one.size).c_str(), one.field.c_str(), static_cast<long long>(one.cell_size),
                     name_of(method).c_str(), name_of(source).c_str(), *number(row, "/kernel_ms"),
                     static_cast<unsigned long long>(tally.lost), static_cast<unsigned long long>(tally.multiple)));
  return row;
}

/// All methods on one volume, field and lattice.
void run_methods(const Options& options, Backend& backend, const Case& one, const std::vector<Method>& methods,
                 Json& rows) {
  if (methods.empty()) return;
  backend.set_field(make_formula(one.field, one.size), one.cell_size);
  for (const Method method : methods) {
    for (const FieldSource source : {FieldSource::kernel, FieldSource::memory}) {
      if (source == FieldSource::memory && is_for_the_paper(one.field, method)) continue;
      rows.push_back(measure(options, backend, one, method, source));
    }
  }
}

bool use_cuda(const Options& options) {
  if (options.backend != "auto") return options.backend == "cuda";
  if (device_count() > 0) return true;
  std::fprintf(stderr, "no CUDA device: the CPU does it, for minutes to hours unless --width and --slices are small\n");
  return false;
}

}  // namespace

Json run_all(const Options& options, Backend& backend) {
  const std::vector<std::int64_t> slices =
      options.input.is_phantom() ? options.input.slices : std::vector<std::int64_t>{0};
  const bool has_main = std::find(slices.begin(), slices.end(), kMainSlices) != slices.end();
  Json rows = Json::array();
  for (const std::int64_t count : slices) {
    const Volume<std::int16_t> volume = read_input(options.input, count);
    backend.set_volume(volume, *std::min_element(volume.voxels.begin(), volume.voxels.end()));
    const bool is_main = count == (has_main ? kMainSlices : slices.front());
    for (const std::string& field : options.fields) {
      Case one{volume.geometry.size, field};
      std::vector<Method> methods;
      for (const std::string& name : options.methods) {
        const Method method = parse_method(name);
        if (is_main || !is_for_the_paper(field, method) || is_in_table_4(field, method)) methods.push_back(method);
      }
      run_methods(options, backend, one, methods, rows);
      if (!is_main || as_written(field)) continue;
      for (const std::int64_t cell_size : options.cell_sizes) {
        one.cell_size = cell_size;
        run_methods(options, backend, one, {Method::paper, Method::gascon, Method::tetwarp}, rows);
      }
    }
  }
  return rows;
}

int run_paper(const Options& options) {
  for (const auto& output : {options.json, options.csv})
    require_writable(output, {options.input.path, options.input.raw});
  std::optional<tbb::global_control> limit;
  if (options.threads > 0)
    limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(options.threads));
  const bool cuda = use_cuda(options);
  const std::unique_ptr<Backend> backend = cuda ? make_cuda_backend(options.device) : make_cpu_backend(options.threads);
  Json document =
      begin_document("paper",
                     {{"frames", options.frames},
                      {"warmup", options.warmup},
                      {"backend", cuda ? "cuda" : "cpu"},
                      {"methods", options.methods},
                      {"fields", options.fields},
                      {"cell_sizes", options.cell_sizes}},
                     describe_machine(cuda ? options.device : -1, options.threads), input_kind(options.input));
  document["appendix_a"] = measure_appendix();
  document["runs"] = run_all(options, *backend);
  std::cout << to_text(document, {});
  write_json(options.json, document);
  write_text(options.csv, to_csv(document["runs"]));
  return 0;
}

}  // namespace tetwarp::bench
