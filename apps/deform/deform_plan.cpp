// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/deform/deform_plan.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/cli/reads.h"
#include "apps/deform/field_source.h"
#include "apps/deform/output_grid.h"
#include "deform/fields/formula.h"
#include "deform/mass.h"
#include "deform/residuals.h"
#include "io/image_file.h"
#include "io/mesh_writer.h"
#include "io/opened_file.h"
#include "io/scenario_file.h"

namespace tetwarp::apps {

namespace {

/// Program, libraries and what a pass keeps per thread, beside volumes and field.
constexpr std::uint64_t kOverheadBytes = 200'000'000;

std::filesystem::path folder_of(const std::filesystem::path& file) {
  return file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
}

std::uint64_t bytes_of_field(const DeformOptions& options, const Geometry& volume, const Geometry& grid) {
  if (!options.scenario.empty()) return simulation_bytes(options.scenario, volume, !options.labels.empty());
  if (options.pull_field.empty())
    return field_bytes(options.fields, volume, options.cell_size, options.common.nifti_frame);
  const glm::i64vec3 pulled = pull_grid_size(options.pull_field, grid, options.common.nifti_frame);
  return static_cast<std::uint64_t>(pulled.x * pulled.y * pulled.z) * sizeof(glm::vec3);
}

/// @param grid  of the output
std::uint64_t plan_bytes(const DeformOptions& options, DeformOutputs& outputs, const InputHeader& input,
                         const Geometry& grid) {
  const std::uint64_t of_field = bytes_of_field(options, input.geometry, grid);
  const auto voxels = static_cast<std::uint64_t>(voxel_count(input.geometry)),
             output_voxels = static_cast<std::uint64_t>(voxel_count(grid));
  const auto slices = static_cast<std::uint64_t>(grid.size.z);
  const std::uint64_t of_check = reports_quality(options) ? sizeof(glm::vec3) * output_voxels / slices *
                                                                std::min(slices, std::uint64_t{RoundTrip::kMostSlices})
                                                          : 0;
  const std::uint64_t of_mass =
      options.preserve_mass ? size_bytes(type_of_mass(input.type)) * (voxels + output_voxels) : 0;
  const std::uint64_t of_structures = outputs.structures.empty() ? 0 : MapStream::bytes(grid, &Maps::inverse_mm, false);
  return of_mass + of_check + voxels * size_bytes(input.type) + output_voxels * size_bytes(input.type) +
         outputs.maps->bytes(grid, options.preserve_mass) + outputs.further->bytes(output_voxels) + of_structures +
         of_field + kOverheadBytes;
}

/// What the outputs take on disk, were nothing compressed.
std::uint64_t output_bytes(const DeformOptions& options, const DeformOutputs& outputs, const InputHeader& input,
                           const Geometry& grid) {
  const auto voxels = static_cast<std::uint64_t>(voxel_count(grid));
  std::uint64_t per_voxel = size_bytes(input.type);
  const MapOptions& maps = options.maps;
  if (!maps.coverage.empty()) per_voxel += sizeof(std::uint8_t);
  if (!maps.folds.empty()) per_voxel += sizeof(std::uint16_t);
  if (!maps.jacobian.empty()) per_voxel += sizeof(float);
  if (!maps.inverse.empty()) per_voxel += sizeof(glm::vec3);
  const std::uint64_t of_field = options.write_field.empty() ? 0 : bytes_of_field(options, input.geometry, grid);
  return voxels * per_voxel + outputs.further->bytes(voxels) + of_field;
}

[[noreturn]] void refuse_bids(const DeformOptions& options) {
  throw UsageError("--bids says what the headers of a CT series say, " + options.input.path.string() +
                   " has none; leave it out");
}

/// One of -f, --pull-field and --scenario, and what goes with it.
void check_choice_of_field(const DeformOptions& options) {
  if (!options.scenario.empty() && (!options.fields.empty() || !options.pull_field.empty()))
    throw UsageError("--scenario makes the field, so -f and --pull-field do not go with it; leave one out");
  if (options.scenario.empty() && !options.labels.empty()) throw UsageError("--labels is for --scenario; leave it out");
  if (!options.write_field.empty() && !options.pull_field.empty())
    throw UsageError("--write-field writes a forward field, which --pull-field has not; leave it out");
  if (!options.write_field.empty() && !has_image_suffix(options.write_field) && !has_mesh_suffix(options.write_field)) {
    throw UsageError("unknown suffix of --write-field \"" + options.write_field.string() +
                     "\"; a field is written as .mha .nrrd .nii .nii.gz, or as a mesh, .vtu .vtk");
  }
}

void check_scenario(const DeformOptions& options) {
  if (options.cell_size) throw UsageError("--cell-size is for formulas and transforms, a scenario says its own");
  const simulate::Scenario scenario = read_scenario(options.scenario);
  if (!options.write_field.empty()) require_fitting_format(scenario, options.write_field, false);
}

/// The texts of --with by what they name.
struct FurtherTexts {
  std::vector<std::string> structures, volumes;

  explicit FurtherTexts(const std::vector<std::string>& with) {
    for (const std::string& text : with) (FurtherStructures::is_one(text) ? structures : volumes).push_back(text);
  }
};

}  // namespace

bool reports_quality(const DeformOptions& options) { return !options.report.empty() && options.pull_field.empty(); }

DeformOutputs begin_outputs(const DeformOptions& options, const PointsOption& points) {
  check_choice_of_field(options);
  if (!options.scenario.empty()) {
    check_scenario(options);
  } else if (options.pull_field.empty()) {
    check_fields(options.fields, options.cell_size);
  } else if (options.cell_size) {
    throw UsageError("--cell-size is for formulas and transforms with -f; --pull-field has its own grid");
  }
  check_grid(options.grid, !options.pull_field.empty());
  if (options.preserve_mass && !options.pull_field.empty()) {
    throw UsageError("--preserve mass needs the determinant of a forward map, which --pull-field has not");
  }
  const FurtherTexts with(options.with);
  const Reads reads = reads_of(options);
  if (!options.pull_field.empty() && !points.empty())
    throw UsageError("--points needs a forward field, --pull-field has no forward map");
  const bool series = is_series_output(options.output);
  if (series && has_image_suffix(options.input.path)) {
    throw UsageError("a DICOM series can only be derived from DICOM, not from " + options.input.path.string() +
                     "; name the output .nii.gz, .nii, .nrrd or .mha");
  }
  if (series && !is_same_grid(options.grid)) {
    throw UsageError("a DICOM series has the grid of the series it is derived from, not that of --grid " +
                     options.grid + "; name the output .nii.gz, .nii, .nrrd or .mha");
  }
  if (options.compression && (series || options.output.extension() == ".nii")) {
    throw UsageError("--compress is for .nii.gz, .nrrd and .mha, not for " + options.output.string());
  }
  if (!series && options.dicom != DicomForm()) {
    throw UsageError(
        "--transfer-syntax, --keep-frame-of-reference, --series-number, --series-description and --deidentify are for "
        "a DICOM series, not for " +
        options.output.string());
  }
  if (options.bids && bids_sidecar_of(options.output).empty()) {
    throw UsageError("--bids is for .nii and .nii.gz, not for " + options.output.string());
  }
  if (options.bids && has_image_suffix(options.input.path)) refuse_bids(options);
  if (!options.preview.empty() && options.preview.extension() != ".png") {
    throw UsageError("unknown suffix of --preview \"" + options.preview.string() + "\"; use .png");
  }
  if (options.background && !std::isfinite(*options.background))
    throw UsageError("--background is not a finite number");
  DeformOutputs outputs{
      series, OutputSet(reads, options.common.overwrite, options.folder, options.dry_run && !options.folder.empty()),
      {},     {},
      {},     {},
      {},     {},
      {},     {},
      {},     {}};
  // The series of a single file is read from its folder, so a derived series must not land there. What is not there is
  // no file: who reads it says so.
  if (series && !options.input.single && is_file(options.input.path))
    outputs.set.add_reads({folder_of(options.input.path)});
  outputs.volume = outputs.set.add(options.output, series ? StagedOutput::Kind::folder : StagedOutput::Kind::file);
  outputs.sidecar = outputs.set.add(sidecar_of(options.output));
  if (options.bids) outputs.bids = outputs.set.add(bids_sidecar_of(options.output));
  outputs.maps.emplace(options.maps, options.pull_field.empty() ? Direction::forward : Direction::pull, series,
                       outputs.set);
  outputs.further.emplace(with.volumes, series, options.common.nifti_frame, outputs.set);
  outputs.structures = FurtherStructures(with.structures, series, outputs.set);
  outputs.field = outputs.set.add(options.write_field);
  outputs.report = outputs.set.add(options.report);
  outputs.preview = outputs.set.add(options.preview);
  outputs.points = points.add_outputs(outputs.set);
  return outputs;
}

DeformPlan plan_deformation(const DeformOptions& options, DeformOutputs& outputs, const InputHeader& input) {
  if (outputs.series && !input.series) {
    throw UsageError("a DICOM series can only be derived from a CT series, not from " + options.input.path.string() +
                     "; name the output .nii.gz, .nii, .nrrd or .mha");
  }
  if (options.bids && !input.series) refuse_bids(options);
  const glm::i64vec3& size = input.geometry.size;
  require(std::min({size.x, size.y, size.z}) >= 2, "a volume of " + to_string(size) +
                                                       " voxels has no cell to deform, " + options.input.path.string() +
                                                       "; give one with at least 2 on every axis");
  if (options.background && !fits(input.type, *options.background)) {
    throw UsageError("--background " + nlohmann::json(*options.background).dump() + " does not fit the voxels, " +
                     to_string(input.type) + "; choose a value in their range");
  }
  outputs.further->open(input);
  outputs.set.add_reads(reads_of(options).slices(options.input, input));
  DeformPlan plan;
  if (options.grid != "fit")
    plan.grid = output_grid(options.grid, input.geometry, {}, options.outside, options.common.nifti_frame);
  if (outputs.series) outputs.maps->check(plan.grid);
  const Geometry& grid = options.grid == "fit" ? input.geometry : plan.grid;
  plan.bytes = plan_bytes(options, outputs, input, grid);
  plan.output_bytes = output_bytes(options, outputs, input, grid);
  if (options.memory_bytes && plan.bytes > *options.memory_bytes && !means_cuda(options.backend)) {
    throw Error("about " + format_bytes(plan.bytes) + " of memory are needed, --memory allows " +
                format_bytes(*options.memory_bytes) + "; a larger --cell-size needs less");
  }
  return plan;
}

std::string describe(const DeformPlan& plan, const DeformOptions& options, const DeformOutputs& outputs) {
  const bool fit = options.grid == "fit";
  return "would write " + options.output.string() + ": " +
         (fit ? "as many voxels as the deformed lattice needs" : to_string(plan.grid.size) + " voxels") + " as " +
         (outputs.series ? "a DICOM series" : "a file") + "; about " + format_bytes(plan.bytes) + " of memory";
}

}  // namespace tetwarp::apps
