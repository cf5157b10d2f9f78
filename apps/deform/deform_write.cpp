// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/deform/deform_write.h"

#include <nlohmann/json.hpp>

#include "apps/cli/in_background.h"
#include "io/dicom_bids.h"
#include "io/dicom_text.h"
#include "io/field_file.h"
#include "io/image_file.h"
#include "io/preview.h"

namespace tetwarp::apps {

namespace {

using nlohmann::json;

/// Next to an output on another grid stands INPUT as it lies there.
void write_preview_picture(const DeformRun& run, const std::filesystem::path& staged) {
  const ConstVolumeView before = run.inputs.input->volume.view(), after = run.result.output.view();
  const Geometry& grid = run.field.grid;
  const std::string title = title_of(run.request);
  if (*before.geometry == grid) return write_preview(staged, before, after, title);
  AnyVolume on_grid(grid, run.inputs.input->volume.type());
  const PullField none = zero_pull_field(grid);
  const auto resampler = make_cpu_pull_resampler(grid, {.threads = run.request.options.common.threads});
  resampler->set_field(view(none, Outside::background));
  const Target target{
      .source = before, .output = on_grid.view(), .background = run.inputs.background, .padding = run.inputs.padding()};
  resampler->resample(whole(grid), {&target, 1});
  write_preview(staged, std::as_const(on_grid).view(), after, title);
}

/// OUTPUT and all that goes along with it, and what there is of both in other forms.
void write_volumes(const DeformRun& run, const DeformSinks& sinks, const DeformOutputs& outputs,
                   DeformWritten& written) {
  const DeformOptions& options = run.request.options;
  const ImageWriteOptions how{.compression = options.compression.value_or(-1),
                              .metadata = {{"descrip", "tetwarp field " + run.field.sha256.substr(0, 16)}}};
  const DicomDerivation derivation = derivation_of(run.request, run.inputs, run.field);
  if (sinks.series) {
    written.series = sinks.series->report();
    written.structures = write_structures(outputs.structures, run.headers.structures, run.result.structures,
                                          *written.series, derivation);
  } else {
    Stage stage(options.common, "write");
    write_image(outputs.volume, run.result.output.view(), how);
  }
  if (options.bids) {
    const DicomDerivation of_input = input_derivation_of(run.request, run.inputs, run.field);
    write_json(outputs.bids, Record::open(json::parse(bids_sidecar(*run.inputs.headers, run.field.grid, of_input))));
  }
  if (!outputs.preview.empty()) write_preview_picture(run, outputs.preview);
  if (!outputs.field.empty())
    write_vertex_field(outputs.field, std::get<VertexField>(run.field.field), {}, run.request.options.write_field);
  std::optional<DerivedOutput> series;
  if (written.series)
    series.emplace(DerivedOutput{WrittenSeries{*run.inputs.headers, *written.series, run.field.grid}, derivation});
  written.along =
      write_along(outputs.volumes, run.headers.along.volumes, run.inputs.along, run.result.along, how, series);
  write_points(outputs.points, run.headers.points, run.result.points);
}

}  // namespace

DeformWritten write_outputs(const DeformRun& run, DeformSinks sinks, DeformOutputs& outputs, std::string input_sha256) {
  DeformWritten written;
  written.input_sha256 = std::move(input_sha256);
  outputs.set.write([&] {
    const auto start = std::chrono::steady_clock::now();
    write_volumes(run, sinks, outputs, written);
    const bool hides = run.request.options.dicom.deidentification.has_value();
    write_json(outputs.sidecar, Record::of(hides, sidecar(run, written)));
    written.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (!outputs.report.empty()) write_json(outputs.report, Record::of(hides, report_with_times(run, written)));
  });
  return written;
}

/// The system takes 60 ms to get a gigabyte back: meanwhile the disk is waited for.
void commit_outputs(DeformOutputs& outputs, DeformInputs inputs, DeformField field, DeformResult result) {
  const auto of_field = in_background([&] { field.field = VertexField(); });
  const auto of_volumes = in_background([&] {
    inputs.input.reset();
    result.output.release();
  });
  outputs.set.commit();
}

}  // namespace tetwarp::apps
