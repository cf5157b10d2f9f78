// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <array>
#include <memory>
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

/// Displacements [k, j, i, 3] on a device, LPS mm.
class BoundCopy {
 public:
  BoundCopy(const Geometry& lattice, int device, std::shared_ptr<DisplacementCopy> copy)
      : lattice_(lattice), device_(device), copy_(std::move(copy)) {}

  /// An array of DLPack that keeps the memory for as long as somebody refers to it.
  nb::object exchanged() const {
    auto* held = new std::shared_ptr<DisplacementCopy>(copy_);
    const nb::capsule owner(held,
                            [](void* one) noexcept { delete static_cast<std::shared_ptr<DisplacementCopy>*>(one); });
    const std::array<std::size_t, 4> shape = shape_of(lattice_);
    return nb::cast(nb::ndarray<nb::array_api, float, nb::device::cuda>(
        copy_->values().data(), shape.size(), shape.data(), owner, nullptr, nb::dtype<float>(), nb::device::cuda::value,
        device_));
  }
  nb::object on_host() const {
    std::vector<glm::vec3> values;
    {
      const WithoutGil released;
      values = copy_->on_host();
    }
    return as_numpy(lattice_, std::move(values));
  }
  nb::tuple shape() const {
    const std::array<std::size_t, 4> shape = shape_of(lattice_);
    return nb::make_tuple(shape[0], shape[1], shape[2], shape[3]);
  }

 private:
  static std::array<std::size_t, 4> shape_of(const Geometry& lattice) {
    return {static_cast<std::size_t>(lattice.size.z), static_cast<std::size_t>(lattice.size.y),
            static_cast<std::size_t>(lattice.size.x), 3};
  }

  Geometry lattice_;
  int device_;
  std::shared_ptr<DisplacementCopy> copy_;
};

/// A scenario that is played on a volume, frame by frame.
class BoundRun {
 public:
  BoundRun(const std::filesystem::path& scenario, const ConstArray& ct, const Geometry& grid,
           const std::optional<ConstArray>& labels, const std::optional<Geometry>& labels_grid,
           const std::string& backend, int device, int threads, const CallOptions& options)
      : device_(device) {
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
  /// The field after the last frame, as `as_tuple` has it; the displacement of a simulation on a device stays there, as
  /// a BoundCopy, unless open cuts divide cells.
  nb::tuple field() {
    const std::unique_lock lock = in_use();
    if (run_->frames_done() > 0 && !run_->divides_cells()) {
      const Simulation& simulation = run_->simulation();
      if (simulation.memory() == Memory::device) {
        std::shared_ptr<DisplacementCopy> copy = make_displacement_copy(BackendKind::cuda, device_);
        copy->take(simulation.displacement());
        return nb::make_tuple(patient_.lattice, BoundCopy(patient_.lattice, device_, std::move(copy)), nb::none(),
                              nb::none());
      }
    }
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
  int device_;
};

}  // namespace

void add_simulation(nb::module_& core) {
  nb::class_<BoundCopy>(core, "DisplacementCopy")
      .def("exchanged", &BoundCopy::exchanged)
      .def("on_host", &BoundCopy::on_host)
      .def_prop_ro("shape", &BoundCopy::shape);
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
