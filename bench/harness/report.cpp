// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/harness/report.h"

#include <nlohmann/json.hpp>

#include "bench/paper/published.h"
#include "bench/paper/published_tables.h"
#include "deform/version.h"

namespace tetwarp::bench {

namespace {

using Json = nlohmann::json;

Json json_or_null(const std::optional<std::string>& text) { return text ? Json(*text) : Json(nullptr); }

/// When a method computes the inverse; null for one that has none of the paper's.
Json inverse_json(Method method) {
  if (method == Method::tetwarp) return nullptr;
  return inverse_of(method) == InverseIn::every_voxel ? "every voxel" : "as compiled";
}

Json to_json(const Run& run) {
  return {{"size", size_json(run.size)},
          {"field", run.field},
          {"formula", run.formula},
          {"cell_size", run.cell_size},
          {"method", name_of(run.method)},
          {"inverse", inverse_json(run.method)},
          {"field_source", name_of(run.source)},
          {"kernel_ms", to_json(run.kernel_ms)},
          {"field_ms", to_json(run.field_ms)},
          {"total_ms", to_json(run.total_ms)},
          {"copy_in_ms", to_json(run.copy_in_ms)},
          {"copy_out_ms", to_json(run.copy_out_ms)},
          {"end_to_end_ms", to_json(run.end_to_end_ms)},
          {"writes", run.tally.writes},
          {"voxels_lost", run.tally.lost},
          {"voxels_multiple", run.tally.multiple},
          {"voxels_spilled", run.tally.spilled},
          {"largest_difference", run.tally.largest_difference},
          {"mean_difference", run.tally.mean_difference},
          {"exact_covered", run.tally.covered}};
}

Json to_json(const Appendix& appendix) {
  const auto point = [](const Point<double>& p) { return Json{p.x, p.y, p.z}; };
  const PublishedAppendix& paper = published_appendix();
  const Corners<double>& t = paper.corners;
  Json forms = Json::array();
  for (const DeterminantForm& form : appendix.forms) {
    forms.push_back({{"form", form.name},
                     {"determinant", form.value},
                     {"printed", form.printed ? Json(*form.printed) : Json(nullptr)}});
  }
  Json document = {{"corners", {{"A", point(t.a)}, {"B", point(t.b)}, {"C", point(t.c)}, {"D", point(t.d)}}},
                   {"determinants", forms},
                   {"inverse_first_column",
                    {{"double", appendix.in_double.inverse},
                     {"float", appendix.in_float.inverse},
                     {"printed_double", paper.inverse_in_double},
                     {"printed_float", paper.inverse_in_float}}},
                   {"relative_errors", Json::array()}};
  for (const DeterminantErrors& errors : appendix.errors) {
    document["relative_errors"].push_back(
        {{"distance", errors.distance},
         {"tetrahedra", errors.tetrahedra},
         {"float_4x4", {{"largest", errors.largest_4x4}, {"median", errors.median_4x4}}},
         {"float_3x3", {{"largest", errors.largest_3x3}, {"median", errors.median_3x3}}}});
  }
  return document;
}

Json options_json(const Results& results) {
  const PaperOptions& options = results.options;
  Json methods = Json::array();
  for (const Method method : options.methods) methods.push_back(name_of(method));
  return {{"frames", options.frames}, {"warmup", options.warmup}, {"backend", results.backend},
          {"methods", methods},       {"fields", options.fields}, {"cell_sizes", options.cell_sizes}};
}

double whole_ms(const Run& run) { return run.total_ms ? run.total_ms->median : run.kernel_ms.median; }

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", value);
  return text;
}

std::string columns(const std::string& name) {
  return "," + name + "_median," + name + "_q1," + name + "_q3," + name + "_min," + name + "_max," + name + "_frames";
}

std::string columns(const std::optional<Summary>& ms) {
  if (!ms) return ",,,,,,";
  return "," + number(ms->median) + "," + number(ms->q1) + "," + number(ms->q3) + "," + number(ms->min) + "," +
         number(ms->max) + "," + std::to_string(ms->frames);
}

}  // namespace

Json to_json(const Summary& ms) {
  return {{"median", ms.median}, {"q1", ms.q1}, {"q3", ms.q3}, {"min", ms.min}, {"max", ms.max}, {"frames", ms.frames}};
}

Json to_json(const std::optional<Summary>& ms) { return ms ? to_json(*ms) : Json(nullptr); }

Json size_json(const glm::i64vec3& size) { return {size.x, size.y, size.z}; }

Json to_json(const Machine& machine) {
  return {{"cpu", machine.cpu},
          {"threads", machine.threads},
          {"gpu", json_or_null(machine.gpu)},
          {"driver", json_or_null(machine.driver)},
          {"cuda_runtime", json_or_null(machine.cuda_runtime)},
          {"compute_capability", json_or_null(machine.compute_capability)}};
}

Json input_json(const std::string& kind) {
  return {{"kind", kind}, {"seed", kind == "phantom" ? Json(kPhantomSeed) : Json(nullptr)}};
}

nlohmann::json to_json(const Results& results) {
  Json document = {{"program", "tetwarp-bench paper"},
                   {"version", version()},
                   {"commit", commit()},
                   {"options", options_json(results)},
                   {"machine", to_json(results.machine)},
                   {"input", input_json(results.input_kind)},
                   {"appendix_a", to_json(results.appendix)},
                   {"published", published_json(results)},
                   {"runs", Json::array()}};
  for (const Run& run : results.runs) document["runs"].push_back(to_json(run));
  return document;
}

const Run* find_run(const Results& results, const Run& like, Method method, FieldSource source) {
  for (const Run& run : results.runs) {
    if (run.size == like.size && run.field == like.field && run.cell_size == like.cell_size && run.method == method &&
        run.source == source) {
      return &run;
    }
  }
  return nullptr;
}

std::optional<double> speed_up(const Results& results, const Run& run, Method than) {
  const Run* other = find_run(results, run, than, run.source);
  if (!other) return {};
  return whole_ms(*other) / whole_ms(run);
}

std::string to_csv(const Results& results) {
  std::string csv = "columns,rows,slices,field,formula,cell_size,method,field_source" + columns("kernel_ms") +
                    columns("field_ms") + columns("total_ms") + columns("copy_in_ms") + columns("copy_out_ms") +
                    columns("end_to_end_ms") +
                    ",writes,voxels_lost,voxels_multiple,voxels_spilled,largest_difference,mean_difference,"
                    "exact_covered,speed_up_over_inverse4x4_double,speed_up_over_inverse3x3_float" +
                    published_csv_columns() + "\n";
  for (const Run& run : results.runs) {
    csv += std::to_string(run.size.x) + "," + std::to_string(run.size.y) + "," + std::to_string(run.size.z) + "," +
           run.field + ",\"" + run.formula + "\"," + std::to_string(run.cell_size) + "," + name_of(run.method) + "," +
           name_of(run.source);
    for (const std::optional<Summary>& ms : {std::optional(run.kernel_ms), run.field_ms, run.total_ms, run.copy_in_ms,
                                             run.copy_out_ms, run.end_to_end_ms}) {
      csv += columns(ms);
    }
    const Tally& tally = run.tally;
    for (const std::uint64_t count : {tally.writes, tally.lost, tally.multiple, tally.spilled}) {
      csv += "," + std::to_string(count);
    }
    csv += "," + number(tally.largest_difference) + "," + number(tally.mean_difference) + "," +
           std::to_string(tally.covered);
    for (const Method than : {Method::inverse4x4_double, Method::inverse3x3_float}) {
      const std::optional<double> ratio = speed_up(results, run, than);
      csv += "," + (ratio ? number(*ratio) : std::string());
    }
    csv += published_csv_cells(results, run) + "\n";
  }
  return csv;
}

}  // namespace tetwarp::bench
