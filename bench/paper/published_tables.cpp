// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/paper/published_tables.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "bench/harness/markdown.h"
#include "bench/paper/baselines.h"
#include "bench/paper/beside.h"

namespace tetwarp::bench {

namespace {

using Json = nlohmann::json;

constexpr PublishedGpu kGpus[] = {PublishedGpu::rtx_2080, PublishedGpu::gtx_1650_mobile};

constexpr char kNote[] = R"(
The paper's times are the mean of 500 frames and hold the formula, the inverse and the sampling, not the picture; ours are
medians, the field evaluated in the kernel. Its Eqs. 14 to 16 have no amplitude: as they are written, t = pi / 2, times 1
and 16 voxels, which is our choice (`bench/paper/fields.h`). Methods "-per-voxel" compute the inverse for every candidate voxel,
as the paper did where it timed its Table 2 (a); the others as compiled. A ratio is the paper's time over ours. It stands
only where size, formula and settings are the same; the GPUs never are.

)";

std::string ms_text(double ms) { return format("%.2f", ms); }
std::string amplitude_text(const FieldAsWritten& field) { return format("%.0f", field.amplitude); }

std::string apart_text(const Results& results) {
  const std::vector<std::string> reasons = why_apart(results);
  if (reasons.empty()) return "";
  std::string text = "Where nothing stands beside a number of the paper, it was not measured with its settings: ";
  for (std::size_t n = 0; n < reasons.size(); ++n) text += (n ? "; " : "") + reasons[n];
  return text + ".\n\n";
}

std::string data_table(const Results& results) {
  std::string text = "### Table 1: data\n\n" + heading({"data", "size", "the paper, MB", "ours"});
  for (const PublishedData& data : published_data()) {
    const glm::i64vec3 size(kPublishedColumns, kPublishedRows, data.slices);
    bool is_run = false;
    for (const Run& run : results.runs) is_run |= run.size == size;
    text += row({data.name, to_string(size), format("%g", data.megabytes), is_run ? results.input_kind : "-"});
  }
  return text + "\n";
}

const PublishedTime* on_other_gpu(const PublishedTime& time) {
  for (const PublishedTime& other : published_times()) {
    if (other.table == time.table && other.column == time.column && std::string(other.transform) == time.transform &&
        std::string(other.data) == time.data && other.gpu != time.gpu) {
      return &other;
    }
  }
  return nullptr;
}

std::string ours_text(const Beside& beside) { return beside.ours ? cell(std::optional(beside.ours->kernel_ms)) : "-"; }

/// Tables 2 and 3: a row a column of the paper's, with both of its GPUs.
std::string time_table(const Results& results, int table, const std::string& title) {
  std::string text = "### " + title + "\n\n" +
                     heading({"transform", "column", "method here", "amplitude", "RTX 2080, ms", "GTX 1650 Mobile, ms",
                              "ours, ms", "RTX 2080 / ours", "GTX 1650 Mobile / ours"});
  for (const Beside& beside : beside_table(results, table)) {
    if (beside.paper->gpu != PublishedGpu::rtx_2080) continue;
    Beside notebook = beside;
    notebook.paper = on_other_gpu(*beside.paper);
    text += row({beside.paper->transform, std::string("(") + beside.paper->column + ")", name_of(beside.method),
                 amplitude_text(beside.field), ms_text(beside.paper->ms), ms_text(notebook.paper->ms),
                 ours_text(beside), cell(ratio(beside)), cell(ratio(notebook))});
  }
  return text + "\n";
}

std::string data_set_table(const Results& results) {
  std::string text =
      "### Table 4: data sets, Wave\n\n" + heading({"data", "slices", "method here", "amplitude", "GTX 1650 Mobile, ms",
                                                    "ours, ms", "GTX 1650 Mobile / ours"});
  for (const Beside& beside : beside_table(results, 4)) {
    text += row({beside.paper->data, std::to_string(published_data(beside.paper->data).slices), name_of(beside.method),
                 amplitude_text(beside.field), ms_text(beside.paper->ms), ours_text(beside), cell(ratio(beside))});
  }
  return text + "\n";
}

/// How many times as fast one method is as another, with the paper's settings.
std::optional<double> our_speed_up(const Results& results, const FieldAsWritten& field, Method slow, Method fast) {
  const std::int64_t slices = published_data("abdomen").slices;
  const Run* slow_run = run_as_published(results, field.name, slices, slow);
  const Run* fast_run = run_as_published(results, field.name, slices, fast);
  if (!slow_run || !fast_run) return {};
  return slow_run->kernel_ms.median / fast_run->kernel_ms.median;
}

std::string speed_up_table(const Results& results) {
  std::string text = "### Speed-ups\n\n" + heading({"table", "transform", "speed-up", "RTX 2080", "GTX 1650 Mobile",
                                                    "amplitude", "ours, as compiled", "ours, inverse per voxel"});
  for (const PublishedSpeedUp& printed : published_speed_ups()) {
    if (printed.gpu != PublishedGpu::rtx_2080) continue;
    double notebook = 0;
    for (const PublishedSpeedUp& other : published_speed_ups()) {
      if (other.table == printed.table && std::string(other.transform) == printed.transform && other.gpu != printed.gpu)
        notebook = other.ratio;
    }
    for (const FieldAsWritten& field : fields_as_written()) {
      if (std::string(field.transform) != printed.transform) continue;
      text += row({std::to_string(printed.table), printed.transform, printed.table == 2 ? "(a) / (c)" : "(a) / (b)",
                   ms_text(printed.ratio), ms_text(notebook), amplitude_text(field),
                   cell(our_speed_up(results, field, printed.slow, printed.fast)),
                   cell(our_speed_up(results, field, per_voxel(printed.slow), per_voxel(printed.fast)))});
    }
  }
  return text + "\n";
}

/// Frames a second of Algorithm 2 at 512 x 512 x 300, from the slowest field to the fastest.
std::string frames_a_second(const Results& results) {
  std::vector<double> rates;
  for (const FieldAsWritten& field : fields_as_written()) {
    const Run* run = run_as_published(results, field.name, published_data("abdomen").slices, Method::paper);
    if (run) rates.push_back(1000 / run->kernel_ms.median);
  }
  if (rates.empty()) return "-";
  const auto [low, high] = std::minmax_element(rates.begin(), rates.end());
  return format("%.0f to %.0f, Algorithm 2 as compiled, 300 slices", *low, *high);
}

std::string ours(const Results& results, const PublishedClaim& claim) {
  switch (claim.about) {
    case PublishedClaim::About::frames_a_second: return frames_a_second(results);
    case PublishedClaim::About::tetrahedra:
      return std::to_string(std::int64_t{kTetrahedraPerCell} * (kPublishedColumns - 1) * (kPublishedRows - 1) *
                            (published_data("leg").slices - 1));
    case PublishedClaim::About::bytes_a_thread: return std::to_string(8 * sizeof(CellVertex));
    case PublishedClaim::About::differences: return "each against the exact result: below";
    case PublishedClaim::About::picture:
    case PublishedClaim::About::others: break;
  }
  return "-";
}

std::string claim_table(const Results& results) {
  std::string text = "### What it counts and claims\n\n" + heading({"what", "the paper", "ours"});
  for (const PublishedClaim& claim : published_claims()) text += row({claim.what, claim.printed, ours(results, claim)});
  return text + "\n";
}

Json number_or_null(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

Json times_json(const Results& results) {
  Json times = Json::array();
  const PublishedTime* last = nullptr;
  for (const Beside& beside : beside_the_paper(results)) {
    const PublishedTime& paper = *beside.paper;
    if (&paper != last) {
      times.push_back({{"table", paper.table},
                       {"column", std::string(1, paper.column)},
                       {"method", name_of(paper.method)},
                       {"transform", paper.transform},
                       {"data", paper.data},
                       {"slices", published_data(paper.data).slices},
                       {"gpu", name_of(paper.gpu)},
                       {"ms", paper.ms},
                       {"ours", Json::array()}});
      last = &paper;
    }
    times.back()["ours"].push_back({{"field", beside.field.name},
                                    {"amplitude", beside.field.amplitude},
                                    {"method", name_of(beside.method)},
                                    {"ms", beside.ours ? Json(beside.ours->kernel_ms.median) : Json(nullptr)},
                                    {"ratio", number_or_null(ratio(beside))}});
  }
  return times;
}

Json speed_ups_json(const Results& results) {
  Json speed_ups = Json::array();
  for (const PublishedSpeedUp& printed : published_speed_ups()) {
    Json ours = Json::array();
    for (const FieldAsWritten& field : fields_as_written()) {
      if (std::string(field.transform) != printed.transform) continue;
      ours.push_back({{"field", field.name},
                      {"as_compiled", number_or_null(our_speed_up(results, field, printed.slow, printed.fast))},
                      {"per_voxel", number_or_null(our_speed_up(results, field, per_voxel(printed.slow),
                                                                per_voxel(printed.fast)))}});
    }
    speed_ups.push_back({{"table", printed.table},
                         {"slow", name_of(printed.slow)},
                         {"fast", name_of(printed.fast)},
                         {"transform", printed.transform},
                         {"gpu", name_of(printed.gpu)},
                         {"ratio", printed.ratio},
                         {"ours", ours}});
  }
  return speed_ups;
}

std::string column_name(PublishedGpu gpu) { return gpu == PublishedGpu::rtx_2080 ? "rtx_2080" : "gtx_1650_mobile"; }

}  // namespace

std::string published_tables(const Results& results) {
  return std::string("## Beside the paper's own numbers\n") + kNote + apart_text(results) + data_table(results) +
         time_table(results, 2, "Table 2: the inverse, abdomen") +
         time_table(results, 3, "Table 3: what is interpolated, abdomen") + data_set_table(results) +
         speed_up_table(results) + claim_table(results);
}

nlohmann::json published_json(const Results& results) {
  Json data = Json::array(), claims = Json::array();
  for (const PublishedData& set : published_data())
    data.push_back({{"name", set.name}, {"slices", set.slices}, {"megabytes", set.megabytes}});
  for (const PublishedClaim& claim : published_claims())
    claims.push_back({{"what", claim.what}, {"printed", claim.printed}, {"ours", ours(results, claim)}});
  return {{"source", "Sensors 2022, 22, 6276"}, {"frames", kPublishedFrames},           {"data", data},
          {"times", times_json(results)},       {"speed_ups", speed_ups_json(results)}, {"claims", claims},
          {"why_apart", why_apart(results)}};
}

std::string published_csv_columns() {
  std::string text;
  for (const PublishedGpu gpu : kGpus)
    text += ",published_ms_" + column_name(gpu) + "," + column_name(gpu) + "_over_ours";
  return text;
}

std::string published_csv_cells(const Results& results, const Run& run) {
  std::string text;
  for (const PublishedGpu gpu : kGpus) {
    const PublishedTime* time = published_beside(results, run, gpu);
    text += time ? format(",%g,%.9g", time->ms, time->ms / run.kernel_ms.median) : std::string(",,");
  }
  return text;
}

}  // namespace tetwarp::bench
