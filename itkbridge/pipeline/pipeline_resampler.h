// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <memory>
#include <string>
#include <variant>

#include "cuda/backend.h"
#include "deform/resampler.h"
#include "itkbridge/pipeline/pipeline_run.h"

namespace tetwarp {

/// A field that a filter was given, forward or pull. Equal owners are the same field, unchanged.
struct HeldField {
  std::variant<FieldView, PullFieldView> view;
  std::shared_ptr<const void> owner;  ///< keeps what the view points to
};

/// Where a filter's work is done.
struct PipelineOptions {
  std::string backend = "auto";  ///< auto, cpu or cuda
  int device = 0;
  int threads = 0;
  std::uint64_t device_memory = 0;  ///< bytes, `Limits::memory`

  friend bool operator==(const PipelineOptions&, const PipelineOptions&) = default;
};

/// The resampler of a filter. It keeps the field that it was given, so that regions and images that come later need not
/// prepare it again; and the next field of the same direction, output and options goes into what memory the one before
/// took. With `auto` the CPU takes over where CUDA is missing or fails, with the same bits; the process warns of that
/// once.
class PipelineResampler {
 public:
  /// Makes the resampler and gives it the field, unless it has it already.
  /// @return whether there was something to do
  /// @throws itk::ExceptionObject
  bool set_field(itk::ProcessObject& filter, const Geometry& output, const HeldField& field,
                 const PipelineOptions& options, ProgressShare share);

  /// What of a source a region of the output needs; whole voxels of it, at least one. `set_field` comes first.
  Region source_region(const itk::ProcessObject& filter, const Geometry& source, const Region& output) const;

  /// `Resampler::resample`. @throws itk::ExceptionObject
  Report resample(itk::ProcessObject& filter, const Region& region, std::span<const Target> targets, const Maps& maps,
                  ProgressShare share);

  /// "cpu" or "cuda", of the last field; empty before.
  const std::string& backend() const { return backend_.name; }

 private:
  bool holds(const Geometry& output, const HeldField& field, const PipelineOptions& options) const;
  /// Whether the resampler at hand can take the field, and is not the one that stands in for a device that failed.
  bool takes(const Geometry& output, const HeldField& field, const PipelineOptions& options) const;
  void make(const std::string& wanted, const Control& control);
  void give_field(const Control& control);
  /// In the handler of an error of the device: the CPU takes the field, or the error goes on if CUDA was asked for.
  void fall_back(const itk::ProcessObject& filter, const Control& control, const DeviceError& error);

  Backend backend_;
  Geometry output_;
  HeldField field_;
  PipelineOptions options_;
};

}  // namespace tetwarp
