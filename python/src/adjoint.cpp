// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/adjoint.h"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "backend/factories.h"
#include "python/src/calls.h"
#include "python/src/fields.h"
#include "python/src/module.h"
#include "python/src/words.h"

namespace tetwarp::python {

namespace {

/// One volume of a call, as Python describes it.
struct AdjointArrays {
  std::optional<ConstArray> source;
  Geometry grid;  ///< of the source
  ConstArray output_gradient;
  std::optional<Array> source_gradient;
  std::string interpolation;
};

/// The transpose and the gradients behind `tetwarp.torch`, with what they refer to.
class BoundAdjoint {
 public:
  BoundAdjoint(const std::string& backend, const Geometry& output, int device, int threads) : output_(output) {
    const WithoutGil released;
    const BackendKind kind = kind_of(backend);
    adjoint_ = make_adjoint(kind, output_, device, {.threads = threads_of(threads)});
  }

  void set_field(const std::optional<Geometry>& lattice, const std::optional<ConstArray>& displacement,
                 const std::optional<MeshArrays>& mesh, const std::optional<ConstArray>& replaced,
                 const std::string& outside, const CallOptions& options) {
    const std::unique_lock lock = locked(mutex_);
    is_set_ = false;  // until the field is taken: what it referred to is replaced
    const FieldView field = forward_.hold(lattice, displacement, mesh, replaced, outside);
    run_call(options, forward_.is_small() && voxel_count(output_) < kSmallCall,
             [&](const Control& control) { adjoint_->set_field(field, control); });
    is_set_ = true;
  }

  /// @param displacement  takes dL/d(displacement), [n, 3] of float, or None
  void apply(const std::vector<AdjointArrays>& targets, const std::optional<Array>& displacement,
             const CallOptions& options) {
    std::vector<AdjointTarget> views;
    for (const AdjointArrays& one : targets) {
      AdjointTarget target;
      target.output_gradient = voxels_of(one.output_gradient, output_, "the gradient of the output");
      target.interpolation = interpolation_of(one.interpolation);
      if (one.source_gradient)
        target.source_gradient = voxels_of(*one.source_gradient, one.grid, "the gradient of the volume");
      if (one.source) {
        target.source = voxels_of(*one.source, one.grid, "the volume");
      } else {
        target.source = target.output_gradient;
        target.source.geometry = &one.grid;
        target.source.buffered = whole(one.grid);
        target.source.voxels = nullptr;
      }
      views.push_back(target);
    }
    DisplacementGradient gradient;
    if (displacement) {
      const ConstArray read(*displacement);
      const auto* values = values_of<float>(read, {-1, 3}, "the gradient of the displacement", true);
      gradient = {{reinterpret_cast<glm::vec3*>(const_cast<float*>(values)), displacement->shape(0)},
                  memory_of(read, "the gradient of the displacement")};
    }
    const std::unique_lock lock = locked(mutex_);
    require(is_set_, "apply needs a field: call set_field first");
    run_call(options, voxel_count(output_) < kSmallCall,
             [&](const Control& control) { adjoint_->apply(views, gradient, control); });
  }

 private:
  Geometry output_;
  std::unique_ptr<ResampleAdjoint> adjoint_;
  ForwardArrays forward_;
  bool is_set_ = false;
  std::timed_mutex mutex_;
};

}  // namespace

void add_adjoint(nb::module_& core) {
  nb::class_<AdjointArrays>(core, "AdjointTarget")
      .def(
          "__init__",
          [](AdjointArrays* self, std::optional<ConstArray> source, const Geometry& grid, ConstArray output_gradient,
             std::optional<Array> source_gradient, std::string interpolation) {
            new (self) AdjointArrays{std::move(source), grid, std::move(output_gradient), std::move(source_gradient),
                                     std::move(interpolation)};
          },
          nb::arg("source").none(), nb::arg("grid"), nb::arg("output_gradient"), nb::arg("source_gradient").none(),
          nb::arg("interpolation"));
  nb::class_<BoundAdjoint>(core, "Adjoint")
      .def(nb::init<const std::string&, const Geometry&, int, int>(), nb::arg("backend"), nb::arg("output"),
           nb::arg("device"), nb::arg("threads"))
      .def("set_field", &BoundAdjoint::set_field, nb::arg("lattice").none(), nb::arg("displacement").none(),
           nb::arg("mesh").none(), nb::arg("replaced").none(), nb::arg("outside"), nb::arg("options"))
      .def("apply", &BoundAdjoint::apply, nb::arg("targets"), nb::arg("displacement").none(), nb::arg("options"));
}

}  // namespace tetwarp::python
