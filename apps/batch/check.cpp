// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/batch/check.h"

#include <mutex>

#include "apps/batch/output_folder.h"
#include "apps/deform/deform_outputs.h"
#include "io/parallel.h"
#include "io/shown_text.h"

namespace tetwarp::apps {

namespace {

/// What the check of one case found. At least one of its texts is empty.
struct Finding {
  DiskBytes disk;
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
    finding.disk = plan.disk;
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
    check.disk[cases[n]->id] = findings[n].disk;
    if (!findings[n].forecast.empty()) check.forecasts.push_back(cases[n]->id + ": " + findings[n].forecast);
    if (findings[n].error.empty()) continue;
    errors += (errors.empty() ? "" : "\n") + shown(manifest) + ":" + std::to_string(cases[n]->line) + ": " +
              cases[n]->id + ": " + findings[n].error;
  }
  require(errors.empty(), errors);
  return check;
}

DiskBytes disk_of(const BatchCheck& check, const std::vector<const BatchCase*>& cases) {
  DiskBytes sum;
  for (const BatchCase* one : cases) sum += check.disk.at(one->id);
  return sum;
}

std::string check_space(const DiskBytes& disk, const std::filesystem::path& folder) {
  const std::uint64_t free = free_bytes(folder);
  if (disk.plain > free) {
    throw Error("the outputs take at least " + format_bytes(disk.plain) + ", " + format_bytes(free) + " are free, " +
                folder.string() + "; choose another disk, or a compressed form");
  }
  if (disk.plain + disk.packed <= free) return "";
  return "the outputs take up to " + format_bytes(disk.plain + disk.packed) + " before compression, " +
         format_bytes(free) + " are free, " + folder.string();
}

}  // namespace tetwarp::apps
