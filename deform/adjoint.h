// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>
#include <span>
#include <utility>

#include "deform/resampler.h"

namespace tetwarp {

/// One volume of a deformation that is differentiated. L is any function of the deformed volumes.
struct AdjointTarget {
  /// The volume that was deformed, whole, of type f32 or f64. Its voxels are read only for the gradient of the
  /// displacement; a view without voxels, with geometry, type and components, serves otherwise.
  ConstVolumeView source;
  ConstVolumeView
      output_gradient;  ///< dL/d(output), on the whole output grid, of the type and components of the source
  /// Written: dL/d(source), on the whole grid of the source, of its type and components; without voxels it is not
  /// wanted.
  VolumeView source_gradient = {};
  Interpolation interpolation =
      Interpolation::linear;  ///< linear; nearest and cubic where only `source_gradient` is wanted
};

/// The gradient of the displacement of each vertex: those of the lattice, i fastest, then those of the mesh.
struct DisplacementGradient {
  std::span<glm::vec3> values = {};  ///< written: dL per mm, LPS, `vertex_count` of them; empty: it is not wanted
  Memory memory = Memory::host;      ///< where they lie
};

/// The transpose of a ForwardResampler, which as a function of the source is linear, and the gradient of what it gives
/// with respect to the displacements of its field (docs/design/definition.md, "The transpose and the gradients").
///
/// The gradient of the volume is exactly that of what was computed. That of the displacement is the derivative inside
/// of each tetrahedron: a voxel that changes its owner, or comes to be covered, adds nothing. The rounding of vertices
/// and places counts as if there were none.
///
/// Sums are those of whole numbers, so the result has the same bits on every backend, for any number of threads, on
/// every run. Each gradient has a unit of its own, that follows its largest term; that of the displacement has the
/// terms of all targets. A term that is not finite makes its gradient NaN, and no other.
///
/// What holds of memory and threads for a Resampler holds here; nothing is streamed, so a device refuses copies beyond
/// `Limits::memory`. Beside a resampler it takes 4
/// bytes for each voxel of the output; from the first call on 8 for each value of a wanted source gradient, and for
/// that of the displacement 12 for each voxel of the output and 24 for each vertex. A device keeps up to 12 bytes a
/// voxel more of the tetrahedra of a coarse field, and copies of what lies on the host.
class ResampleAdjoint {
 public:
  /// Frees what it holds; fields and volumes are not owned.
  virtual ~ResampleAdjoint() = default;
  /// The grid of the deformed volumes.
  const Geometry& output() const { return output_; }

  /// Finds the owners of all voxels. The view is kept: its vertices must not change until the next call.
  /// @param field    forward field
  /// @param control  progress, stop and stream
  /// @throws InputError as `ForwardResampler::set_field`; and for a field of 2^32 - 1 tetrahedra or more
  virtual void set_field(const FieldView& field, const Control& control = {}) = 0;

  /// Computes the gradients that are wanted.
  /// @param targets       volumes of one type that went through the field
  /// @param displacement  where the gradient of the displacement goes
  /// @param control       stop and stream
  /// @throws InputError for views and lengths that do not fit, integer volumes, an interpolation that has no such
  ///     gradient; on a device, where copies of what lies on the host exceed `Limits::memory`
  /// @throws Cancelled
  virtual void apply(std::span<const AdjointTarget> targets, const DisplacementGradient& displacement,
                     const Control& control = {}) = 0;

 protected:
  /// For implementations.
  explicit ResampleAdjoint(Geometry output) : output_(std::move(output)) {}

 private:
  Geometry output_;
};

/// How many vertices a field has: those of its lattice and those of its mesh.
std::int64_t vertex_count(const FieldView& field);

/// The transpose and the gradients on the CPU.
/// @throws InputError for an output with fewer than two voxels, or more than 2^18, on an axis
std::unique_ptr<ResampleAdjoint> make_cpu_adjoint(const Geometry& output, Limits limits = {});

/// For implementations: checks a call.
/// @param output   grid of the deformed volumes
/// @param targets  volumes of the call
/// @param displacement  of the call
/// @param vertices      of the field
/// @throws InputError as `ResampleAdjoint::apply`
void check_adjoint(const Geometry& output, std::span<const AdjointTarget> targets,
                   const DisplacementGradient& displacement, std::size_t vertices);

}  // namespace tetwarp
