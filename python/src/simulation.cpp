// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <mutex>
#include <optional>

#include "backend/factories.h"
#include "deform/simulate/scenario_run.h"
#include "io/scenario_file.h"
#include "python/src/calls.h"
#include "python/src/fields.h"
#include "python/src/module.h"

namespace tetwarp::python {

namespace {

using namespace simulate;

/// A scenario that is played on a volume, frame by frame.
class BoundRun {
 public:
  BoundRun(const std::filesystem::path& scenario, const ConstArray& ct, const Geometry& grid,
           const std::optional<ConstArray>& labels, const std::optional<Geometry>& labels_grid,
           const std::string& backend, int device, int threads, const CallOptions& options) {
    const ConstVolumeView voxels = voxels_of(ct, grid, "the volume");
    require(voxels.memory == Memory::host, "the volume lies on a device; a simulation examines it in host memory");
    std::optional<ConstVolumeView> labelled;
    if (labels) {
      require(labels_grid.has_value(), "the labels have no grid");
      labelled = voxels_of(*labels, *labels_grid, "the labels");
      require(labelled->memory == Memory::host,
              "the labels lie on a device; a simulation examines them in host memory");
    }
    run_call(options, false, [&](const Control& control) {
      const BackendKind kind = kind_of(backend);
      scenario_ = read_scenario(scenario);
      patient_ = examine(voxels, labelled ? &*labelled : nullptr, scenario_.cell_size, scenario_.body_above_hu,
                         {.stop = control.stop});
      run_.emplace(scenario_, patient_,
                   [kind, this, device, limits = Limits{.threads = threads_of(threads)}](const Model& model) {
                     return make_simulation(kind, scenario_.method, model, device, limits);
                   });
      backend_ = name_of(kind);
    });
  }

  int frames() const { return run_->frames(); }
  bool is_done() const { return run_->is_done(); }
  std::string backend() const { return backend_; }
  std::string phase_name(std::size_t phase) const { return scenario_.phases.at(phase).name; }

  /// Number, phase, whether it ends its phase, steps, motion in mm, residual, whether it converged.
  nb::tuple next(const CallOptions& options) {
    const std::unique_lock lock = in_use();
    FrameResult frame;
    run_call(options, false, [&](const Control& control) { frame = run_->next(control); });
    return nb::make_tuple(frame.number, frame.phase, frame.ends_phase, frame.convergence.steps,
                          frame.convergence.motion_mm, frame.convergence.residual, frame.convergence.reached);
  }
  nb::tuple field() {
    const std::unique_lock lock = in_use();
    return as_tuple(run_->field());
  }

 private:
  std::unique_lock<std::timed_mutex> in_use() {
    require(!is_in_progress_callable(), "a progress callable cannot call its simulation; note the share, and return");
    return locked(mutex_);
  }

  std::timed_mutex mutex_;
  Scenario scenario_;
  Patient patient_;
  std::optional<ScenarioRun> run_;
  std::string backend_;
};

}  // namespace

void add_simulation(nb::module_& core) {
  nb::class_<BoundRun>(core, "Run")
      .def(nb::init<const std::filesystem::path&, const ConstArray&, const Geometry&, const std::optional<ConstArray>&,
                    const std::optional<Geometry>&, const std::string&, int, int, const CallOptions&>(),
           nb::arg("scenario"), nb::arg("ct"), nb::arg("grid"), nb::arg("labels").none(), nb::arg("labels_grid").none(),
           nb::arg("backend"), nb::arg("device"), nb::arg("threads"), nb::arg("options"))
      .def_prop_ro("frames", &BoundRun::frames)
      .def_prop_ro("is_done", &BoundRun::is_done)
      .def_prop_ro("backend", &BoundRun::backend)
      .def("phase_name", &BoundRun::phase_name, nb::arg("phase"))
      .def("next", &BoundRun::next, nb::arg("options"))
      .def("field", &BoundRun::field);
}

}  // namespace tetwarp::python
