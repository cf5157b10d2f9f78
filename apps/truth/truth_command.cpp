// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <charconv>
#include <fstream>
#include <nlohmann/json.hpp>

#include "apps/cli/input.h"
#include "apps/cli/output.h"
#include "apps/cli/reads.h"
#include "apps/truth/truth_set.h"
#include "deform/truth/body.h"
#include "deform/truth/family.h"
#include "deform/truth/landmarks.h"
#include "deform/truth/noise.h"
#include "deform/truth/slip_tube.h"
#include "deform/value_counts.h"
#include "io/field_file.h"
#include "io/image_file.h"
#include "io/staged_output.h"

namespace tetwarp::apps {

namespace {

using nlohmann::json;
namespace fs = std::filesystem;

/// Roles as options name them. @throws UsageError for a text that is not ROLE=N,..., or a role that no kind needs
truth::Roles parse_roles(const std::vector<std::string>& texts) {
  truth::Roles roles;
  for (const std::string& text : texts) {
    const std::size_t equals = text.find('=');
    const std::string role = text.substr(0, equals);
    const auto needs = [&](const truth::Family& family) {
      return std::find(family.roles.begin(), family.roles.end(), role) != family.roles.end();
    };
    const auto kinds = truth::families();
    if (equals == std::string::npos || std::none_of(kinds.begin(), kinds.end(), needs))
      throw UsageError("--label \"" + text + "\"; expected ROLE=N,... with lung, bone, organ or lump as ROLE");
    std::string_view numbers = std::string_view(text).substr(equals + 1);
    while (true) {
      const std::string_view one = numbers.substr(0, numbers.find(','));
      std::int64_t value = 0;
      const auto [end, error] = std::from_chars(one.data(), one.data() + one.size(), value);
      if (error != std::errc() || end != one.data() + one.size())
        throw UsageError("--label \"" + text + "\" holds \"" + std::string(one) + "\"; expected whole numbers");
      std::vector<std::int64_t>& labels = roles[role];
      if (std::find(labels.begin(), labels.end(), value) == labels.end()) labels.push_back(value);
      if (one.size() == numbers.size()) break;
      numbers.remove_prefix(one.size() + 1);
    }
  }
  return roles;
}

std::vector<truth::CaseChoice> cases_of(const TruthOptions& options, const truth::Roles& roles) {
  if (options.cases.empty()) return truth::usual_cases(roles);
  std::vector<truth::CaseChoice> cases;
  for (const std::string& text : options.cases) {
    try {
      cases.push_back(truth::parse_case(text));
    } catch (const InputError& error) {
      throw UsageError(error.what());
    }
    const auto same = [&](const truth::CaseChoice& one) { return one.name == cases.back().name; };
    if (std::count_if(cases.begin(), cases.end(), same) > 1)
      throw UsageError("--case " + text + " is given twice, or has the folder of another one");
    for (const std::string_view role : cases.back().family->roles) {
      if (!roles.contains(std::string(role)))
        throw UsageError("--case " + text + " needs to know which labels are " + std::string(role) +
                         "; give --labels FILE and --label " + std::string(role) + "=N");
    }
  }
  return cases;
}

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

/// Makes the set.
class TruthMaker {
 public:
  explicit TruthMaker(const TruthOptions& options)
      : options_(options), roles_(parse_roles(options.roles)), cases_(cases_of(options, roles_)) {
    if (options.labels.empty() && !options.roles.empty())
      throw UsageError("--label names labels of --labels; give both");
    check_names();
    set_.folder = options.output;
    planned_ = plan();
  }

  int run() {
    if (is_complete()) return 0;
    read();
    begin();
    write_moving();
    for (const truth::CaseChoice& choice : cases_) make_case(choice);
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
  fs::path write_field(const truth::CaseChoice& choice);
  DeformOptions deform_options(const TruthCase& one) const;
  /// What of the moving volume lies near the slip of a case.
  fs::path near_slip_of(const TruthCase& one) const { return set_.folder / "moving" / volume_file("near-" + one.name); }
  /// What deform writes: of a DICOM series a series, so that objects which go along can refer to it.
  fs::path deformed(const TruthCase& one) const {
    const fs::path folder = set_.folder / one.name;
    const bool is_noisy = options_.noise_hu > 0;
    if (header_.series) return folder / (is_noisy ? "dicom-without-noise" : "dicom");
    return is_noisy ? folder / volume_file("without-noise") : one.fixed;
  }

  const TruthOptions& options_;
  truth::Roles roles_;
  std::vector<truth::CaseChoice> cases_;
  TruthSet set_;
  InputHeader header_;
  AnyVolume volume_, labels_;
  std::optional<truth::Subject> subject_;
  json planned_;
};

json TruthMaker::plan() const {
  json cases = json::array();
  for (const truth::CaseChoice& choice : cases_)
    cases.push_back({{"name", choice.name}, {"kind", choice.family->name}, {"parameters", json(choice.values)}});
  json document = provenance("truth");
  document["input"] = {{"sha256", hash_volume(options_.input, options_.common.threads)}};
  document["labels"] =
      options_.labels.empty() ? json() : json{{"sha256", hash_file(options_.labels)}, {"roles", roles_}};
  document["options"] = {{"cell_size", options_.cell_size},    {"body_above_hu", options_.body_above_hu},
                         {"landmarks", options_.landmarks},    {"noise_hu", options_.noise_hu},
                         {"noise_seed", options_.seed},        {"dense", options_.dense},
                         {"compression", options_.compression}};
  if (!options_.input.series.empty()) document["options"]["series"] = options_.input.series;
  document["options"]["nifti_frame"] = options_.common.nifti_frame == NiftiFrame::sform ? "sform" : "qform";
  document["with"] = json::array();
  for (const std::string& path : options_.with)
    document["with"].push_back({{"name", fs::path(path).filename().string()}, {"sha256", hash_file(path)}});
  document["cases"] = cases;
  return document;
}

void TruthMaker::check_names() const {
  std::vector<std::string> taken;
  for (const char* stem : {"fixed", "without-noise", "body", "labels", "near-slip", "jacobian", "coverage", "inverse"})
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
  for (const fs::path& path : {one.labels, one.landmarks, one.apart})
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
  subject_.emplace(std::move(patient), roles_, volume_.geometry());
}

void TruthMaker::write_moving() {
  Stage stage(options_.common, "moving volume");
  const fs::path folder = set_.folder / "moving";
  fs::create_directories(folder);
  fs::create_directories(set_.folder / "fields");
  const ConstVolumeView ct = std::as_const(volume_).view();
  set_.moving = folder / volume_file("moving");
  if (options_.noise_hu > 0) {
    AnyVolume noisy(volume_.geometry(), volume_.type());
    truth::add_noise(ct, options_.noise_hu, truth::noise_seed(options_.seed, "moving"), noisy.view(),
                     {.threads = options_.common.threads});
    write_volume(set_.moving, std::as_const(noisy).view());
  } else {
    write_volume(set_.moving, ct);
  }
  const Volume<std::uint8_t> body = truth::body_mask(volume_.geometry(), subject_->patient(), options_.cell_size);
  write_volume(folder / volume_file("body"), view(body));
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

fs::path TruthMaker::write_field(const truth::CaseChoice& choice) {
  Stage stage(options_.common, choice.name + ": field");
  const VertexField field = truth::make_field(choice, *subject_, {.threads = options_.common.threads}, stage.control());
  const fs::path path = set_.folder / "fields" / (choice.name + (field.mesh.is_empty() ? ".mha" : ".vtk"));
  place(path, [&](const fs::path& staged) { write_vertex_field(staged, field); });
  return path;
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
  along(set_.folder / "moving" / volume_file("body"), one.body, ":vote");
  if (!set_.labels.empty()) along(set_.labels, one.labels, ":vote");
  if (!one.apart.empty()) along(near_slip_of(one), one.apart, ":vote");
  for (const std::string& path : options_.with) along(path, deform.folder / fs::path(path).filename(), "");
  if (!set_.landmarks.empty()) deform.points.push_back(set_.landmarks.string() + "=" + one.landmarks.string());
  deform.maps.jacobian = deform.folder / volume_file("jacobian");
  deform.maps.coverage = deform.folder / volume_file("coverage");
  if (options_.dense) deform.maps.inverse = deform.folder / volume_file("inverse");
  return deform;
}

void TruthMaker::make_case(const truth::CaseChoice& choice) {
  const fs::path folder = set_.folder / choice.name;
  TruthCase one{.name = choice.name,
                .fixed = folder / volume_file("fixed"),
                .field = write_field(choice),
                .body = folder / volume_file("body"),
                .labels = set_.labels.empty() ? fs::path() : folder / volume_file("labels"),
                .landmarks = set_.landmarks.empty() ? fs::path() : folder / "landmarks.csv",
                .apart = {}};
  if (choice.family->name == "slip") {
    write_volume(near_slip_of(one), view(truth::near_slip(*subject_, volume_.geometry())));
    one.apart = folder / volume_file("near-slip");
  }
  Stage stage(options_.common, choice.name);
  const std::vector<fs::path> files = files_of(one);
  if (!std::all_of(files.begin(), files.end(), [](const fs::path& file) { return fs::exists(file); })) {
    fs::remove_all(folder);
    run_deform(deform_options(one));
  }
  if (!fs::exists(one.fixed)) {
    const InputOptions made = volume_named(deformed(one));
    AnyVolume volume = read_input(made, open_input(made, options_.common), options_.common, stage.control()).volume;
    if (options_.noise_hu > 0) {
      truth::add_noise(std::as_const(volume).view(), options_.noise_hu, truth::noise_seed(options_.seed, choice.name),
                       volume.view(), {.threads = options_.common.threads});
    }
    write_volume(one.fixed, std::as_const(volume).view());
  }
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
  hash(set_.moving), hash(set_.labels), hash(set_.landmarks);
  for (const TruthCase& one : set_.cases) {
    for (const fs::path& path : {one.fixed, one.field, one.body, one.labels, one.landmarks, one.apart}) hash(path);
  }
  document["sha256"] = hashes;
  place(set_.folder / "README.txt", [&](const fs::path& staged) {
    write_text(
        staged,
        "A set of deformations whose truth is known, made by tetwarp truth (set.json: version, options, hashes).\n\n"
        "moving/            the original: volume, mask of the body, labels, landmarks (LPS mm)\n"
        "CASE/fixed         the deformed volume; register it with the moving one\n"
        "CASE/dicom         of a DICOM series: the same as a series; where noise was added there is instead\n"
        "                   dicom-without-noise, or without-noise, as tetwarp deform made it\n"
        "CASE/body, labels  those of the moving volume, deformed by the same field\n"
        "CASE/near-slip     of a slip: what lies at most the diagonal of a cell from it; scored by itself\n"
        "CASE/landmarks.csv where the landmarks of the moving volume come to lie, exactly\n"
        "CASE/jacobian      determinant of the forward map at each voxel; coverage: where it leads\n"
        "CASE/inverse       with --dense: the exact displacement from fixed to moving at each voxel, LPS mm\n"
        "fields/CASE        the forward field itself, from moving to fixed: the truth\n\n"
        "A registration gives a map from fixed to moving. Name its field or transform CASE.mha, CASE.nii.gz,\n"
        "CASE.h5 or the like, or warped landmarks CASE.csv, put all into a folder, and run:\n\n"
        "    tetwarp score SET -r FOLDER\n");
  });
  place(set_.folder / kSetRecord, [&](const fs::path& staged) { write_json(staged, Record::open(document)); });
  say(options_.common, "wrote " + set_.folder.string() + ": " + std::to_string(set_.cases.size()) + " cases");
}

}  // namespace

int run_truth(const TruthOptions& options) { return TruthMaker(options).run(); }

}  // namespace tetwarp::apps
