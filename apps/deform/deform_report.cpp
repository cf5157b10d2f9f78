// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/deform/deform_report.h"

#include <cstdio>
#include <nlohmann/json.hpp>
#include <thread>

#include "apps/deform/output_grid.h"

namespace tetwarp::apps {

namespace {

using nlohmann::json;

/// What was chosen of the series.
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

json canonical_options(const DeformRecord& of) {
  json options = {{"interpolation", name_of(of.options.interpolation)},
                  {"outside", name_of(of.options.outside)},
                  {"background", of.background}};
  if (of.options.preserve_mass) options["preserve"] = "mass";
  if (!is_same_grid(of.options.grid)) options["grid"] = of.options.grid;
  if (of.outputs.series && of.options.dicom != DicomForm()) options["dicom"] = form_json(of.options.dicom);
  if (of.field.direction == Direction::pull) {
    options["pull_field"] = of.options.pull_field;
  } else if (!of.options.scenario.empty()) {
    options["scenario"] = of.options.scenario.string();
    if (!of.options.labels.empty()) options["labels"] = of.options.labels.string();
  } else {
    options["field"] = of.options.fields;
    if (of.options.cell_size) options["cell_size"] = *of.options.cell_size;
  }
  return options;
}

/// Of a de-identified series nothing that names its source or can be looked up.
json input_json(const DeformRecord& of) {
  json document = json::object();
  const bool is_open = !of.options.dicom.deidentification;
  if (is_open) document = {{"path", of.options.input.path.string()}, {"sha256", of.input_sha256}};
  if (of.options.common.nifti_frame == NiftiFrame::qform) document["nifti_frame"] = "qform";
  if (!of.input->is_dicom()) return document;
  if (is_open) {
    document["series_instance_uid"] = of.input->dicom->series_uid;
    if (!of.volume_label.empty()) document["volume"] = of.volume_label;
    document["set_aside"] = of.set_aside;
  }
  document["rounded_voxels"] = of.input->dicom->rounded;
  if (of.input->dicom->padding)
    document["padding_hu"] = {of.input->dicom->padding->low, of.input->dicom->padding->high};
  return document;
}

json simulation_json(const SimulationSource& source) {
  json document = {{"scenario_sha256", source.scenario_sha256}, {"method", source.method}, {"backend", source.backend}};
  if (!source.labels.empty()) document["labels_sha256"] = source.labels_sha256;
  return document;
}

/// How far the map can be trusted.
json quality_json(const DeformRecord& of) {
  const auto& [quality, trip] = *of.check;
  return {{"verdict", verdict(of.report, quality, trip)},
          {"largest_stretch", quality.largest_stretch},
          {"jacobian_edges", FieldQuality::kEdges},
          {"jacobian_shares", quality.shares()},
          {"round_trip",
           {{"slices", trip.slices},
            {"voxels", trip.voxels},
            {"forward_after_inverse", to_json(trip.forward_after_inverse)},
            {"inverse_after_forward", to_json(trip.inverse_after_forward)}}}};
}

}  // namespace

DicomDerivation derivation(const DeformRecord& of) {
  const bool pull = of.field.direction == Direction::pull, deformed = pull || !of.field.forward.identity;
  const char* what =
      !deformed ? "Resampled by the identity" : (pull ? "Deformed by a pull field" : "Deformed by a field of vertices");
  return {.field_sha256 = of.field_sha256,
          .parameters =
              std::string("outside=") + name_of(of.options.outside) + (pull ? " direction=pull" : " direction=forward"),
          .description = what,
          .deformed = deformed,
          .background_hu = of.background,
          .form = of.options.dicom};
}

DicomDerivation input_derivation(const DeformRecord& of) {
  DicomDerivation of_input = derivation(of);
  of_input.parameters = "interpolation=" + std::string(name_of(of.options.interpolation)) +
                        " outside=" + name_of(of.options.outside) + " background=" + json(of.background).dump() +
                        (of.field.direction == Direction::pull ? " direction=pull" : " direction=forward") +
                        (of.options.preserve_mass ? " preserve=mass" : "");
  of_input.description += std::string(", ") + name_of(of.options.interpolation) + " interpolation";
  return of_input;
}

std::vector<std::string> deidentification_notes(const DeformRecord& of) {
  if (!of.options.dicom.deidentification) return {};
  std::vector<std::string> notes = {std::string("note: de-identified by ") + kConfidentialityEdition +
                                    ", Basic Profile; not looked at: text in the pixels, faces that a rendering shows, "
                                    "names and comments in files of --points"};
  if (of.dicom_report && of.dicom_report->says_who) {
    notes.push_back(
        "warning: the source says that its pixels hold text (Burned In Annotation) or a face that can be recognised "
        "(Recognizable Visual Features); they are still there");
  }
  return notes;
}

json sidecar(const DeformRecord& of) {
  json document = provenance("deform");
  document["options"] = canonical_options(of);
  document["backend"] = of.backend;
  document["input"] = input_json(of);
  document["field"] = {{"sha256", of.field_sha256},
                       {"direction", of.field.direction == Direction::pull ? "pull" : "forward"},
                       {"notes", of.field.notes},
                       {"files", to_json(of.field.files)}};
  document["field"].update(of.field.place());
  if (of.field.simulation) document["field"]["simulation"] = simulation_json(*of.field.simulation);
  if (!of.options.write_field.empty()) document["field"]["written"] = of.options.write_field.string();
  document["output"] = {{"path", of.options.output.string()},
                        {"voxel_type", to_string(of.output.type())},
                        {"geometry", to_json(of.output.geometry())}};
  if (of.dicom_report) {
    document["output"]["series_instance_uid"] = of.dicom_report->series_uid;
    document["output"]["frame_of_reference_uid"] = of.dicom_report->frame_of_reference_uid;
    document["output"]["added_empty_attributes"] = of.dicom_report->added_empty;
  }
  if (of.options.bids) document["bids"] = bids_sidecar_of(of.options.output).string();
  if (const json along = of.outputs.along->describe(); !along.empty()) document["with"] = along;
  if (!of.outputs.structures.empty()) document["structures"] = of.outputs.structures.describe();
  if (const json maps = of.outputs.maps->describe(); !maps.empty()) document["maps"] = maps;
  if (!of.points.empty()) document["points"] = of.points.to_json();
  document["report"] = {{"covered", of.report.covered},      {"uncovered", of.report.uncovered},
                        {"clamped", of.report.clamped},      {"padded", of.report.padded},
                        {"conflicts", of.report.conflicts},  {"inverted", of.report.inverted},
                        {"degenerate", of.report.degenerate}};
  if (of.field.direction == Direction::forward)
    document["report"]["jacobian"] = {of.report.jacobian_min, of.report.jacobian_max};
  if (of.report.multiply_owned) document["report"]["multiply_owned"] = *of.report.multiply_owned;
  return document;
}

json report_with_times(const DeformRecord& of) {
  json document = sidecar(of);
  double total = 0;
  for (const auto& [name, seconds] : of.stages) {
    document["stages"][name]["seconds"] = seconds;
    total += seconds;
  }
  document["total_seconds"] = total;
  if (of.field.direction == Direction::forward) {
    document["paths"] = {{"gathered", of.report.paths.gathered},
                         {"walked", of.report.paths.walked},
                         {"claimed", of.report.paths.claimed}};
  }
  if (of.check) document["quality"] = quality_json(of);
  document["threads"] =
      of.options.common.threads > 0 ? of.options.common.threads : static_cast<int>(std::thread::hardware_concurrency());
  document["memory"] = {{"peak_bytes", peak_memory_bytes()},
                        {"planned_bytes", of.plan.bytes},
                        {"source_bytes", of.input->volume.size_bytes()},
                        {"output_bytes", of.output.size_bytes()},
                        {"field_bytes", of.field.size_bytes()}};
  return document;
}

std::string summary(const DeformRecord& of) {
  char share[32];
  std::snprintf(
      share, sizeof share, "%.2f %%",
      100.0 * static_cast<double>(of.report.covered) / static_cast<double>(of.report.covered + of.report.uncovered));
  std::string line = "wrote " + of.options.output.string() + ": " + to_string(of.output.geometry().size) + " voxels, " +
                     share + " covered, backend " + of.backend;
  if (of.report.inverted + of.report.degenerate > 0) {
    line += "; the field folds: " + std::to_string(of.report.inverted) + " tetrahedra inverted, " +
            std::to_string(of.report.degenerate) + " flat";
  }
  if (of.report.clamped > 0) line += "; " + std::to_string(of.report.clamped) + " values clamped";
  if (of.report.conflicts > 0)
    line += "; " + std::to_string(of.report.conflicts) + " voxels outside the field were moved into";
  return line;
}

}  // namespace tetwarp::apps
