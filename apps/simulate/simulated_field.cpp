// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/simulate/simulated_field.h"

#include "apps/cli/reads.h"
#include "apps/simulate/simulate_report.h"
#include "backend/factories.h"
#include "io/mesh_writer.h"

namespace tetwarp::apps {

namespace {

using namespace simulate;

/// Bytes of model, springs or links, and state for each vertex, measured on 512 x 512 x 100 voxels with cells of 8 and
/// of 4 voxels.
constexpr std::uint64_t kBytesPerVertex = 600;

SimulateOptions as_simulation(const DeformOptions& options, const Worker& worker) {
  SimulateOptions of;
  of.common = options.common;
  of.scenario = options.scenario;
  of.input = options.input;
  of.labels = options.labels;
  of.backend = worker.backend;
  of.device = worker.device;
  return of;
}

AnyVolume read_labels(const DeformOptions& options, const Control& control) {
  const InputOptions from = volume_named(options.labels, options.common.nifti_frame);
  return read_input(from, open_input(from, control), options.common, control).volume;
}

}  // namespace

SimulatedField simulate_field(const DeformOptions& options, const Scenario& scenario, const ConstVolumeView& ct,
                              const Worker& worker, const Control& control) {
  const Control quiet{.stop = control.stop};
  SimulatedField result;
  Patient patient;
  {
    const AnyVolume labels = options.labels.empty() ? AnyVolume() : read_labels(options, quiet);
    const ConstVolumeView labelled = std::as_const(labels).view();
    patient =
        examine(ct, options.labels.empty() ? nullptr : &labelled, scenario.cell_size, scenario.body_above_hu, quiet);
  }
  const SimulateOptions of = as_simulation(options, worker);
  const BackendKind backend = chosen(of.backend);
  const auto make = [&](const Model& model) {
    return make_simulation(backend, scenario.method, model, of.device, {.threads = options.common.threads});
  };
  std::optional<ScenarioRun> run;
  try {
    run.emplace(scenario, patient, make);
  } catch (const InputError& error) {
    throw InputError(std::string(error.what()) + ", " + options.scenario.string());
  }
  SimulateRecord record{of, scenario, patient, *run, name_of(backend)};
  for (int done = 0; !run->is_done(); ++done) {
    const FrameResult frame = run->next({.progress =
                                             [&](double part) {
                                               if (control.progress) control.progress((done + part) / run->frames());
                                             },
                                         .stop = control.stop,
                                         .stream = worker.stream});
    add_frame(record, frame, frame.ends_phase ? run->displacement() : std::vector<glm::vec3>());
  }
  result.field = run->field();
  result.warnings = warnings_of(record);
  result.source = {
      .scenario = options.scenario.string(),
      .scenario_sha256 = hash_file(options.scenario),
      .labels = options.labels.string(),
      .labels_sha256 = options.labels.empty() ? "" : hash_volume(volume_named(options.labels), options.common.threads),
      .method = scenario.method,
      .backend = name_of(backend)};
  return result;
}

std::uint64_t simulation_bytes(const Scenario& scenario, const Geometry& volume, bool labels) {
  const glm::i64vec3 vertices = lattice_over(straightened(volume), scenario.cell_size).size;
  return static_cast<std::uint64_t>(vertices.x * vertices.y * vertices.z) * kBytesPerVertex +
         (labels ? static_cast<std::uint64_t>(voxel_count(volume)) * sizeof(std::int32_t) : 0);
}

void require_fitting_format(const Scenario& scenario, const std::filesystem::path& output, bool every_phase) {
  if (has_mesh_suffix(output)) return;
  for (const Phase& phase : scenario.phases) {
    if (!every_phase && &phase != &scenario.phases.back()) continue;
    for (const CutPlan& cut : scenario.cuts) {
      if (!is_open(cut, phase)) continue;
      throw InputError("the cut \"" + cut.name + "\" is open" + (phase.name.empty() ? "" : " in " + phase.name) +
                       ", which " + output.string() + " cannot hold; write a mesh, .vtu or .vtk");
    }
  }
}

}  // namespace tetwarp::apps
