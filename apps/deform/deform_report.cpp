// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/deform/deform_report.h"

#include <cstdio>
#include <nlohmann/json.hpp>
#include <thread>

#include "apps/deform/output_grid.h"
#include "apps/simulate/simulate_report.h"
#include "deform/field_check.h"
#include "io/dicom_text.h"

namespace tetwarp::apps {

namespace {

using nlohmann::json;

/// What options chose for the derived series.
json form_json(const DicomForm& form) {
  json document = {{"transfer_syntax", name_of(form.encoding)},
                   {"keep_frame_of_reference", form.keep_frame_of_reference}};
  if (form.series_number) document["series_number"] = *form.series_number;
  if (form.series_description) document["series_description"] = *form.series_description;
  if (form.deidentification) {
    json& options = document["deidentified"][kConfidentialityEdition] = {"basic"};
    for (const ConfidentialityOption option : form.deidentification->options) options.push_back(name_of(option));
  }
  return document;
}

/// The field as it was given: the texts of the command line.
void add_field_options(const DeformRequest& request, json& options) {
  if (const auto* simulated = std::get_if<Simulated>(&request.field)) {
    options["scenario"] = simulated->choice.file.string();
    if (!simulated->choice.labels.empty()) options["labels"] = simulated->choice.labels.string();
    return;
  }
  const auto& field = std::get<FieldChoice>(request.field);
  if (const auto* pull = std::get_if<PullChoice>(&field)) {
    if (pull->fields.size() == 1) {
      options["pull_field"] = pull->fields.front().text;
    } else {
      for (const NamedField& one : pull->fields) options["pull_field"].push_back(one.text);
    }
    return;
  }
  const auto& forward = std::get<ForwardChoice>(field);
  options["field"] = json::array();
  for (const NamedField& one : forward.fields) options["field"].push_back(one.text);
  if (forward.cell_size) options["cell_size"] = *forward.cell_size;
}

json canonical_options(const DeformRun& run) {
  const DeformOptions& given = run.request.options;
  json options = {{"interpolation", name_of(given.interpolation)},
                  {"outside", name_of(given.outside)},
                  {"background", run.inputs.background}};
  if (given.preserve_mass) options["preserve"] = "mass";
  if (!is_same_grid(given.grid)) options["grid"] = given.grid;
  if (run.request.series && given.dicom != DicomForm()) options["dicom"] = form_json(given.dicom);
  add_field_options(run.request, options);
  return options;
}

std::vector<std::string> set_aside(const DeformHeaders& headers) {
  std::vector<std::string> files;
  if (!headers.input.series) return files;
  for (const LeftOutFile& one : headers.input.series->set_aside) files.push_back(to_string(one));
  return files;
}

/// What the sidecar says of INPUT. Where the output is de-identified it has nothing that names INPUT or can be looked
/// up.
json input_json(const DeformRun& run, const DeformWritten& written) {
  const DeformOptions& options = run.request.options;
  json document = json::object();
  const bool is_open = !options.dicom.deidentification;
  if (is_open) document = {{"path", options.input.path.string()}, {"sha256", written.input_sha256}};
  if (options.common.nifti_frame == NiftiFrame::qform) document["nifti_frame"] = "qform";
  if (!run.inputs.input->is_dicom()) return document;
  const DicomVolume& dicom = *run.inputs.input->dicom;
  if (is_open) {
    document["series_instance_uid"] = dicom.series_uid;
    if (const std::string& label = run.headers.input.series->label; !label.empty()) document["volume"] = label;
    document["set_aside"] = set_aside(run.headers);
  }
  document["rounded_voxels"] = dicom.rounded;
  if (dicom.padding) document["padding_hu"] = {dicom.padding->low, dicom.padding->high};
  return document;
}

json simulation_json(const SimulationSource& source) {
  json document = {{"scenario_sha256", source.scenario_sha256},
                   {"method", name_of(source.method)},
                   {"method_version", version_of(source.method)},
                   {"backend", source.backend}};
  if (!source.labels.empty()) document["labels_sha256"] = source.labels_sha256;
  return document;
}

json field_json(const DeformRun& run) {
  const DeformField& field = run.field;
  json document = {{"sha256", field.sha256},
                   {"direction", is_pull(field.field) ? "pull" : "forward"},
                   {"notes", field.origin.notes},
                   {"files", to_json(field.origin.files)}};
  document.update(place_json(field.field));
  if (const auto* forward = std::get_if<VertexField>(&field.field)) {
    const FieldView of = view(*forward, run.request.options.outside);
    document["arithmetic"] = is_coarse(run.result.output.geometry(), of) ? "coarse" : "dense";
  }
  if (field.simulation) document["simulation"] = simulation_json(*field.simulation);
  if (const auto& path = run.request.options.write_field; !path.empty()) document["written"] = path.string();
  return document;
}

json output_json(const DeformRun& run, const DeformWritten& written) {
  json document = {{"path", run.request.options.output.string()},
                   {"voxel_type", to_string(run.result.output.type())},
                   {"geometry", to_json(run.result.output.geometry())}};
  if (written.series) {
    document["series_instance_uid"] = written.series->series_uid;
    document["frame_of_reference_uid"] = written.series->frame_of_reference_uid;
    document["added_empty_attributes"] = written.series->added_empty;
  }
  return document;
}

json counts_json(const Report& report, bool pull) {
  json document = {{"covered", report.covered},      {"uncovered", report.uncovered}, {"clamped", report.clamped},
                   {"padded", report.padded},        {"conflicts", report.conflicts}, {"inverted", report.inverted},
                   {"degenerate", report.degenerate}};
  if (!pull) document["jacobian"] = {report.jacobian_min, report.jacobian_max};
  if (report.multiply_owned) document["multiply_owned"] = *report.multiply_owned;
  return document;
}

/// How far the map can be trusted.
json quality_json(const Report& report, const FieldCheck& check) {
  const auto& [quality, trip] = check;
  return {{"verdict", verdict(report, quality, trip)},
          {"largest_stretch", quality.largest_stretch},
          {"jacobian_edges", FieldQuality::kEdges},
          {"jacobian_shares", quality.shares()},
          {"round_trip",
           {{"slices", trip.slices},
            {"voxels", trip.voxels},
            {"forward_after_inverse", to_json(trip.forward_after_inverse)},
            {"inverse_after_forward", to_json(trip.inverse_after_forward)}}}};
}

/// What a de-identification did not do, "note: ..." and "warning: ..."; none where there was no de-identification.
std::vector<std::string> deidentification_notes(const DeformRequest& request, const DeformWritten& written) {
  if (!request.options.dicom.deidentification) return {};
  std::vector<std::string> notes = {std::string("note: de-identified by ") + kConfidentialityEdition +
                                    ", Basic Profile; not looked at: text in the pixels, faces that a rendering shows, "
                                    "names and comments in files of --points"};
  if (written.series && written.series->says_who) {
    notes.push_back(
        "warning: the source says that its pixels hold text (Burned In Annotation) or a face that can be recognised "
        "(Recognizable Visual Features); they are still there");
  }
  return notes;
}

}  // namespace

json sidecar(const DeformRun& run, const DeformWritten& written) {
  const DeformOptions& options = run.request.options;
  json document = provenance("deform");
  document["options"] = canonical_options(run);
  document["backend"] = run.result.backend;
  document["input"] = input_json(run, written);
  document["field"] = field_json(run);
  document["output"] = output_json(run, written);
  if (options.bids) document["bids"] = bids_sidecar_of(options.output).string();
  if (!run.request.volumes.empty())
    document["with"] = along_json(run.headers.along.volumes, run.inputs.along, run.result.along, written.along);
  if (!run.request.structures.empty())
    document["structures"] = structures_json(run.headers.structures, run.result.structures, written.structures);
  if (const json maps = maps_json(options.maps); !maps.empty()) document["maps"] = maps;
  if (!run.request.points.empty())
    document["points"] = points_json(run.request.points, run.headers.points, run.result.points);
  document["report"] = counts_json(run.result.report, is_pull(run.field.field));
  return document;
}

json report_with_times(const DeformRun& run, const DeformWritten& written) {
  json document = sidecar(run, written);
  const Report& report = run.result.report;
  std::vector<std::pair<const char*, double>> stages = {{"read", run.headers.seconds + run.inputs.seconds},
                                                        {"field", run.field.seconds},
                                                        {"resample", run.result.seconds},
                                                        {"write", written.seconds}};
  if (run.result.check) stages.emplace_back("check", run.result.check_seconds);
  double total = 0;
  for (const auto& [name, seconds] : stages) {
    document["stages"][name]["seconds"] = seconds;
    total += seconds;
  }
  document["total_seconds"] = total;
  if (!is_pull(run.field.field)) {
    document["paths"] = {
        {"gathered", report.paths.gathered}, {"walked", report.paths.walked}, {"claimed", report.paths.claimed}};
  }
  if (run.result.check) document["quality"] = quality_json(report, *run.result.check);
  const int threads = run.request.options.common.threads;
  document["threads"] = threads > 0 ? threads : static_cast<int>(std::thread::hardware_concurrency());
  document["memory"] = {{"peak_bytes", peak_memory_bytes()},
                        {"planned_bytes", run.plan.bytes},
                        {"source_bytes", run.inputs.input->volume.size_bytes()},
                        {"output_bytes", run.result.output.size_bytes()},
                        {"field_bytes", size_bytes(run.field.field)}};
  return document;
}

std::string summary(const DeformRun& run) {
  const Report& report = run.result.report;
  char share[32];
  std::snprintf(share, sizeof share, "%.2f %%",
                100.0 * static_cast<double>(report.covered) / static_cast<double>(report.covered + report.uncovered));
  std::string line = "wrote " + run.request.options.output.string() + ": " +
                     to_string(run.result.output.geometry().size) + " voxels, " + share + " covered, backend " +
                     run.result.backend;
  if (report.inverted + report.degenerate > 0) {
    line += "; the field folds: " + std::to_string(report.inverted) + " tetrahedra inverted, " +
            std::to_string(report.degenerate) + " flat";
  }
  if (report.clamped > 0) line += "; " + std::to_string(report.clamped) + " values clamped";
  if (report.conflicts > 0)
    line += "; " + std::to_string(report.conflicts) + " voxels outside the field were moved into";
  return line;
}

std::vector<std::string> notes_of(const DeformRun& run, const DeformWritten& written) {
  std::vector<std::string> notes;
  const auto add = [&](const char* kind, const std::vector<std::string>& lines) {
    for (const std::string& line : lines) notes.push_back(kind + line);
  };
  if (run.headers.input.series) add("warning: ", run.headers.input.series->warnings);
  add("warning: ", run.field.warnings);
  add("note: ", run.headers.notes);
  add("note: ", run.field.origin.notes);
  add("note: ", run.headers.along.notes);
  add("note: ", notes_of(run.headers.along.volumes, written.along));
  add("note: ", notes_of(run.request.points, run.headers.points, run.result.points));
  add("note: ", notes_of(run.headers.structures, run.result.structures));
  if (const std::size_t count = set_aside(run.headers).size(); count > 0) {
    notes.push_back("note: " + plural(count, "file") + " of the series " +
                    (count == 1 ? "is no slice" : "are no slices") + " of it; OUTPUT.json names them");
  }
  add("", deidentification_notes(run.request, written));
  return notes;
}

std::string title_of(const DeformRequest& request) {
  const auto* field = std::get_if<FieldChoice>(&request.field);
  if (request.options.dicom.deidentification) return field ? title_without_names(*field) : "deformed";
  return field ? title_of(*field) : "simulated " + std::get<Simulated>(request.field).choice.file.filename().string();
}

}  // namespace tetwarp::apps
