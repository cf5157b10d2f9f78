// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/paper/beside.h"

#include <algorithm>

#include "deform/geometry.h"

namespace tetwarp::bench {

namespace {

glm::i64vec3 published_size(std::int64_t slices) { return {kPublishedColumns, kPublishedRows, slices}; }

bool has_published_settings(const Results& results, const Run& run) {
  return results.backend == "cuda" && run.cell_size == 1 && run.source == FieldSource::kernel;
}

void join(std::vector<std::string>& reasons, const std::string& what, const std::vector<std::string>& missing) {
  if (missing.empty()) return;
  std::string text = what;
  for (std::size_t n = 0; n < missing.size(); ++n) text += (n ? ", " : " ") + missing[n];
  reasons.push_back(text);
}

template <class Has>
bool any_run(const Results& results, const Has& has) {
  return std::any_of(results.runs.begin(), results.runs.end(), has);
}

}  // namespace

const Run* run_as_published(const Results& results, const std::string& field, std::int64_t slices, Method method) {
  for (const Run& run : results.runs) {
    if (has_published_settings(results, run) && run.size == published_size(slices) && run.field == field &&
        run.method == method) {
      return &run;
    }
  }
  return nullptr;
}

std::vector<Beside> beside_the_paper(const Results& results) {
  std::vector<Beside> all;
  for (const PublishedTime& time : published_times()) {
    for (const FieldAsWritten& field : fields_as_written()) {
      if (std::string(field.transform) != time.transform) continue;
      for (const Method method : {time.method, per_voxel(time.method)}) {
        all.push_back(
            {&time, field, method, run_as_published(results, field.name, published_data(time.data).slices, method)});
      }
    }
  }
  return all;
}

std::vector<Beside> beside_table(const Results& results, int table) {
  std::vector<Beside> found = beside_the_paper(results);
  std::erase_if(found, [&](const Beside& beside) { return beside.paper->table != table; });
  return found;
}

std::optional<double> ratio(const Beside& beside) {
  if (!beside.ours) return {};
  return beside.paper->ms / beside.ours->kernel_ms.median;
}

const PublishedTime* published_beside(const Results& results, const Run& run, PublishedGpu gpu) {
  for (const Beside& beside : beside_the_paper(results)) {
    if (beside.ours == &run && beside.paper->gpu == gpu) return beside.paper;
  }
  return nullptr;
}

std::vector<std::string> why_apart(const Results& results) {
  std::vector<std::string> reasons, sizes, fields, methods;
  if (results.backend != "cuda") reasons.emplace_back("this run was on a CPU, the paper's were on GPUs");
  for (const PublishedData& data : published_data()) {
    const glm::i64vec3 size = published_size(data.slices);
    if (!any_run(results, [&](const Run& run) { return run.size == size; })) sizes.push_back(to_string(size));
  }
  for (const FieldAsWritten& field : fields_as_written()) {
    if (!any_run(results, [&](const Run& run) { return run.field == field.name; })) fields.emplace_back(field.name);
  }
  for (const Method method :
       {Method::inverse4x4_double, Method::inverse3x3_double, Method::inverse3x3_float, Method::paper}) {
    for (const Method form : {method, per_voxel(method)}) {
      if (!any_run(results, [&](const Run& run) { return run.method == form; })) methods.push_back(name_of(form));
    }
  }
  join(reasons, "not run here:", sizes);
  join(reasons, "fields left out:", fields);
  join(reasons, "methods left out:", methods);
  return reasons;
}

}  // namespace tetwarp::bench
