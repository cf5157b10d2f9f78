// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>
#include <string>
#include <variant>

#include "backend/factories.h"
#include "deform/adjoint.h"
#include "deform/resampler.h"
#include "itkbridge/pipeline/pipeline_run.h"

namespace tetwarp {

/// A field that a filter was given, forward or pull. Two objects with the same owner are the same field, unchanged.
struct HeldField {
  std::variant<FieldView, PullFieldView> view;  ///< the field
  std::shared_ptr<const void> owner;            ///< keeps alive what the view points to
};

/// Where a filter works.
struct PipelineOptions {
  BackendChoice backend = BackendChoice::automatic;  ///< what is wished
  int device = 0;                                    ///< number of the CUDA device
  int threads = 0;                                   ///< number of CPU threads; 0: all that this process may use
  std::uint64_t device_memory = 0;                   ///< bytes, see `Limits::memory`

  /// Whether all options are equal.
  friend bool operator==(const PipelineOptions&, const PipelineOptions&) = default;
};

/// The resampler of a filter. It keeps its field, so that later regions and images need not prepare it again. The next
/// field with the same direction, output and options reuses the memory of the one before. Where the backend is left
/// open, the CPU takes over where CUDA is missing or fails, with the same bits, and the process warns once.
class PipelineResampler {
 public:
  /// Makes the resampler and gives it the field, unless it has it already.
  /// @param filter   filter that warnings and exceptions name
  /// @param output   output grid
  /// @param field    forward or pull field
  /// @param options  where to work
  /// @param share    part of the filter's progress
  /// @return whether anything had to be done
  /// @throws itk::ExceptionObject for a field or an output that a resampler refuses, or a backend that cannot be used
  bool set_field(itk::ProcessObject& filter, const Geometry& output, const HeldField& field,
                 const PipelineOptions& options, ProgressShare share);

  /// The voxels of a source grid that an output region needs, at least one. `set_field` must have been called.
  Region source_region(const itk::ProcessObject& filter, const Geometry& source, const Region& output) const;

  /// Calls `Resampler::resample` and reports its progress as a part of the filter's.
  /// @throws itk::ExceptionObject
  Report resample(itk::ProcessObject& filter, const Region& region, std::span<const Target> targets, const Maps& maps,
                  ProgressShare share);

  /// The backend to which the last field went, "cpu" or "cuda"; empty before the first field.
  std::string backend() const { return resampler_ ? name_of(resampler_.backend()) : ""; }

 private:
  /// Whether the resampler has this field, for this output and these options.
  bool holds(const Geometry& output, const HeldField& field, const PipelineOptions& options) const;
  /// Whether the present resampler can take the field. A resampler that stands in for a device that failed cannot.
  bool takes(const Geometry& output, const HeldField& field, const PipelineOptions& options) const;
  void make(BackendKind backend, const Control& control);
  void give_field(const Control& control);
  /// Handles an error of the device: the CPU takes the field, or, where a device is demanded, the error is thrown
  /// again.
  void fall_back(const itk::ProcessObject& filter, const Control& control, const DeviceError& error);

  AnyResampler resampler_;
  Geometry output_;
  HeldField field_;
  PipelineOptions options_;
};

/// Makes a `ResampleAdjoint`, gives it a field and applies it, for a filter. Where the backend is left open, the CPU
/// takes over as for a PipelineResampler.
/// @param filter        filter that warnings and exceptions name, and whose progress is told
/// @param output        grid of the deformed image
/// @param field         forward field
/// @param options       where to work
/// @param targets       see `ResampleAdjoint::apply`
/// @param displacement  see `ResampleAdjoint::apply`
/// @return where the work was done, "cpu" or "cuda"
/// @throws itk::ExceptionObject
std::string apply_adjoint(itk::ProcessObject& filter, const Geometry& output, const FieldView& field,
                          const PipelineOptions& options, std::span<const AdjointTarget> targets,
                          const DisplacementGradient& displacement);

}  // namespace tetwarp
