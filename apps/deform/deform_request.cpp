// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/deform/deform_request.h"

#include <algorithm>
#include <cmath>

#include "apps/cli/output.h"
#include "apps/deform/output_grid.h"
#include "apps/simulate/simulated_field.h"
#include "io/image_file.h"
#include "io/mesh_writer.h"
#include "io/scenario_file.h"

namespace tetwarp::apps {

namespace {

/// One of -f, --pull-field and --scenario, and what goes with it.
void check_choice_of_field(const DeformOptions& options) {
  if (!options.scenario.empty() && options.field.is_given())
    throw UsageError("--scenario makes the field, so -f and --pull-field do not go with it; leave one out");
  if (options.scenario.empty() && !options.labels.empty()) throw UsageError("--labels is for --scenario; leave it out");
  if (!options.write_field.empty() && !options.field.pull.empty())
    throw UsageError("--write-field writes a forward field, which --pull-field has not; leave it out");
  if (!options.write_field.empty() && !has_image_suffix(options.write_field) && !has_mesh_suffix(options.write_field)) {
    throw UsageError("unknown suffix of --write-field \"" + options.write_field.string() +
                     "\"; a field is written as .mha .nrrd .nii .nii.gz, or as a mesh, .vtu .vtk");
  }
}

/// Reads the scenario of --scenario. @throws UsageError for a cell size, InputError for a page that is no scenario or
/// does not go with --write-field
Simulated read_simulated(const DeformOptions& options, ScenarioChoice choice) {
  if (options.field.cell_size) throw UsageError("--cell-size is for formulas and transforms, a scenario says its own");
  simulate::Scenario scenario = read_scenario(choice.file);
  if (!options.write_field.empty()) require_fitting_format(scenario, options.write_field, false);
  return {std::move(choice), std::move(scenario)};
}

void check_pull(const DeformOptions& options) {
  if (options.field.cell_size)
    throw UsageError("--cell-size is for formulas and transforms with -f; --pull-field has its own grid");
  if (options.preserve_mass)
    throw UsageError("--preserve mass needs the determinant of a forward map, which --pull-field has not");
  if (!options.points.empty()) throw UsageError("--points needs a forward field, --pull-field has no forward map");
}

/// Refuses options that do not go with the kind of OUTPUT: a DICOM series, or a file.
void check_output(const DeformOptions& options, bool series) {
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
}

}  // namespace

void refuse_bids(const DeformOptions& options) {
  throw UsageError("--bids says what the headers of a CT series say, " + options.input.path.string() +
                   " has none; leave it out");
}

DeformSources parse_sources(const DeformOptions& options) {
  DeformSources sources;
  for (const std::string& text : options.points) sources.points.push_back(parse_points(text));
  if (options.scenario.empty())
    sources.field = parse_field(options.field, options.common.nifti_frame);
  else
    sources.field = ScenarioChoice{options.scenario, options.labels};
  for (const std::string& text : options.with) sources.along.push_back(parse_along(text, options.common.nifti_frame));
  return sources;
}

Reads other_reads_of(const DeformOptions& options, const DeformSources& sources) {
  Reads reads;
  if (const auto* field = std::get_if<FieldChoice>(&sources.field)) reads.add_field(*field);
  if (!options.scenario.empty()) reads.add_file(options.scenario);
  if (!options.labels.empty()) reads.add_volume(volume_named(options.labels));
  for (const AlongChoice& choice : sources.along) {
    const auto* volume = std::get_if<AlongVolumeChoice>(&choice);
    if (volume && !volume->segmentation)
      reads.add_volume(volume_named(volume->input.path));
    else  // a DICOM object is one file
      reads.add_file(volume ? volume->input.path : std::get<AlongStructuresChoice>(choice).input);
  }
  if (names_volume(options.grid)) reads.add_volume(grid_volume(options.grid));
  for (const PointsChoice& points : sources.points) reads.add_file(points.input);
  if (!options.deidentify_key.empty()) reads.add_file(options.deidentify_key);
  return reads;
}

DeformRequest request_of(const DeformOptions& options) {
  check_choice_of_field(options);
  DeformSources sources = parse_sources(options);
  DeformRequest request{options, FieldChoice(), {}, {}, sources.points, is_series_output(options.output), {}, {}};
  request.others = request.reads = other_reads_of(options, sources);
  request.reads.add_volume(options.input);
  if (auto* scenario = std::get_if<ScenarioChoice>(&sources.field))
    request.field = read_simulated(options, std::move(*scenario));
  else
    request.field = std::get<FieldChoice>(std::move(sources.field));
  if (is_pull(request)) check_pull(options);
  check_grid(options.grid, is_pull(request));
  check_output(options, request.series);
  check_maps(options.maps, is_pull(request), request.series);
  request.volumes = along_of<AlongVolumeChoice>(sources.along);
  request.structures = along_of<AlongStructuresChoice>(sources.along);
  for (const AlongVolumeChoice& volume : request.volumes) check_along(volume, request.series);
  for (const AlongStructuresChoice& structures : request.structures) check_along(structures, request.series);
  return request;
}

std::vector<WantedMap> wanted_maps(const DeformRequest& request, const MapOptions& files) {
  constexpr MapPlace kOfMass[] = {&Maps::coverage, &Maps::jacobian};
  return wanted_maps(files, request.options.preserve_mass ? std::span(kOfMass) : std::span<const MapPlace>());
}

bool is_pull(const DeformRequest& request) {
  const auto* field = std::get_if<FieldChoice>(&request.field);
  return field && std::holds_alternative<PullChoice>(*field);
}

bool is_simulated(const DeformRequest& request) { return std::holds_alternative<Simulated>(request.field); }

bool reports_quality(const DeformRequest& request) { return !request.options.report.empty() && !is_pull(request); }

}  // namespace tetwarp::apps
