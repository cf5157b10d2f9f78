// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>
#include <variant>

#include "backend/backend.h"
#include "deform/adjoint.h"
#include "deform/render/renderer.h"
#include "deform/resampler.h"
#include "deform/simulate/scenario.h"
#include "deform/simulate/simulation.h"

// Everything here throws NotCompiled for a backend that this build does not contain, and DeviceError for a device that
// does not work on this machine.
namespace tetwarp {

/// Makes a resampler of forward fields. Its bits are the same on every backend.
///
/// On a device, fields, sources and results in host memory pass through pinned memory while kernels run. Calls of
/// repeated sizes allocate nothing. `set_field` and `resample` throw DeviceError where not even one slice fits the
/// memory allowed.
/// @param backend  where it runs
/// @param output   output grid
/// @param device   number of the device
/// @param limits   threads and device memory
/// @throws InputError for an output with fewer than two voxels, or more than 2^18, on an axis
std::unique_ptr<ForwardResampler> make_forward_resampler(BackendKind backend, const Geometry& output, int device = 0,
                                                         const Limits& limits = {});
/// Makes a resampler of pull fields. Its bits are the same on every backend.
/// @param backend  where it runs
/// @param output   output grid
/// @param device   number of the device
/// @param limits   threads and device memory
/// @throws InputError for an output with fewer than two voxels, or more than 2^18, on an axis
std::unique_ptr<PullResampler> make_pull_resampler(BackendKind backend, const Geometry& output, int device = 0,
                                                   const Limits& limits = {});

/// Makes the transpose and the gradients of forward fields. Their bits are the same on every backend.
/// @param backend  where it runs
/// @param output   grid of the deformed volumes
/// @param device   number of the device
/// @param limits   threads; on a device all that it needs must fit its memory
/// @throws InputError for an output with fewer than two voxels, or more than 2^18, on an axis
std::unique_ptr<ResampleAdjoint> make_adjoint(BackendKind backend, const Geometry& output, int device = 0,
                                              const Limits& limits = {});

/// A resampler for where a file, an option or a pipeline decides which way its fields map, and where it runs.
class AnyResampler {
 public:
  /// No resampler.
  AnyResampler() = default;
  /// Makes a resampler of fields of this direction; the other parameters are those of `make_forward_resampler`.
  AnyResampler(BackendKind backend, Direction direction, const Geometry& output, int device = 0,
               const Limits& limits = {});

  /// Whether there is a resampler.
  explicit operator bool() const { return get() != nullptr; }
  /// Where the resampler runs.
  BackendKind backend() const { return backend_; }
  /// The resampler, for all that is the same in both directions.
  Resampler& operator*() const { return *get(); }
  /// The resampler, for all that is the same in both directions.
  Resampler* operator->() const { return get(); }
  /// The resampler that takes forward fields.
  /// @throws std::bad_variant_access if it was made for pull fields
  ForwardResampler& forward() const { return *std::get<std::unique_ptr<ForwardResampler>>(held_); }
  /// The resampler that takes pull fields.
  /// @throws std::bad_variant_access if it was made for forward fields
  PullResampler& pull() const { return *std::get<std::unique_ptr<PullResampler>>(held_); }
  /// Frees the resampler and what it holds.
  void reset() { *this = {}; }

 private:
  Resampler* get() const {
    return std::visit([](const auto& held) -> Resampler* { return held.get(); }, held_);
  }

  BackendKind backend_ = BackendKind::cpu;
  std::variant<std::unique_ptr<ForwardResampler>, std::unique_ptr<PullResampler>> held_;
};

/// Makes a renderer. Its pictures have the same bytes on every backend.
/// @param backend  where it runs
/// @param device   number of the device
/// @param limits   threads; `memory` limits the bytes of a device's own copy of a volume, without which pictures take
///         longer
std::unique_ptr<Renderer> make_renderer(BackendKind backend, int device = 0, const Limits& limits = {});

namespace simulate {

/// Makes a simulation. Both methods have the same bits on every backend. On a device their displacements stay there.
/// @param backend  where it runs
/// @param method   what is simulated
/// @param model    must outlive the simulation
/// @param device   number of the device
/// @param limits   number of threads
/// @throws InputError as `make_cpu_chainmail` and `make_cpu_mass_spring`
std::unique_ptr<Simulation> make_simulation(BackendKind backend, Method method, const Model& model, int device = 0,
                                            const Limits& limits = {});

/// Makes an empty copy for the displacements of simulations on a backend.
/// @param backend  where they run
/// @param device   number of the device
std::unique_ptr<DisplacementCopy> make_displacement_copy(BackendKind backend, int device = 0);

}  // namespace simulate

}  // namespace tetwarp
