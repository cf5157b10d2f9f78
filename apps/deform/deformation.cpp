// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/deform/deformation.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "apps/cli/in_background.h"
#include "apps/deform/output_grid.h"
#include "apps/simulate/simulated_field.h"
#include "cuda/devices.h"
#include "deform/fields/lattice_mesh.h"
#include "deform/mass.h"
#include "io/dicom_bids.h"
#include "io/dicom_text.h"
#include "io/image_file.h"
#include "io/mesh_writer.h"
#include "io/preview.h"

namespace tetwarp::apps {

using nlohmann::json;

void Deformation::open() {
  const Stage stage(options_.common, "open");
  const InputHeader& header = input_->open(options_.common);
  record_.plan = plan_deformation(options_, record_.outputs, header);
  file_notes_ = header.notes;
  for (const std::filesystem::path& file : {std::filesystem::path(options_.grid), options_.labels}) {
    for (std::string& note : notes_of_file(file, options_.common.nifti_frame)) file_notes_.push_back(std::move(note));
  }
  record_.points.read();
  if (header.series) note_series(*header.series);
  open_seconds_ = stage.seconds();
}

void Deformation::note_series(const DicomSeries& series) {
  warnings_ = series.warnings;
  record_.volume_label = series.label;
  for (const LeftOutFile& one : series.set_aside) record_.set_aside.push_back(to_string(one));
  record_.outputs.structures.read(series.frame_of_reference_uid);
}

void Deformation::read() {
  Stage stage(options_.common, "read");
  record_.input = {input_, &input_->read(options_.common, stage.control())};
  record_.headers = input_->headers();
  record_.background = options_.background.value_or(record_.input->background);
  record_.outputs.along->read(options_.common, {.stop = interrupt_token()});
  record_.stages.emplace_back("read", open_seconds_ + stage.seconds());
}

void Deformation::make_field(const Worker& worker) {
  Stage stage(options_.common, "field");
  const Geometry& grid = record_.input->volume.geometry();
  if (!options_.scenario.empty()) {
    SimulatedField simulated = simulate_field(options_, record_.input->volume.view(), worker, stage.control());
    record_.field.forward.field = std::move(simulated.field);
    record_.field.simulation = std::move(simulated.source);
    for (const std::string& warning : simulated.warnings) warnings_.push_back(warning);
  } else if (options_.pull_field.empty()) {
    record_.field.forward =
        read_forward_field(options_.fields, grid, options_.cell_size, options_.common, stage.control());
    record_.field.notes = record_.field.forward.notes;
    record_.field.files = record_.field.forward.files;
  } else {
    record_.field.direction = Direction::pull;
    record_.field.pull =
        read_pull_field(options_.pull_field, grid, record_.plan.grid, options_.common, stage.control(), record_.field);
  }
  if (options_.grid == "fit")
    record_.plan.grid =
        output_grid("fit", grid, record_.field.forward.field, options_.outside, options_.common.nifti_frame);
  if (is_same_grid(options_.grid) && record_.plan.grid != grid) {
    record_.field.notes.push_back(std::string("INPUT's slices ") +
                                  (is_sheared(grid) ? "lean" : "lie at uneven distances") +
                                  ": the output has a straight, even grid of " + to_string(record_.plan.grid.size) +
                                  " voxels, so that the identity resamples too");
  }
  record_.field_sha256 = record_.field.hash(options_.common.threads);
  record_.output = AnyVolume(record_.plan.grid, record_.input->volume.type());
  record_.stages.emplace_back("field", stage.seconds());
}

void Deformation::resample(const Worker& worker) {
  Stage stage(options_.common, "resample");
  const Limits limits{.threads = options_.common.threads, .memory = options_.memory_bytes.value_or(0)};
  Backend backend = make_backend(worker.backend, record_.field.direction, record_.plan.grid, worker.device, limits);
  record_.backend = backend.name;
  // What --grid fit adds lies beyond the lattice; that this reaches over INPUT is known.
  const bool grown = options_.grid == "fit" && options_.outside == Outside::refuse;
  const Outside outside = grown ? Outside::background : options_.outside;
  const Control quiet{.stop = interrupt_token(), .stream = worker.stream};
  set_field(*backend.resampler, outside, quiet);
  if (!record_.points.empty())
    record_.points.move(record_.plan.grid, view(record_.field.forward.field, outside), limits, quiet);
  sampled_slices_.resize(record_.outputs.series ? static_cast<std::size_t>(record_.plan.grid.size.z) : 0);
  if (record_.outputs.series)
    series_.emplace(record_.outputs.volume, record_.plan.grid, *record_.headers, input_derivation(record_));
  MapStream maps(record_.plan.grid, record_.outputs.set);
  record_.outputs.set.write([&] {
    record_.outputs.maps->add_to(maps, record_.plan.grid, options_.preserve_mass, series_ ? &*series_ : nullptr);
  });
  std::vector<Target> targets = record_.outputs.along->targets_on(record_.plan.grid, false, options_.interpolation);
  targets.insert(targets.begin(), main_target());
  Control control = stage.control();
  control.stream = worker.stream;
  if (record_.outputs.series || options_.preserve_mass) {
    control.finished = [&](const Region& slices) {
      if (options_.preserve_mass) scale_mass(slices);
      if (record_.outputs.series) record_.outputs.set.write([&] { write_slices(slices); });
    };
  }
  maps.run([&](const Region& slab, const Maps& of_slab) {
    mass_.maps = of_slab;
    record_.report += resample_slab(*backend.resampler, slab, targets, of_slab, control);
  });
  record_.report.clamped += mass_.saturated;
  move_structures(*backend.resampler, outside, quiet);
  resample_onto_own_grids(worker);
  record_.stages.emplace_back("resample", stage.seconds());
  if (reports_quality(options_)) check(*backend.resampler, quiet);
}

/// Looks at the field, and where its inverse leads. @param resampler  holds the field
void Deformation::check(Resampler& resampler, const Control& control) {
  Stage stage(options_.common, "check");
  const Limits limits{.threads = options_.common.threads};
  const VertexField& field = record_.field.forward.field;
  record_.check = {.quality = measure_quality(field, limits, stage.control()),
                   .trip = measure_round_trip(resampler, field, limits, control)};
  record_.stages.emplace_back("check", stage.seconds());
}

/// INPUT as it goes through the field: with --preserve mass in a real type that holds its values, so that they are
/// rounded once.
Target Deformation::main_target() {
  Target target{.source = record_.input->volume.view(),
                .output = record_.output.view(),
                .interpolation = options_.interpolation,
                .background = record_.background,
                .padding = padding_of_input(),
                .sampled_slices = sampled_slices_};
  if (!options_.preserve_mass) return target;
  const VoxelType type = type_of_mass(record_.input->volume.type());
  mass_.source = AnyVolume(record_.input->volume.geometry(), type);
  mass_.resampled = AnyVolume(record_.plan.grid, type);
  dispatch(record_.input->volume.type(), [&](auto voxel) {
    const auto from = record_.input->volume.as<decltype(voxel)>();
    const auto convert = [&](auto to) {
      using Real = typename decltype(to)::value_type;
      std::transform(from.begin(), from.end(), to.begin(), [](auto value) { return static_cast<Real>(value); });
    };
    type == VoxelType::f64 ? convert(mass_.source.as<double>()) : convert(mass_.source.as<float>());
  });
  target.source = std::as_const(mass_.source).view();
  target.output = mass_.resampled.view();
  return target;
}

std::optional<PaddingRange> Deformation::padding_of_input() const {
  return record_.input->is_dicom() ? record_.input->dicom->padding : std::nullopt;
}

void Deformation::scale_mass(const Region& slices) {
  mass_.saturated += preserve_mass(std::as_const(mass_.resampled).view(), mass_.maps, padding_of_input(),
                                   record_.output.view(), slices);
}

void Deformation::set_field(Resampler& resampler, Outside outside, const Control& control) const {
  if (record_.field.direction == Direction::pull) {
    resampler.set_field(view(record_.field.pull, outside), control);
  } else {
    resampler.set_field(view(record_.field.forward.field, outside), control);
  }
}

void Deformation::resample_onto_own_grids(const Worker& worker) {
  const Limits limits{.threads = options_.common.threads, .memory = options_.memory_bytes.value_or(0)};
  const Control control{.stop = interrupt_token(), .stream = worker.stream};
  for (const Geometry& grid : record_.outputs.along->own_grids()) {
    const Backend backend = make_backend(worker.backend, record_.field.direction, grid, worker.device, limits);
    set_field(*backend.resampler, options_.outside, control);
    const std::vector<Target> targets = record_.outputs.along->targets_on(grid, true, options_.interpolation);
    backend.resampler->resample(whole(grid), targets, {}, control);
  }
}

/// @param resampler  holds the field
void Deformation::move_structures(Resampler& resampler, Outside outside, const Control& control) {
  AlongStructures& structures = record_.outputs.structures;
  const Geometry& source = record_.input->volume.geometry();
  const Limits limits{.threads = options_.common.threads};
  std::optional<PointMover> mover;
  if (!structures.empty() && record_.field.direction == Direction::forward)
    mover.emplace(record_.plan.grid, view(record_.field.forward.field, outside), limits, control);
  structures.move(mover ? &*mover : nullptr, source, record_.plan.grid, outside, options_.common.threads);
  if (!structures.needs_inverse()) return;
  MapStream inverse(record_.plan.grid, record_.outputs.set);
  inverse.add(&Maps::inverse_mm, nullptr);
  inverse.run([&](const Region& slab, const Maps& maps) {
    resample_slab(resampler, slab, {}, maps, control);
    structures.reslice(maps.inverse_mm, options_.common.threads);
  });
  structures.finish();
}

/// While others are resampled.
void Deformation::write_slices(const Region& slices) {
  series_->write(std::as_const(record_.output).view(), slices.begin.z, slices.end.z, sampled_slices_,
                 options_.common.threads, {.stop = interrupt_token()});
}

void Deformation::write() {
  record_.input_sha256 = input_->sha256();
  record_.outputs.set.write([&] { write_files(); });
}

/// The system takes 60 ms to get a gigabyte back: meanwhile the disk is waited for.
void Deformation::commit() {
  std::vector<glm::vec3> forward, pull;
  forward.swap(record_.field.forward.field.displacement);
  pull.swap(record_.field.pull.displacement);
  const auto field = in_background([&] {
    std::vector<glm::vec3>().swap(forward);
    std::vector<glm::vec3>().swap(pull);
  });
  const auto volumes = in_background([&] {
    record_.input.reset();
    input_.reset();
    record_.output.release();
  });
  record_.outputs.set.commit();
}

void Deformation::write_files() {
  const auto start = std::chrono::steady_clock::now();
  const std::string made_by = "tetwarp field " + record_.field_sha256.substr(0, 16);
  if (record_.outputs.series) {
    record_.dicom_report = series_->report();
    record_.outputs.structures.write(*record_.dicom_report, derivation(record_));
  } else {
    Stage stage(options_.common, "write");
    write_image(record_.outputs.volume, std::as_const(record_.output).view(),
                {.compression = options_.compression.value_or(-1), .metadata = {{"descrip", made_by}}});
  }
  if (options_.bids) {
    write_json(record_.outputs.bids,
               Record::open(json::parse(bids_sidecar(*record_.headers, record_.plan.grid, input_derivation(record_)))));
  }
  if (!record_.outputs.preview.empty()) write_preview_picture();
  if (!record_.outputs.field.empty()) write_field();
  std::optional<DerivedOutput> series;
  if (record_.dicom_report)
    series.emplace(WrittenSeries{*record_.headers, *record_.dicom_report, record_.plan.grid}, derivation(record_));
  record_.outputs.along->write(options_.compression, made_by, series);
  record_.points.write(record_.outputs.points);
  const bool hides = options_.dicom.deidentification.has_value();
  write_json(record_.outputs.sidecar, Record::of(hides, sidecar(record_)));
  record_.stages.emplace_back("write", std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  if (!record_.outputs.report.empty())
    write_json(record_.outputs.report, Record::of(hides, report_with_times(record_)));
}

/// What was used: of several the composed one.
void Deformation::write_field() {
  const VertexField& field = record_.field.forward.field;
  if (has_mesh_suffix(record_.outputs.field))
    return write_mesh_file(record_.outputs.field, mesh_of(field), field.lattice);
  require(field.mesh.is_empty(), "the field is a mesh, which " + options_.write_field.string() +
                                     " cannot hold; write it as a mesh, .vtu or .vtk");
  write_field_file(record_.outputs.field, field);
}

/// Beside an output on another grid stands INPUT as it lies there.
void Deformation::write_preview_picture() {
  const ConstVolumeView before = record_.input->volume.view(), after = std::as_const(record_.output).view();
  if (*before.geometry == record_.plan.grid) return write_preview(record_.outputs.preview, before, after, title());
  AnyVolume on_grid(record_.plan.grid, record_.input->volume.type());
  const PullField none = resting_pull_field(record_.plan.grid);
  const auto resampler = make_cpu_pull_resampler(record_.plan.grid, {.threads = options_.common.threads});
  resampler->set_field(view(none, Outside::background));
  const Target target{.source = before,
                      .output = on_grid.view(),
                      .background = record_.background,
                      .padding = record_.input->is_dicom() ? record_.input->dicom->padding : std::nullopt};
  resampler->resample(whole(record_.plan.grid), {&target, 1});
  write_preview(record_.outputs.preview, std::as_const(on_grid).view(), after, title());
}

/// What the preview says above the pictures: the fields by name, files without their folders, or
/// where they would tell the patient not at all.
std::string Deformation::title() const {
  if (options_.dicom.deidentification) return title_without_names(options_.fields);
  if (!options_.scenario.empty()) return "simulated " + options_.scenario.filename().string();
  return title_of_fields(options_.fields, options_.pull_field);
}

std::vector<std::string> Deformation::notes() const {
  std::vector<std::string> notes;
  const auto add = [&](const char* kind, const std::vector<std::string>& lines) {
    for (const std::string& line : lines) notes.push_back(kind + line);
  };
  add("warning: ", warnings_);
  add("note: ", file_notes_);
  add("note: ", record_.field.notes);
  add("note: ", record_.outputs.along->notes());
  add("note: ", record_.points.notes());
  add("note: ", record_.outputs.structures.notes());
  if (!record_.set_aside.empty()) {
    const bool one = record_.set_aside.size() == 1;
    notes.push_back("note: " + plural(record_.set_aside.size(), "file") + " of the series " +
                    (one ? "is no slice" : "are no slices") + " of it; OUTPUT.json names them");
  }
  add("", deidentification_notes(record_));
  return notes;
}

}  // namespace tetwarp::apps
