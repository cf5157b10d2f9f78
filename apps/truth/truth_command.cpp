// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "apps/cli/input.h"
#include "apps/cli/output.h"
#include "apps/cli/reads.h"
#include "apps/truth/truth_request.h"
#include "apps/truth/truth_set.h"
#include "deform/score/truth.h"
#include "deform/truth/body.h"
#include "deform/truth/landmarks.h"
#include "deform/value_counts.h"
#include "io/field_file.h"
#include "io/image_file.h"
#include "io/staged_output.h"

namespace tetwarp::apps {

namespace {

using nlohmann::json;
namespace fs = std::filesystem;

/// Labels of a floating type as int32; others as they are. @throws InputError for values that are not whole numbers
AnyVolume in_whole_numbers(AnyVolume labels, const fs::path& file) {
  if (labels.type() != VoxelType::f32 && labels.type() != VoxelType::f64) return labels;
  AnyVolume whole_numbers(labels.geometry(), VoxelType::i32);
  dispatch(labels.type(), [&]<class V>(V) {
    const V* from = reinterpret_cast<const V*>(labels.data());
    for (std::int32_t& to : whole_numbers.as<std::int32_t>()) {
      const auto value = static_cast<double>(*from++);
      to = static_cast<std::int32_t>(std::clamp(value, -2147483648.0, 2147483647.0));
      require(static_cast<double>(to) == value, file.string() + " holds a label that is no whole number of 32 bits");
    }
  });
  return whole_numbers;
}

/// Makes a set of one volume.
class TruthMaker {
 public:
  explicit TruthMaker(const TruthOptions& options)
      : options_(options), request_(parse_truth(options)), noise_(request_.noise.value_or(truth::Noise{})) {
    check_names();
    set_.folder = options.output;
    planned_ = plan();
  }

  int run() {
    if (is_complete()) return 0;
    read();
    begin();
    if (!options_.resume) require_room();
    write_moving();
    for (const truth::CaseChoice& choice : request_.cases) make_case(choice);
    finish();
    return 0;
  }

 private:
  /// Whether the set is there, complete and as planned. @throws Error where something else is in its place
  bool is_complete();
  void read();
  void begin();
  void write_moving();
  void make_case(const truth::CaseChoice& choice);
  void finish();
  /// @throws UsageError for names that the set has for files of its own, or that IN=OUT cannot say
  void check_names() const;
  /// All that a case consists of, but for what --with names.
  std::vector<fs::path> files_of(const TruthCase& one) const;

  fs::path volume_file(const std::string& stem) const {
    return stem + (options_.compression == 0 ? ".nii" : ".nii.gz");
  }
  json plan() const;
  /// Writes a file of the set unless it is there already, so that it appears complete.
  template <class Write>
  void place(const fs::path& path, const Write& write) {
    if (fs::exists(path)) return;
    StagedOutput output(path, StagedOutput::Kind::file, false);
    write(output.path());
    output.commit();
  }
  void write_volume(const fs::path& path, const ConstVolumeView& volume) {
    place(path, [&](const fs::path& staged) {
      ImageWriteOptions how;
      if (options_.compression > 0) how.compression = options_.compression;
      write_image(staged, volume, how);
    });
  }
  void write_forward(const fs::path& path, const VertexField& field, const Control& control);
  /// @throws Error where the disk lacks room for what a set without compression takes
  void require_room() const;
  DeformOptions deform_options(const TruthCase& one) const;
  /// What deform writes: of a DICOM series a series, so that objects which go along can refer to it.
  fs::path deformed(const TruthCase& one) const {
    const fs::path folder = set_.folder / one.name;
    const bool is_noisy = noise_.deviation > 0;
    if (header_.series) return folder / (is_noisy ? "dicom-without-noise" : "dicom");
    return is_noisy ? folder / volume_file("without-noise") : one.fixed;
  }

  const TruthOptions& options_;
  TruthRequest request_;
  TruthSet set_;
  InputHeader header_;
  AnyVolume volume_, labels_;
  std::optional<truth::Subject> subject_;
  truth::Noise noise_;
  json planned_;
};

json TruthMaker::plan() const {
  json cases = json::array();
  for (const truth::CaseChoice& choice : request_.cases)
    cases.push_back({{"name", choice.name}, {"kind", choice.family->name}, {"parameters", json(choice.values)}});
  json document = provenance("truth");
  document["input"] = {{"sha256", hash_volume(options_.input, options_.common.threads)}};
  document["labels"] =
      options_.labels.empty() ? json() : json{{"sha256", hash_file(options_.labels)}, {"roles", request_.roles}};
  document["options"] = {{"cell_size", options_.cell_size},    {"body_above_hu", options_.body_above_hu},
                         {"landmarks", options_.landmarks},    {"noise", options_.noise},
                         {"noise_seed", options_.seed},        {"dense", options_.dense},
                         {"compression", options_.compression}};
  if (!options_.input.series.empty()) document["options"]["series"] = options_.input.series;
  document["options"]["nifti_frame"] = options_.common.nifti_frame == NiftiFrame::sform ? "sform" : "qform";
  document["with"] = json::array();
  for (const std::string& path : options_.with)
    document["with"].push_back({{"name", fs::path(path).filename().string()}, {"sha256", hash_file(path)}});
  if (!options_.dose.empty()) document["dose"] = {{"sha256", hash_file(options_.dose)}};
  document["cases"] = cases;
  return document;
}

void TruthMaker::check_names() const {
  std::vector<std::string> taken;
  for (const char* stem :
       {"fixed", "without-noise", "body", "labels", "near-slip", "dose", "jacobian", "coverage", "inverse", "forward"})
    taken.push_back(volume_file(stem).string());
  taken.insert(taken.end(), {"dicom", "dicom-without-noise", "landmarks.csv"});
  for (const std::string& path : options_.with) {
    const std::string name = fs::path(path).filename().string();
    if (name.empty() || std::find(taken.begin(), taken.end(), name) != taken.end())
      throw UsageError("--with " + path + " has a name that files of a set have, or that another one has; rename it");
    taken.push_back(name);
  }
  std::vector<std::string> all = options_.with;
  all.push_back(options_.output.string());
  for (const std::string& path : all) {
    if (path.find_first_of("=:") != std::string::npos)
      throw UsageError("\"" + path + "\" has \"=\" or \":\" in it; rename it, or give another folder");
  }
}

bool TruthMaker::is_complete() {
  const fs::path record = set_.folder / kSetRecord, plan_file = set_.folder / "plan.json";
  if (!fs::exists(set_.folder) || (fs::is_directory(set_.folder) && fs::is_empty(set_.folder))) return false;
  if (!options_.resume) {
    throw Error(set_.folder.string() + (fs::exists(record)
                                            ? " holds a complete set; remove it or give another folder"
                                            : " is there and not empty; remove it, or go on with --resume"));
  }
  std::ifstream stream(plan_file);
  const json before = json::parse(stream, nullptr, false);
  if (before.is_discarded())
    throw Error(set_.folder.string() + " holds no set that was begun: plan.json is missing or damaged; remove it");
  if (!(before == planned_))
    throw Error(set_.folder.string() + " was begun with another input, other options or another version; remove it");
  if (!fs::exists(record)) return false;
  say(options_.common, set_.folder.string() + " is complete");
  return true;
}

void TruthMaker::begin() {
  std::error_code failed;
  fs::create_directories(set_.folder, failed);
  if (failed) throw Error("the folder " + set_.folder.string() + " cannot be made: " + failed.message());
  place(set_.folder / "plan.json", [&](const fs::path& staged) { write_json(staged, Record::open(planned_)); });
}

std::vector<fs::path> TruthMaker::files_of(const TruthCase& one) const {
  const fs::path folder = set_.folder / one.name;
  std::vector<fs::path> files{deformed(one), one.body, folder / volume_file("jacobian"),
                              folder / volume_file("coverage")};
  for (const fs::path& path : {one.labels, one.landmarks, one.bands, one.dose})
    if (!path.empty()) files.push_back(path);
  if (options_.dense) files.push_back(folder / volume_file("inverse"));
  return files;
}

void TruthMaker::read() {
  Stage stage(options_.common, "read");
  header_ = open_input(options_.input, options_.common);
  require(header_.geometry.slices.empty() && !is_sheared(header_.geometry),
          options_.input.path.string() +
              " is tilted or has uneven slices; deform it by identity first, and take what comes "
              "of that");
  volume_ = read_input(options_.input, header_, options_.common, stage.control()).volume;
  if (!options_.labels.empty()) {
    const InputOptions from = volume_named(options_.labels, options_.common.nifti_frame);
    labels_ = in_whole_numbers(
        read_input(from, open_input(from, options_.common), options_.common, stage.control()).volume, options_.labels);
  }
  const ConstVolumeView ct = std::as_const(volume_).view(), labels = std::as_const(labels_).view();
  simulate::Patient patient = simulate::examine(ct, options_.labels.empty() ? nullptr : &labels, options_.cell_size,
                                                options_.body_above_hu, stage.control());
  require(patient.box.has_value(), options_.input.path.string() + " holds no body: no cell has a mean above " +
                                       number_text(options_.body_above_hu) + " HU");
  subject_.emplace(std::move(patient), request_.roles, volume_.geometry());
}

void TruthMaker::require_room() const {
  if (options_.compression > 0) return;  // how far files shrink is not known
  const auto voxels = static_cast<std::uint64_t>(voxel_count(volume_.geometry()));
  std::uint64_t bytes_per_voxel =
      size_bytes(volume_.type()) + 1 + sizeof(float) + 1;  // volume, body, Jacobian, coverage
  if (labels_.data()) bytes_per_voxel += size_bytes(labels_.type());
  if (options_.dense) bytes_per_voxel += 2 * sizeof(glm::vec3);
  const std::uint64_t bytes = voxels * bytes_per_voxel * request_.cases.size();
  std::error_code failed;
  const fs::space_info space = fs::space(set_.folder, failed);
  if (failed || space.available >= bytes) return;
  throw Error("the set takes " + std::to_string(bytes >> 20) + " MiB, and " + set_.folder.string() + " has room for " +
              std::to_string(space.available >> 20) + "; choose another disk, or fewer cases" +
              (options_.dense ? ", or leave --dense out" : ""));
}

void TruthMaker::write_moving() {
  Stage stage(options_.common, "moving volume");
  const fs::path folder = set_.folder / "moving";
  fs::create_directories(folder);
  fs::create_directories(set_.folder / "fields");
  const ConstVolumeView ct = std::as_const(volume_).view();
  set_.moving = folder / volume_file("moving");
  if (!request_.noise) {
    noise_ = truth::measure_noise(ct, {.threads = options_.common.threads}, stage.control());
    say(options_.common, "measured noise: " + number_text(std::round(100 * noise_.deviation) / 100) + " HU");
  }
  if (noise_.deviation > 0) {
    AnyVolume noisy(volume_.geometry(), volume_.type());
    truth::add_noise(ct, noise_, truth::noise_seed(options_.seed, "moving"), noisy.view(),
                     {.threads = options_.common.threads});
    write_volume(set_.moving, std::as_const(noisy).view());
  } else {
    write_volume(set_.moving, ct);
  }
  const Volume<std::uint8_t> body = truth::body_mask(volume_.geometry(), subject_->patient(), options_.cell_size);
  set_.body = folder / volume_file("body");
  write_volume(set_.body, view(body));
  for (const auto& [role, labels] : request_.roles)
    for (const std::int64_t label : labels) set_.roles[label] = role;
  if (!options_.dose.empty()) {
    set_.dose = folder / volume_file("dose");
    const InputOptions from = volume_named(options_.dose, options_.common.nifti_frame);
    const AnyVolume dose =
        read_input(from, open_input(from, options_.common, true), options_.common, stage.control()).volume;
    write_volume(set_.dose, dose.view());
  }
  if (!options_.labels.empty()) {
    set_.labels = folder / volume_file("labels");
    write_volume(set_.labels, std::as_const(labels_).view());
  }
  if (options_.landmarks == 0) return;
  set_.landmarks = folder / "landmarks.csv";
  const std::vector<glm::dvec3> landmarks =
      truth::find_landmarks(ct, body.voxels, {.most = static_cast<std::size_t>(options_.landmarks)},
                            {.threads = options_.common.threads}, stage.control());
  if (landmarks.empty()) {
    say(options_.common, "tetwarp: note: the body has no corners of texture, so there are no landmarks");
    set_.landmarks.clear();
    return;
  }
  place(set_.landmarks, [&](const fs::path& staged) {
    std::string text = "x,y,z\n";
    for (const glm::dvec3& at : landmarks)
      text += exact_number_text(at.x) + ',' + exact_number_text(at.y) + ',' + exact_number_text(at.z) + '\n';
    write_text(staged, text);
  });
}

/// Writes where the voxels of the moving volume come to lie.
void TruthMaker::write_forward(const fs::path& path, const VertexField& field, const Control& control) {
  place(path, [&](const fs::path& staged) {
    const Geometry& grid = volume_.geometry();
    const Limits limits{.threads = options_.common.threads};
    const PointMover mover(grid, view(field, Outside::background), limits, control);
    const auto forward = score::exact_forward(mover, grid, grid, limits);
    const auto writer = create_field_file(staged, grid, Direction::forward);
    constexpr std::int64_t kSlices = 8;
    for (std::int64_t k = 0; k < grid.size.z; k += kSlices) {
      const Region slices{{0, 0, k}, {grid.size.x, grid.size.y, std::min(k + kSlices, grid.size.z)}};
      const score::TruthSlab slab = forward->slab(slices, control);
      writer->write({&grid, slices, VoxelType::f32, 3, std::as_bytes(std::span(slab.displacement)).data()});
    }
    writer->finish();
  });
}

DeformOptions TruthMaker::deform_options(const TruthCase& one) const {
  DeformOptions deform;
  deform.common = options_.common;
  deform.common.quiet = true;
  deform.input = options_.input;
  deform.field.forward = {one.field.string()};
  deform.folder = set_.folder / one.name;
  deform.output = deformed(one);
  deform.backend = options_.backend;
  deform.device = options_.device;
  deform.outside = Outside::background;
  if (options_.compression > 0 && !header_.series) deform.compression = options_.compression;
  const auto along = [&](const fs::path& from, const fs::path& to, const std::string& how) {
    deform.with.push_back(from.string() + "=" + to.string() + how);
  };
  along(set_.body, one.body, ":vote");
  if (!set_.labels.empty()) along(set_.labels, one.labels, ":vote");
  if (!one.bands.empty()) along(one.moving_bands, one.bands, ":vote");
  if (!one.dose.empty()) along(set_.dose, one.dose, ":own");
  for (const std::string& path : options_.with) along(path, deform.folder / fs::path(path).filename(), "");
  if (!set_.landmarks.empty()) deform.points.push_back(set_.landmarks.string() + "=" + one.landmarks.string());
  deform.maps.jacobian = deform.folder / volume_file("jacobian");
  deform.maps.coverage = deform.folder / volume_file("coverage");
  if (options_.dense) deform.maps.inverse = deform.folder / volume_file("inverse");
  return deform;
}

void TruthMaker::make_case(const truth::CaseChoice& choice) {
  const fs::path folder = set_.folder / choice.name;
  Stage stage(options_.common, choice.name);
  const VertexField field = truth::make_field(choice, *subject_, {.threads = options_.common.threads}, stage.control());
  TruthCase one{.name = choice.name,
                .fixed = folder / volume_file("fixed"),
                .field = set_.folder / "fields" / (choice.name + (field.mesh.is_empty() ? ".mha" : ".vtk")),
                .body = folder / volume_file("body"),
                .labels = set_.labels.empty() ? fs::path() : folder / volume_file("labels"),
                .landmarks = set_.landmarks.empty() ? fs::path() : folder / "landmarks.csv",
                .dose = set_.dose.empty() ? fs::path() : folder / volume_file("dose"),
                .bands = {},
                .moving_bands = {}};
  if (choice.family->bands) {
    const truth::Bands bands = choice.family->bands(*subject_, volume_.geometry());
    one.bands = folder / volume_file("near-slip");
    one.moving_bands = set_.folder / "moving" / volume_file("near-slip-" + choice.name);
    one.bands_mm = bands.most_mm;
    write_volume(one.moving_bands, view(bands.voxels));
  }
  place(one.field, [&](const fs::path& staged) { write_vertex_field(staged, field); });
  const std::vector<fs::path> files = files_of(one);
  if (!std::all_of(files.begin(), files.end(), [](const fs::path& file) { return fs::exists(file); })) {
    fs::remove_all(folder);
    run_deform(deform_options(one));
  }
  if (!fs::exists(one.fixed)) {
    const InputOptions made = volume_named(deformed(one));
    AnyVolume volume = read_input(made, open_input(made, options_.common), options_.common, stage.control()).volume;
    if (noise_.deviation > 0) {
      truth::add_noise(std::as_const(volume).view(), noise_, truth::noise_seed(options_.seed, choice.name),
                       volume.view(), {.threads = options_.common.threads});
    }
    write_volume(one.fixed, std::as_const(volume).view());
  }
  if (options_.dense) write_forward(folder / volume_file("forward"), field, stage.control());
  set_.cases.push_back(one);
  say(options_.common, "made " + folder.string());
}

void TruthMaker::finish() {
  json document = planned_;
  document["set"] = to_json(set_);
  json hashes = json::object();
  const auto hash = [&](const fs::path& path) {
    if (!path.empty()) hashes[path.lexically_relative(set_.folder).generic_string()] = hash_file(path);
  };
  for (const fs::path& path : {set_.moving, set_.body, set_.labels, set_.landmarks, set_.dose}) hash(path);
  for (const TruthCase& one : set_.cases) {
    for (const fs::path& path : {one.fixed, one.field, one.body, one.labels, one.landmarks, one.dose, one.bands})
      hash(path);
  }
  document["sha256"] = hashes;
  document["noise"] = {{"standard_deviation_hu", noise_.deviation},
                       {"measured", !request_.noise},
                       {"radius", noise_.radius},
                       {"kernel", noise_.kernel}};
  place(set_.folder / "README.txt", [&](const fs::path& staged) {
    write_text(
        staged,
        "A set of deformations whose truth is known, made by tetwarp truth (set.json: version, options, hashes).\n\n"
        "moving/            the original: volume, mask of the body, labels, landmarks (LPS mm)\n"
        "CASE/fixed         the deformed volume; register it with the moving one\n"
        "CASE/dicom         of a DICOM series: the same as a series; where noise was added there is instead\n"
        "                   dicom-without-noise, or without-noise, as tetwarp deform made it\n"
        "CASE/body, labels  those of the moving volume, deformed by the same field\n"
        "CASE/near-slip     of a slip: 1 up to the diagonal of a cell from it, which is scored by itself; 2 and 3\n"
        "                   up to 10 and 20 mm farther away; 0 beyond\n"
        "CASE/dose          with --dose: the dose, deformed as the tissue\n"
        "CASE/landmarks.csv where the landmarks of the moving volume come to lie, exactly\n"
        "CASE/jacobian      determinant of the forward map at each voxel; coverage: where it leads\n"
        "CASE/inverse       with --dense: the exact displacement from fixed to moving at each voxel, LPS mm\n"
        "CASE/forward       with --dense: that from moving to fixed at each voxel of the moving volume\n"
        "fields/CASE        the forward field itself, from moving to fixed: the truth\n\n"
        "A registration gives a map from fixed to moving. Name its field or transform CASE.mha, CASE.nii.gz,\n"
        "CASE.h5 or the like, or warped landmarks CASE.csv, put all into a folder, and run:\n\n"
        "    tetwarp score SET -r FOLDER\n");
  });
  place(set_.folder / kSetRecord, [&](const fs::path& staged) { write_json(staged, Record::open(document)); });
  say(options_.common, "wrote " + set_.folder.string() + ": " + std::to_string(set_.cases.size()) + " cases");
}

}  // namespace

int run_truth(const TruthOptions& options) {
  if (!is_truth_manifest(options.input.path)) return TruthMaker(options).run();
  int failed = 0;
  const std::vector<TruthOptions> sets = read_truth_manifest(options);
  for (const TruthOptions& set : sets) {
    try {
      TruthMaker(set).run();
    } catch (const InputError& error) {  // one volume that cannot be used does not lose the others
      ++failed;
      std::cerr << "tetwarp: error: " << set.output.string() << ": " << error.what() << "\n";
    }
  }
  if (failed > 0) std::cerr << "tetwarp: " << failed << " of " << sets.size() << " studies have no set\n";
  return failed > 0 ? 3 : 0;
}

}  // namespace tetwarp::apps
