// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "itkbridge/pipeline/pipeline_resampler.h"

#include <atomic>
#include <utility>

#include "backend/devices.h"

namespace tetwarp {

namespace {

bool is_same(const HeldField& a, const HeldField& b) {
  if (a.owner != b.owner || a.view.index() != b.view.index()) return false;
  return std::visit([](const auto& left, const auto& right) { return left.outside == right.outside; }, a.view, b.view);
}

void warn_of_fallback(const itk::ProcessObject& filter, const std::string& reason) {
  static std::atomic_flag warned = ATOMIC_FLAG_INIT;
  if (!warned.test_and_set())
    warn(filter,
         "works on the CPU, the bits are the same: " + reason + "; SetBackend(\"cpu\") says so without a warning");
}

/// Warns where the backend is left open and there is no device.
void warn_without_device(const itk::ProcessObject& filter, BackendChoice choice) {
  if (leaves_open(choice) && !runs_on_device(chosen(choice)))
    warn_of_fallback(filter, has_cuda() ? "no CUDA device works on this machine" : "CUDA is not in this build");
}

}  // namespace

bool PipelineResampler::holds(const Geometry& output, const HeldField& field, const PipelineOptions& options) const {
  return resampler_ && output_ == output && options_ == options && is_same(field_, field);
}

bool PipelineResampler::takes(const Geometry& output, const HeldField& field, const PipelineOptions& options) const {
  return resampler_ && output_ == output && options_ == options && field_.view.index() == field.view.index() &&
         resampler_.backend() == chosen(options.backend);
}

void PipelineResampler::make(BackendKind backend, const Control& control) {
  const Direction direction = std::holds_alternative<FieldView>(field_.view) ? Direction::forward : Direction::pull;
  resampler_.reset();  // frees the memory of this resampler before another allocates its own
  resampler_ = AnyResampler(backend, direction, output_, options_.device,
                            {.threads = options_.threads, .memory = options_.device_memory});
  give_field(control);
}

void PipelineResampler::give_field(const Control& control) {
  if (const auto* forward = std::get_if<FieldView>(&field_.view)) {
    resampler_.forward().set_field(*forward, {}, control);
  } else {
    resampler_.pull().set_field(std::get<PullFieldView>(field_.view), control);
  }
}

void PipelineResampler::fall_back(const itk::ProcessObject& filter, const Control& control, const DeviceError& error) {
  if (!leaves_open(options_.backend)) throw;
  warn_of_fallback(filter, error.what());
  make(BackendKind::cpu, control);
}

bool PipelineResampler::set_field(itk::ProcessObject& filter, const Geometry& output, const HeldField& field,
                                  const PipelineOptions& options, ProgressShare share) {
  if (holds(output, field, options)) return false;
  if (!takes(output, field, options)) resampler_.reset();
  const HeldField before = std::exchange(field_, field);  // kept until the resampler no longer points into it
  output_ = output;
  options_ = options;
  warn_without_device(filter, options.backend);
  try {
    run_for(filter, share, [&](const Control& control) {
      try {
        if (resampler_)
          give_field(control);
        else
          make(chosen(options.backend), control);
      } catch (const DeviceError& error) {
        fall_back(filter, control, error);
      }
    });
  } catch (...) {
    resampler_.reset();
    field_ = {};
    throw;
  }
  return true;
}

Region PipelineResampler::source_region(const itk::ProcessObject& filter, const Geometry& source,
                                        const Region& output) const {
  Region region;
  translate_errors(filter, [&] { region = resampler_->source_region(source, output); });
  return is_empty(region) ? Region{glm::i64vec3(0), glm::i64vec3(1)} : region;
}

Report PipelineResampler::resample(itk::ProcessObject& filter, const Region& region, std::span<const Target> targets,
                                   const Maps& maps, ProgressShare share) {
  Report report;
  run_for(filter, share, [&](const Control& control) {
    const auto work = [&] { report = resampler_->resample(region, targets, maps, control); };
    try {
      work();
    } catch (const DeviceError& error) {
      fall_back(filter, control, error);
      work();
    }
  });
  return report;
}

std::string apply_adjoint(itk::ProcessObject& filter, const Geometry& output, const FieldView& field,
                          const PipelineOptions& options, std::span<const AdjointTarget> targets,
                          const DisplacementGradient& displacement) {
  BackendKind used = chosen(options.backend);
  warn_without_device(filter, options.backend);
  run_for(filter, {}, [&](const Control& control) {
    const auto work = [&] {
      const auto adjoint =
          make_adjoint(used, output, options.device, {.threads = options.threads, .memory = options.device_memory});
      Control finding = control;
      if (control.progress) finding.progress = [&](double done) { control.progress(done / 2); };
      adjoint->set_field(field, finding);
      adjoint->apply(targets, displacement, control);
    };
    try {
      work();
    } catch (const DeviceError& error) {
      if (!leaves_open(options.backend)) throw;
      warn_of_fallback(filter, error.what());
      used = BackendKind::cpu;
      work();
    }
  });
  return name_of(used);
}

}  // namespace tetwarp
