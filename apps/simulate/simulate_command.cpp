// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <nlohmann/json.hpp>

#include "apps/cli/input.h"
#include "apps/cli/output.h"
#include "apps/cli/reads.h"
#include "apps/simulate/simulate_report.h"
#include "apps/simulate/simulated_field.h"
#include "backend/factories.h"
#include "io/field_file.h"
#include "io/image_file.h"
#include "io/mesh_writer.h"
#include "io/scenario_file.h"

namespace tetwarp::apps {

namespace {

using namespace simulate;
namespace fs = std::filesystem;

/// The outputs of the command, before they get their names.
struct Outputs {
  Reads reads;  ///< that none of them may touch
  OutputSet set;
  fs::path field, report;
  std::vector<std::pair<int, fs::path>> frames;  ///< by rising number
};

Outputs begin_outputs(const SimulateOptions& options, const Scenario& scenario) {
  const Reads reads = reads_of(options);
  Outputs outputs{reads, OutputSet(reads, options.common.overwrite), {}, {}, {}};
  outputs.field = outputs.set.add(options.output);
  const int frames = frame_count(scenario);
  for (int number = options.every; options.every > 0 && number <= frames; number += options.every)
    outputs.frames.emplace_back(number, outputs.set.add(frame_path(options.output, number, frames)));
  outputs.report = outputs.set.add(options.report);
  return outputs;
}

/// One run of the command.
class Simulating {
 public:
  Simulating(const SimulateOptions& options, Scenario scenario, Outputs outputs)
      : options_(options), scenario_(std::move(scenario)), outputs_(std::move(outputs)) {}

  int run();

 private:
  void read();
  std::unique_ptr<ScenarioRun> begin(const MakeSimulation& make);
  void simulate(ScenarioRun& run, SimulateRecord& record);
  void write(const fs::path& path, const VertexField& field);

  const SimulateOptions& options_;
  Scenario scenario_;
  Outputs outputs_;
  Patient patient_;
  std::vector<std::string> warnings_, notes_;
  double read_seconds_ = 0, prepare_seconds_ = 0, write_seconds_ = 0;
};

void Simulating::read() {
  AnyVolume volume, labels;
  {
    Stage stage(options_.common, "read");
    const InputHeader header = open_input(options_.input, options_.common);
    outputs_.set.add_reads(outputs_.reads.slices(options_.input, header));
    if (header.series) warnings_ = header.series->warnings;
    notes_ = header.notes;
    volume = read_input(options_.input, header, options_.common, stage.control()).volume;
    if (!options_.labels.empty()) {
      const InputOptions from = volume_named(options_.labels, options_.common.nifti_frame);
      const InputHeader labels_header = open_input(from, options_.common);
      notes_.insert(notes_.end(), labels_header.notes.begin(), labels_header.notes.end());
      labels = read_input(from, labels_header, options_.common, stage.control()).volume;
    }
    read_seconds_ = stage.seconds();
  }
  Stage stage(options_.common, "prepare");
  const ConstVolumeView ct = std::as_const(volume).view(), labelled = std::as_const(labels).view();
  patient_ = examine(ct, options_.labels.empty() ? nullptr : &labelled, scenario_.cell_size, scenario_.body_above_hu,
                     stage.control());
  prepare_seconds_ = stage.seconds();
}

void Simulating::write(const fs::path& path, const VertexField& field) {
  Stage stage(options_.common, "write");
  outputs_.set.write([&] { write_vertex_field(path, field); });
  write_seconds_ += stage.seconds();
}

void Simulating::simulate(ScenarioRun& run, SimulateRecord& record) {
  Stage stage(options_.common, "simulate");
  const Control whole = stage.control();
  auto staged = outputs_.frames.begin();
  double written = 0;
  for (int done = 0; !run.is_done(); ++done) {
    const Control control{.progress = [&](double part) { whole.progress((done + part) / run.frames()); },
                          .stop = whole.stop};
    const FrameResult frame = run.next(control);
    const bool is_wanted = staged != outputs_.frames.end() && staged->first == frame.number;
    const std::vector<glm::vec3> displacement = frame.ends_phase ? run.displacement() : std::vector<glm::vec3>();
    add_frame(record, frame, displacement);
    if (!is_wanted) continue;
    const double begun = stage.seconds();
    write(staged->second, run.field());
    written += stage.seconds() - begun;
    ++staged;
  }
  record.stages.emplace_back("simulate", stage.seconds() - written);
}

std::unique_ptr<ScenarioRun> Simulating::begin(const MakeSimulation& make) {
  try {
    return std::make_unique<ScenarioRun>(scenario_, patient_, make);
  } catch (const InputError& error) {
    throw InputError(std::string(error.what()) + ", " + options_.scenario.string());
  }
}

int Simulating::run() {
  read();
  const BackendKind backend = chosen(options_.backend);
  const std::unique_ptr<ScenarioRun> begun = begin([&](const Model& model) {
    return make_simulation(backend, scenario_.method, model, options_.device, {.threads = options_.common.threads});
  });
  ScenarioRun& run = *begun;
  SimulateRecord record{options_, scenario_, patient_, run, name_of(backend)};
  for (const std::string& warning : warnings_) say(options_.common, "tetwarp: warning: " + warning);
  for (const std::string& note : notes_) say(options_.common, "tetwarp: note: " + note);
  if (options_.dry_run) {
    for (const std::string& warning : warnings_of(record)) say(options_.common, "tetwarp: warning: " + warning);
    say(options_.common, "would simulate: " + describe(record));
    return 0;
  }
  record.stages = {{"read", read_seconds_}, {"prepare", prepare_seconds_}};
  simulate(run, record);
  const VertexField field = run.field();
  write(outputs_.field, field);
  record.stages.emplace_back("write", write_seconds_);
  outputs_.set.write([&] {
    if (!outputs_.report.empty()) write_json(outputs_.report, Record::open(document_of(record)));
  });
  outputs_.set.commit();
  for (const std::string& warning : warnings_of(record)) say(options_.common, "tetwarp: warning: " + warning);
  say(options_.common, "simulated: " + describe(record));
  say(options_.common,
      "wrote " + options_.output.string() + ": forward field, " + to_string(patient_.lattice.size) + " vertices" +
          (field.replaced.empty() ? std::string()
                                  : ", " + std::to_string(field.replaced.size()) + " cells along open cuts as " +
                                        std::to_string(field.mesh.tetrahedra.size()) + " tetrahedra") +
          (outputs_.frames.empty() ? std::string()
                                   : ", and " + std::to_string(outputs_.frames.size()) + " frames on the way"));
  return 0;
}

}  // namespace

int run_simulate(const SimulateOptions& options) {
  if (!has_image_suffix(options.output) && !has_mesh_suffix(options.output)) {
    throw UsageError("unknown suffix of \"" + options.output.string() +
                     "\"; a field is written as .mha .nrrd .nii .nii.gz, or as a mesh, .vtu .vtk");
  }
  Scenario scenario = read_scenario(options.scenario);
  require_fitting_format(scenario, options.output, options.every > 0);
  Outputs outputs = begin_outputs(options, scenario);
  return Simulating(options, std::move(scenario), std::move(outputs)).run();
}

}  // namespace tetwarp::apps
