// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/deform/deform_plan.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "apps/deform/output_grid.h"
#include "apps/fields/read_field.h"
#include "apps/simulate/simulated_field.h"
#include "backend/backend.h"
#include "deform/mass.h"
#include "deform/residuals.h"
#include "io/image_file.h"
#include "io/lower_case.h"
#include "io/mesh_writer.h"

namespace tetwarp::apps {

namespace {

/// Program, libraries and what a pass keeps per thread, next to volumes and field.
constexpr std::uint64_t kOverheadBytes = 200'000'000;

void check_input(const DeformOptions& options, bool series, const InputHeader& input) {
  if (series && !input.series) {
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
}

/// Memory of the field. @param volume  grid of INPUT  @param grid  of the output
std::uint64_t bytes_of_field(const DeformRequest& request, const Geometry& volume, const Geometry& grid) {
  if (const auto* simulated = std::get_if<Simulated>(&request.field))
    return simulation_bytes(simulated->scenario, volume, !simulated->choice.labels.empty());
  const auto& field = std::get<FieldChoice>(request.field);
  if (const auto* pull = std::get_if<PullChoice>(&field)) return field_bytes(*pull, grid);
  return field_bytes(std::get<ForwardChoice>(field), volume);
}

/// Memory that a run takes at most. @param grid  of the output
std::uint64_t memory_bytes(const DeformRequest& request, const DeformHeaders& headers, const Geometry& grid) {
  const InputHeader& input = headers.input;
  const auto voxels = static_cast<std::uint64_t>(voxel_count(input.geometry)),
             output_voxels = static_cast<std::uint64_t>(voxel_count(grid));
  const auto slices = static_cast<std::uint64_t>(grid.size.z);
  const std::uint64_t of_check = reports_quality(request) ? sizeof(glm::vec3) * output_voxels / slices *
                                                                std::min(slices, std::uint64_t{RoundTrip::kMostSlices})
                                                          : 0;
  const std::uint64_t of_mass =
      request.options.preserve_mass ? size_bytes(type_of_mass(input.type)) * (voxels + output_voxels) : 0;
  const std::uint64_t of_structures = request.structures.empty() ? 0 : MapStream::bytes(grid, &Maps::inverse_mm, false);
  return of_mass + of_check + voxels * size_bytes(input.type) + output_voxels * size_bytes(input.type) +
         map_bytes(wanted_maps(request, request.options.maps), grid) +
         along_bytes(headers.along.volumes, output_voxels) + of_structures + kOverheadBytes;
}

/// The forward field as --write-field writes it. @param in_memory  bytes of `bytes_of_field`
std::uint64_t bytes_of_written_field(const DeformRequest& request, const Geometry& volume, std::uint64_t in_memory) {
  const auto* simulated = std::get_if<Simulated>(&request.field);
  if (!simulated) return in_memory;
  const Geometry lattice = lattice_over(straightened(volume), simulated->scenario.cell_size);
  return static_cast<std::uint64_t>(voxel_count(lattice)) * sizeof(glm::vec3);
}

/// @param grid  of the output  @param of_field  bytes of the field, were it written
DiskBytes disk_bytes(const DeformRequest& request, const DeformHeaders& headers, const Geometry& grid,
                     std::uint64_t of_field) {
  const DeformOptions& options = request.options;
  const bool compressed = options.compression.value_or(0) > 0;
  const auto voxels = static_cast<std::uint64_t>(voxel_count(grid));
  DiskBytes disk;
  const auto add = [&](const std::filesystem::path& file, std::uint64_t bytes, bool is_packed) {
    if (!file.empty()) (is_packed || lower(file.extension().string()) == ".gz" ? disk.packed : disk.plain) += bytes;
  };
  add(options.output, voxels * size_bytes(headers.input.type),
      request.series ? options.dicom.encoding != DicomEncoding::uncompressed : compressed);
  add(options.maps.coverage, voxels * sizeof(std::uint8_t), false);
  add(options.maps.folds, voxels * sizeof(std::uint16_t), false);
  add(options.maps.jacobian, voxels * sizeof(float), false);
  add(options.maps.inverse, voxels * sizeof(glm::vec3), false);
  add(options.write_field, of_field, has_mesh_suffix(options.write_field));
  for (const AlongHeader& along : headers.along.volumes) {
    const std::filesystem::path& file = along.choice.output;
    add(file, along_result_bytes(along, voxels), compressed || is_object_output(file));
  }
  return disk;
}

}  // namespace

DeformHeaders open_headers(const DeformRequest& request, SharedInput& input, OutputSet& outputs) {
  const DeformOptions& options = request.options;
  const Stage stage(options.common, "open");
  DeformHeaders headers{input.open(options.common), {}, {}, {}, {}, {}};
  check_input(options, request.series, headers.input);
  headers.along = open_along(request.volumes, headers.input);
  outputs.add_reads(request.reads.slices(options.input, headers.input));
  if (names_volume(options.grid)) headers.grid = grid_of_volume(options.grid, options.common.nifti_frame);
  headers.notes = headers.input.notes;
  for (const std::filesystem::path& file : {std::filesystem::path(options.grid), options.labels}) {
    for (std::string& note : notes_of_file(file, options.common.nifti_frame)) headers.notes.push_back(std::move(note));
  }
  headers.points = read_points(request.points);
  if (headers.input.series)
    headers.structures = read_structures(request.structures, headers.input.series->frame_of_reference_uid);
  headers.seconds = stage.seconds();
  return headers;
}

DeformPlan plan_deformation(const DeformRequest& request, const DeformHeaders& headers) {
  const DeformOptions& options = request.options;
  DeformPlan plan;
  if (!is_fitting_grid(options.grid)) plan.grid = headers.grid.value_or(straightened(headers.input.geometry));
  if (has_registration_suffix(options.maps.inverse)) require_registration_fits(*plan.grid);
  const Geometry& grid = plan.grid ? *plan.grid : headers.input.geometry;
  const std::uint64_t of_field = bytes_of_field(request, headers.input.geometry, grid);
  plan.bytes = memory_bytes(request, headers, grid) + of_field;
  plan.disk = disk_bytes(request, headers, grid, bytes_of_written_field(request, headers.input.geometry, of_field));
  if (options.memory_bytes && plan.bytes > *options.memory_bytes && !runs_on_device(chosen(options.backend))) {
    throw Error("about " + format_bytes(plan.bytes) + " of memory are needed, --memory allows " +
                format_bytes(*options.memory_bytes) + "; a larger --cell-size needs less");
  }
  return plan;
}

std::string describe(const DeformPlan& plan, const DeformRequest& request) {
  return "would write " + request.options.output.string() + ": " +
         (plan.grid ? to_string(plan.grid->size) + " voxels" : "as many voxels as the deformed lattice needs") +
         " as " + (request.series ? "a DICOM series" : "a file") + "; about " + format_bytes(plan.bytes) + " of memory";
}

}  // namespace tetwarp::apps
