// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/batch/check.h"

#include <mutex>

#include "apps/batch/output_folder.h"
#include "apps/deform/deform_outputs.h"
#include "apps/deform/deform_plan.h"
#include "io/parallel.h"
#include "io/shown_text.h"

namespace tetwarp::apps {

namespace {

/// Whether all outputs of a case are written uncompressed.
bool is_plain(const DeformOptions& options) {
  const auto is_packed = [&](const std::filesystem::path& path) { return path.extension() == ".gz"; };
  if (options.compression.value_or(0) > 0) return false;
  if (is_series_output(options.output)) return options.dicom.encoding == DicomEncoding::uncompressed;
  const MapOptions& maps = options.maps;
  for (const auto& path :
       {options.output, maps.coverage, maps.folds, maps.jacobian, maps.inverse, options.write_field}) {
    if (is_packed(path)) return false;
  }
  return options.with.empty();
}

/// What the check of one case found. At least one of its texts is empty.
struct Finding {
  std::uint64_t output_bytes = 0;
  bool plain = false;
  std::string error, forecast;
};

Finding look_at(const BatchCase& of, const std::filesystem::path& folder, std::uint64_t memory_bytes) {
  Finding finding;
  DeformOptions options = of.options;
  options.dry_run = true;
  try {
    const DeformRequest request = request_of(options);
    OutputSet outputs = begin_outputs(request).set;
    outputs.refuse_reads(folder);
    SharedInput input(options.input, SharedInput::Users::one);
    const DeformHeaders headers = open_headers(request, input, outputs);
    outputs.refuse_reads(folder);  // again, for now the files of slices are known
    const DeformPlan plan = plan_deformation(request, headers);
    finding.output_bytes = plan.output_bytes;
    finding.plain = is_plain(options);
    if (plan.bytes > memory_bytes) {
      finding.forecast =
          "about " + format_bytes(plan.bytes) + " of memory are needed, the batch has " + format_bytes(memory_bytes);
    }
  } catch (const UsageError& error) {
    finding.error = error.what();
  } catch (const Cancelled&) {
    throw;
  } catch (const std::exception& error) {
    finding.forecast = error.what();
  }
  return finding;
}

}  // namespace

BatchCheck check_cases(const std::filesystem::path& manifest, const std::filesystem::path& folder,
                       const std::vector<const BatchCase*>& cases, std::uint64_t memory_bytes, const Control& control) {
  std::vector<Finding> findings(cases.size());
  for_each_index(cases.size(), 0, control,
                 [&](std::size_t n) { findings[n] = look_at(*cases[n], folder, memory_bytes); });
  BatchCheck check;
  std::string errors;
  for (std::size_t n = 0; n < cases.size(); ++n) {
    (findings[n].plain ? check.plain_bytes : check.packed_bytes) += findings[n].output_bytes;
    if (!findings[n].forecast.empty()) check.forecasts.push_back(cases[n]->id + ": " + findings[n].forecast);
    if (findings[n].error.empty()) continue;
    errors += (errors.empty() ? "" : "\n") + shown(manifest) + ":" + std::to_string(cases[n]->line) + ": " +
              cases[n]->id + ": " + findings[n].error;
  }
  require(errors.empty(), errors);
  return check;
}

std::string check_space(const BatchCheck& check, const std::filesystem::path& folder) {
  const std::uint64_t free = free_bytes(folder);
  if (check.plain_bytes > free) {
    throw Error("the outputs take at least " + format_bytes(check.plain_bytes) + ", " + format_bytes(free) +
                " are free, " + folder.string() + "; choose another disk, or a compressed form");
  }
  if (check.plain_bytes + check.packed_bytes <= free) return "";
  return "the outputs take up to " + format_bytes(check.plain_bytes + check.packed_bytes) + " before compression, " +
         format_bytes(free) + " are free, " + folder.string();
}

}  // namespace tetwarp::apps
