#include <algorithm>
#include <atomic>
#include <cmath>
#include <future>
#include <limits>
#include <nlohmann/json.hpp>
#include <thread>

#include "apps/backend.h"
#include "apps/field_source.h"
#include "apps/further_volumes.h"
#include "apps/input.h"
#include "apps/map_outputs.h"
#include "apps/output.h"
#include "apps/output_grid.h"
#include "apps/points_option.h"
#include "cuda/devices.h"
#include "deform/field_quality.h"
#include "deform/fields/formula.h"
#include "deform/mass.h"
#include "io/field_file.h"
#include "io/image_file.h"
#include "io/preview.h"

namespace tetwarp::apps {

namespace {

using nlohmann::json;

/// Program, libraries and what a pass keeps per thread, beside volumes and field.
constexpr std::uint64_t kOverheadBytes = 200'000'000;

std::filesystem::path folder_of(const std::filesystem::path& file) {
  return file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
}

/// Where the results go while they are made.
struct Outputs {
  bool series = false;
  OutputSet set;
  std::optional<MapOutputs> maps;
  std::optional<FurtherVolumes> further;
  std::filesystem::path volume, sidecar, report, preview;
  std::vector<std::filesystem::path> points;
};

/// The field of either direction, with what is said about it.
struct AnyField {
  Direction direction = Direction::forward;
  ForwardField forward;
  PullField pull;
  std::vector<std::string> notes;

  const Geometry& lattice() const { return direction == Direction::pull ? pull.grid : forward.field.lattice; }
  const std::vector<glm::vec3>& displacement() const {
    return direction == Direction::pull ? pull.displacement : forward.field.displacement;
  }
};

/// One run of the command, stage by stage.
class Deformation {
 public:
  explicit Deformation(const DeformOptions& options)
      : options_(options), points_(options.points), outputs_(begin_outputs()) {}

  int run();

 private:
  Outputs begin_outputs() const;
  std::uint64_t plan_bytes(const InputHeader& input);
  void check_input(const InputHeader& input);
  void print_plan() const;
  void read();
  void read_field();
  Backend resample();
  bool wants_check() const { return !outputs_.report.empty() && options_.pull_field.empty(); }
  void check(Resampler& resampler);
  void set_field(Resampler& resampler, Outside outside) const;
  void resample_onto_own_grids();
  void write();
  void write_preview_picture();
  void begin_series();
  void write_slices(const Region& slices);
  Target main_target();
  void scale_mass(const Region& slices);
  json canonical_options() const;
  json sidecar() const;
  json report_with_times() const;
  std::string title() const;
  std::string summary() const;

  const DeformOptions& options_;
  PointsOption points_;
  Outputs outputs_;
  InputVolume input_;
  AnyField field_;
  Geometry grid_;  ///< of the output
  std::string input_sha256_, field_sha256_, backend_;
  double background_ = 0;
  std::uint64_t planned_bytes_ = 0;
  std::vector<std::string> notes_, set_aside_;
  AnyVolume output_;
  struct {
    AnyVolume source, resampled;
    ConstVolumeView jacobian;
    std::atomic<std::uint64_t> saturated = 0;
  } mass_;  ///< with --preserve mass: in float
  std::vector<SliceRange> sampled_slices_;
  Report report_;
  struct {
    FieldQuality quality;
    RoundTrip trip;
  } check_;  ///< with --report
  std::optional<DerivedSeriesWriter> series_;
  std::optional<DicomWriteReport> dicom_report_;
  std::vector<std::pair<std::string, double>> stages_;
};

Outputs Deformation::begin_outputs() const {
  const DeformOptions& o = options_;
  if (o.pull_field.empty()) {
    check_fields(o.fields, o.cell_size);
  } else if (o.cell_size) {
    throw UsageError("--cell-size is for formulas, --pull-field has its own grid");
  }
  check_grid(o.grid, !o.pull_field.empty());
  if (o.preserve_mass && !o.pull_field.empty()) {
    throw UsageError("--preserve mass needs the determinant of a forward map, which --pull-field has not");
  }
  std::vector<std::filesystem::path> inputs = FurtherVolumes::inputs(o.with);
  inputs.push_back(o.input.path);
  if (!is_same_grid(o.grid) && o.grid != "fit") inputs.emplace_back(o.grid);
  for (const std::filesystem::path& path : field_files(o.fields)) inputs.push_back(path);
  if (!o.pull_field.empty()) inputs.push_back(o.pull_field);
  if (!o.pull_field.empty() && !points_.empty())
    throw UsageError("--points needs a forward field, --pull-field has no forward map");
  for (const std::filesystem::path& path : points_.inputs()) inputs.push_back(path);
  const bool series = is_series_output(o.output);
  if (series && has_image_suffix(o.input.path)) {
    throw UsageError("a DICOM series can only be derived from DICOM, not from " + o.input.path.string() +
                     "; name the output .nii.gz, .nii, .nrrd or .mha");
  }
  if (series && !is_same_grid(o.grid)) {
    throw UsageError("a DICOM series has the grid of the series it is derived from, not that of --grid " + o.grid +
                     "; name the output .nii.gz, .nii, .nrrd or .mha");
  }
  if (o.compression && (series || o.output.extension() == ".nii")) {
    throw UsageError("--compress is for .nii.gz, .nrrd and .mha, not for " + o.output.string());
  }
  if (!o.preview.empty() && o.preview.extension() != ".png") {
    throw UsageError("unknown suffix of --preview \"" + o.preview.string() + "\"; use .png");
  }
  if (o.background && !std::isfinite(*o.background)) throw UsageError("--background is not a finite number");
  // The series of a single file is read from its folder, so a derived series must not land there.
  if (series && !o.input.single && !std::filesystem::is_directory(o.input.path))
    inputs.push_back(folder_of(o.input.path));
  Outputs outputs{series, OutputSet(inputs, o.common.overwrite), {}, {}, {}, {}, {}, {}, {}};
  outputs.volume = outputs.set.add(o.output, series ? StagedOutput::Kind::folder : StagedOutput::Kind::file);
  outputs.sidecar = outputs.set.add(sidecar_of(o.output));
  outputs.maps.emplace(o.maps, o.pull_field.empty() ? Direction::forward : Direction::pull, outputs.set);
  outputs.further.emplace(o.with, outputs.set);
  outputs.report = outputs.set.add(o.report);
  outputs.preview = outputs.set.add(o.preview);
  outputs.points = points_.add_outputs(outputs.set);
  return outputs;
}

/// As far as the headers tell: --grid fit is taken for the input's grid.
std::uint64_t Deformation::plan_bytes(const InputHeader& input) {
  const glm::i64vec3 lattice = options_.pull_field.empty()
                                   ? lattice_size(options_.fields, input.geometry, options_.cell_size)
                                   : read_field_header(options_.pull_field).grid.size;
  if (options_.grid != "fit") grid_ = output_grid(options_.grid, input.geometry, {}, options_.outside);
  const auto voxels = static_cast<std::uint64_t>(voxel_count(input.geometry)),
             output_voxels = options_.grid == "fit" ? voxels : static_cast<std::uint64_t>(voxel_count(grid_));
  const auto vertices = static_cast<std::uint64_t>(lattice.x * lattice.y * lattice.z);
  const auto slices = static_cast<std::uint64_t>(options_.grid == "fit" ? input.geometry.size.z : grid_.size.z);
  const std::uint64_t of_check = wants_check() ? sizeof(glm::vec3) * output_voxels / slices *
                                                     std::min(slices, std::uint64_t{RoundTrip::kMostSlices})
                                               : 0;
  const std::uint64_t of_mass = options_.preserve_mass ? sizeof(float) * (voxels + 2 * output_voxels) : 0;
  return of_mass + of_check + voxels * size_bytes(input.type) +
         output_voxels * (size_bytes(input.type) + outputs_.maps->bytes_a_voxel()) +
         outputs_.further->bytes(output_voxels) + vertices * sizeof(glm::vec3) + kOverheadBytes;
}

void Deformation::check_input(const InputHeader& input) {
  if (outputs_.series && !input.series) {
    throw UsageError("a DICOM series can only be derived from a CT series, not from " + options_.input.path.string() +
                     "; name the output .nii.gz, .nii, .nrrd or .mha");
  }
  const glm::i64vec3& size = input.geometry.size;
  require(std::min({size.x, size.y, size.z}) >= 2,
          "a volume of " + to_string(size) + " voxels has no cell to deform, " + options_.input.path.string() +
              "; give one with at least 2 on every axis");
  if (options_.background && !fits(input.type, *options_.background)) {
    throw UsageError("--background " + json(*options_.background).dump() + " does not fit the voxels, " +
                     to_string(input.type) + "; choose a value in their range");
  }
  planned_bytes_ = plan_bytes(input);
  if (options_.memory_bytes && planned_bytes_ > *options_.memory_bytes && !means_cuda(options_.backend)) {
    throw Error("about " + format_bytes(planned_bytes_) + " of memory are needed, --memory allows " +
                format_bytes(*options_.memory_bytes) + "; a larger --cell-size needs less");
  }
  if (input.series) set_aside_ = input.series->set_aside;
}

void Deformation::print_plan() const {
  const bool fit = options_.grid == "fit";
  say(options_.common, "would write " + options_.output.string() + ": " +
                           (fit ? "as many voxels as the deformed lattice needs" : to_string(grid_.size) + " voxels") +
                           " as " + (outputs_.series ? "a DICOM series" : "a file") + "; about " +
                           format_bytes(planned_bytes_) + " of memory");
}

void Deformation::read() {
  Stage stage(options_.common, "read");
  const InputHeader header = open_input(options_.input, {.stop = interrupt_token()});
  check_input(header);
  points_.read();
  if (header.series) notes_ = header.series->warnings;
  input_ = read_input(options_.input, header, options_.common, stage.control());
  background_ = options_.background.value_or(input_.background);
  outputs_.further->read(options_.common, {.stop = interrupt_token()});
  stages_.emplace_back("read", stage.seconds());
}

void Deformation::read_field() {
  Stage stage(options_.common, "field");
  const Geometry& grid = input_.volume.geometry();
  if (options_.pull_field.empty()) {
    field_.forward = read_forward_field(options_.fields, grid, options_.cell_size, options_.common, stage.control());
    field_.notes = field_.forward.notes;
  } else {
    field_.direction = Direction::pull;
    if (!read_field_header(options_.pull_field).direction) {
      field_.notes.push_back(options_.pull_field.string() + " does not say its direction: taken as output to input");
    }
    field_.pull = read_pull_field(options_.pull_field);
  }
  if (options_.grid == "fit") grid_ = output_grid("fit", grid, field_.forward.field, options_.outside);
  stages_.emplace_back("field", stage.seconds());
}

/// @return who holds the field
Backend Deformation::resample() {
  Stage stage(options_.common, "resample");
  auto input_hash = std::async(
      std::launch::async, [&] { return input_.is_dicom() ? input_.dicom->sha256 : hash_file(options_.input.path); });
  field_sha256_ = hash_field(field_.lattice(), field_.displacement(),
                             field_.direction == Direction::pull ? "pull" : "forward", options_.common.threads);
  const Limits limits{.threads = options_.common.threads, .memory = options_.memory_bytes.value_or(0)};
  Backend backend = make_backend(options_.backend, field_.direction, grid_, options_.device, limits);
  backend_ = backend.name;
  // What --grid fit adds lies beyond the lattice; that this reaches over INPUT is known.
  const bool grown = options_.grid == "fit" && options_.outside == Outside::refuse;
  const Outside outside = grown ? Outside::background : options_.outside;
  set_field(*backend.resampler, outside);
  if (!points_.empty()) points_.move(grid_, view(field_.forward.field, outside), limits, {.stop = interrupt_token()});
  output_ = AnyVolume(grid_, input_.volume.type());
  sampled_slices_.resize(outputs_.series ? static_cast<std::size_t>(grid_.size.z) : 0);
  const Maps maps = outputs_.maps->make(grid_, options_.preserve_mass);
  mass_.jacobian = maps.jacobian;
  std::vector<Target> targets = outputs_.further->targets_on(grid_, false, options_.interpolation);
  targets.insert(targets.begin(), main_target());
  Control control = stage.control();
  if (outputs_.series) begin_series();
  if (outputs_.series || options_.preserve_mass) {
    control.finished = [&](const Region& slices) {
      if (options_.preserve_mass) scale_mass(slices);
      if (outputs_.series) outputs_.set.write([&] { write_slices(slices); });
    };
  }
  report_ = backend.resampler->resample(whole(grid_), targets, maps, control);
  report_.clamped += mass_.saturated;
  resample_onto_own_grids();
  input_sha256_ = input_hash.get();
  stages_.emplace_back("resample", stage.seconds());
  return backend;
}

/// Looks at the field, and where its inverse leads. @param resampler  holds the field
void Deformation::check(Resampler& resampler) {
  Stage stage(options_.common, "check");
  const Limits limits{.threads = options_.common.threads};
  check_.quality = measure_quality(field_.forward.field, limits, stage.control());
  check_.trip = measure_round_trip(resampler, field_.forward.field, limits, {.stop = interrupt_token()});
  stages_.emplace_back("check", stage.seconds());
}

/// INPUT as it goes through the field: with --preserve mass in float, so that values are rounded once.
Target Deformation::main_target() {
  Target target{.source = std::as_const(input_.volume).view(),
                .output = output_.view(),
                .interpolation = options_.interpolation,
                .background = background_,
                .padding = input_.is_dicom() ? input_.dicom->padding : std::nullopt,
                .sampled_slices = sampled_slices_};
  if (!options_.preserve_mass) return target;
  mass_.source = AnyVolume(input_.volume.geometry(), VoxelType::f32);
  mass_.resampled = AnyVolume(grid_, VoxelType::f32);
  dispatch(input_.volume.type(), [&](auto voxel) {
    const auto from = std::as_const(input_.volume).as<decltype(voxel)>();
    std::transform(from.begin(), from.end(), mass_.source.as<float>().begin(),
                   [](auto value) { return static_cast<float>(value); });
  });
  target.source = std::as_const(mass_.source).view();
  target.output = mass_.resampled.view();
  return target;
}

void Deformation::scale_mass(const Region& slices) {
  mass_.saturated += preserve_mass(std::as_const(mass_.resampled).view(), mass_.jacobian, output_.view(), slices);
}

void Deformation::set_field(Resampler& resampler, Outside outside) const {
  const Control control{.stop = interrupt_token()};
  if (field_.direction == Direction::pull) {
    resampler.set_field(view(field_.pull, outside), control);
  } else {
    resampler.set_field(view(field_.forward.field, outside), control);
  }
}

void Deformation::resample_onto_own_grids() {
  const Limits limits{.threads = options_.common.threads, .memory = options_.memory_bytes.value_or(0)};
  for (const Geometry& grid : outputs_.further->own_grids()) {
    const Backend backend = make_backend(options_.backend, field_.direction, grid, options_.device, limits);
    set_field(*backend.resampler, options_.outside);
    const std::vector<Target> targets = outputs_.further->targets_on(grid, true, options_.interpolation);
    backend.resampler->resample(whole(grid), targets, {}, {.stop = interrupt_token()});
  }
}

json Deformation::canonical_options() const {
  json options = {{"interpolation", name_of(options_.interpolation)},
                  {"outside", name_of(options_.outside)},
                  {"background", background_}};
  if (options_.preserve_mass) options["preserve"] = "mass";
  if (!is_same_grid(options_.grid)) options["grid"] = options_.grid;
  if (field_.direction == Direction::pull) {
    options["pull_field"] = options_.pull_field.string();
  } else {
    options["field"] = options_.fields;
    if (options_.cell_size) options["cell_size"] = *options_.cell_size;
  }
  return options;
}

void Deformation::begin_series() {
  const std::string parameters = "interpolation=" + std::string(name_of(options_.interpolation)) +
                                 " outside=" + name_of(options_.outside) + " background=" + json(background_).dump() +
                                 (field_.direction == Direction::pull ? " direction=pull" : " direction=forward") +
                                 (options_.preserve_mass ? " preserve=mass" : "");
  const bool pull = field_.direction == Direction::pull, deformed = pull || !field_.forward.identity;
  const char* what =
      !deformed ? "Resampled by the identity" : (pull ? "Deformed by a pull field" : "Deformed by a field of vertices");
  series_.emplace(
      outputs_.volume, input_.volume.geometry(), *input_.dicom->headers,
      DicomDerivation{.field_sha256 = field_sha256_,
                      .parameters = parameters,
                      .description = std::string(what) + ", " + name_of(options_.interpolation) + " interpolation",
                      .deformed = deformed,
                      .background_hu = background_});
}

/// While others are resampled.
void Deformation::write_slices(const Region& slices) {
  series_->write(std::as_const(output_).view(), slices.begin.z, slices.end.z, sampled_slices_, options_.common.threads,
                 {.stop = interrupt_token()});
}

json Deformation::sidecar() const {
  json document = provenance("deform");
  document["options"] = canonical_options();
  document["backend"] = backend_;
  document["input"] = {{"path", options_.input.path.string()}, {"sha256", input_sha256_}};
  if (input_.is_dicom()) {
    document["input"]["series_instance_uid"] = input_.dicom->series_uid;
    document["input"]["rounded_voxels"] = input_.dicom->rounded;
    document["input"]["set_aside"] = set_aside_;
    if (input_.dicom->padding)
      document["input"]["padding_hu"] = {input_.dicom->padding->low, input_.dicom->padding->high};
  }
  document["field"] = {{"sha256", field_sha256_},
                       {"direction", field_.direction == Direction::pull ? "pull" : "forward"},
                       {"lattice", to_json(field_.lattice())},
                       {"notes", field_.notes}};
  document["output"] = {{"path", options_.output.string()},
                        {"voxel_type", to_string(output_.type())},
                        {"geometry", to_json(output_.geometry())}};
  if (dicom_report_) {
    document["output"]["series_instance_uid"] = dicom_report_->series_uid;
    document["output"]["frame_of_reference_uid"] = dicom_report_->frame_of_reference_uid;
    document["output"]["added_empty_attributes"] = dicom_report_->added_empty;
  }
  if (const json further = outputs_.further->describe(); !further.empty()) document["with"] = further;
  if (const json maps = outputs_.maps->describe(); !maps.empty()) document["maps"] = maps;
  if (!points_.empty()) document["points"] = points_.to_json();
  document["report"] = {{"covered", report_.covered},      {"uncovered", report_.uncovered},
                        {"clamped", report_.clamped},      {"padded", report_.padded},
                        {"conflicts", report_.conflicts},  {"inverted", report_.inverted},
                        {"degenerate", report_.degenerate}};
  if (field_.direction == Direction::forward)
    document["report"]["jacobian"] = {report_.jacobian_min, report_.jacobian_max};
  if (report_.multiply_owned) document["report"]["multiply_owned"] = *report_.multiply_owned;
  return document;
}

json Deformation::report_with_times() const {
  json document = sidecar();
  double total = 0;
  for (const auto& [name, seconds] : stages_) {
    document["stages"][name]["seconds"] = seconds;
    total += seconds;
  }
  document["total_seconds"] = total;
  if (field_.direction == Direction::forward) {
    document["paths"] = {
        {"gathered", report_.paths.gathered}, {"walked", report_.paths.walked}, {"claimed", report_.paths.claimed}};
    const auto& [quality, trip] = check_;
    document["quality"] = {{"verdict", verdict(report_, quality, trip)},
                           {"largest_stretch", quality.largest_stretch},
                           {"jacobian_edges", FieldQuality::kEdges},
                           {"jacobian_shares", quality.shares()},
                           {"round_trip",
                            {{"slices", trip.slices},
                             {"voxels", trip.voxels},
                             {"forward_after_inverse", to_json(trip.forward_after_inverse)},
                             {"inverse_after_forward", to_json(trip.inverse_after_forward)}}}};
  }
  document["threads"] =
      options_.common.threads > 0 ? options_.common.threads : static_cast<int>(std::thread::hardware_concurrency());
  document["memory"] = {{"peak_bytes", peak_memory_bytes()},
                        {"planned_bytes", planned_bytes_},
                        {"source_bytes", input_.volume.size_bytes()},
                        {"output_bytes", output_.size_bytes()},
                        {"field_bytes", field_.displacement().size() * sizeof(glm::vec3)}};
  return document;
}

void Deformation::write() {
  const auto start = std::chrono::steady_clock::now();
  const std::string made_by = "tetwarp field " + field_sha256_.substr(0, 16);
  if (outputs_.series) {
    dicom_report_ = series_->report();
  } else {
    Stage stage(options_.common, "write");
    write_image(outputs_.volume, std::as_const(output_).view(),
                {.compression = options_.compression.value_or(-1), .metadata = {{"descrip", made_by}}});
  }
  outputs_.maps->write();
  if (!outputs_.preview.empty()) write_preview_picture();
  outputs_.further->write(options_.compression, made_by);
  points_.write(outputs_.points);
  write_json(outputs_.sidecar, sidecar());
  stages_.emplace_back("write", std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  if (!outputs_.report.empty()) write_json(outputs_.report, report_with_times());
  outputs_.set.commit();
}

/// Beside an output on another grid stands INPUT as it lies there.
void Deformation::write_preview_picture() {
  const ConstVolumeView before = std::as_const(input_.volume).view(), after = std::as_const(output_).view();
  if (*before.geometry == grid_) return write_preview(outputs_.preview, before, after, title());
  AnyVolume on_grid(grid_, input_.volume.type());
  Geometry corners = grid_;  // a pull field of zeros
  corners.size = glm::i64vec3(2);
  corners.spacing = grid_.spacing * glm::dvec3(grid_.size - std::int64_t{1});
  const PullField none{corners, std::vector<glm::vec3>(8, glm::vec3(0))};
  const auto resampler = make_cpu_pull_resampler(grid_, {.threads = options_.common.threads});
  resampler->set_field(view(none, Outside::background));
  const Target target{.source = before, .output = on_grid.view(), .background = background_};
  resampler->resample(whole(grid_), {&target, 1});
  write_preview(outputs_.preview, std::as_const(on_grid).view(), after, title());
}

/// What the preview says above the pictures: the fields by name, files without their folders.
std::string Deformation::title() const {
  if (!options_.pull_field.empty()) return "pull field " + options_.pull_field.filename().string();
  std::string text;
  for (const std::string& field : options_.fields) {
    text += (text.empty() ? "" : ", then ") +
            (is_formula(field) ? field : std::filesystem::path(field).filename().string());
  }
  return text;
}

std::string Deformation::summary() const {
  char share[32];
  std::snprintf(
      share, sizeof share, "%.2f %%",
      100.0 * static_cast<double>(report_.covered) / static_cast<double>(report_.covered + report_.uncovered));
  std::string line = "wrote " + options_.output.string() + ": " + to_string(output_.geometry().size) + " voxels, " +
                     share + " covered, backend " + backend_;
  if (report_.inverted + report_.degenerate > 0) {
    line += "; the field folds: " + std::to_string(report_.inverted) + " tetrahedra inverted, " +
            std::to_string(report_.degenerate) + " flat";
  }
  if (report_.clamped > 0) line += "; " + std::to_string(report_.clamped) + " values clamped";
  if (report_.conflicts > 0)
    line += "; " + std::to_string(report_.conflicts) + " voxels outside the lattice were moved into";
  return line;
}

int Deformation::run() {
  if (options_.dry_run) {
    const InputHeader header = open_input(options_.input, {.stop = interrupt_token()});
    check_input(header);
    points_.read();
    print_plan();
    return 0;
  }
  const auto awake = std::async(std::launch::async, [&] {  // beside reading
    if (means_cuda(options_.backend)) wake_cuda_device(options_.device);
  });
  read();
  read_field();
  {
    const Backend backend = resample();
    if (wants_check()) check(*backend.resampler);
  }
  outputs_.set.write([&] { write(); });
  for (const std::string& note : notes_) say(options_.common, "tetwarp: warning: " + note);
  for (const std::string& note : field_.notes) say(options_.common, "tetwarp: note: " + note);
  for (const std::string& note : points_.notes()) say(options_.common, "tetwarp: note: " + note);
  if (!set_aside_.empty()) {
    say(options_.common, "tetwarp: note: " + std::to_string(set_aside_.size()) +
                             " files of the series are no slices of it; OUTPUT.json names them");
  }
  say(options_.common, summary());
  return 0;
}

}  // namespace

int run_deform(const DeformOptions& options) { return Deformation(options).run(); }

}  // namespace tetwarp::apps
