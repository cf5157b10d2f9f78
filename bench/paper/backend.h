// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bench/paper/fields.h"
#include "bench/paper/method.h"
#include "deform/resampler.h"

namespace tetwarp::bench {

/// How often a frame is run: first untimed, then timed, then with copies in and out.
struct FrameCount {
  int warmup = 3, timed = 50, end_to_end = 5;
};

/// Milliseconds of each frame. Empty: there is no such time.
struct FrameTimes {
  std::vector<double> kernel_ms;      ///< the method itself; all data where it computes, the output cleared before
  std::vector<double> field_ms;       ///< tetwarp: set_field, and for FieldSource::kernel the formula before it
  std::vector<double> total_ms;       ///< tetwarp: both of a frame
  std::vector<double> copy_in_ms;     ///< source, and for FieldSource::memory the field, from pageable host memory
  std::vector<double> copy_out_ms;    ///< the output, to pageable host memory
  std::vector<double> end_to_end_ms;  ///< wall clock: copies in, clearing the output, the method, copy out
};

/// What Tetwarp makes of a volume and a field.
struct Exact {
  std::vector<std::int16_t> output;
  std::vector<std::uint8_t> coverage;
};

/// One place to compute: takes a volume, then field after field, and runs every method on them.
class Backend {
 public:
  virtual ~Backend() = default;
  Backend(const Backend&) = delete;
  Backend& operator=(const Backend&) = delete;

  /// @param volume      spacing 1, origin 0; kept, so it must stay
  /// @param background  value of voxels that nothing is written to
  void set_volume(const Volume<std::int16_t>& volume, std::int16_t background);
  /// A lattice with a vertex every `cell_size` voxels, and a formula on it: evaluated in float, by the code that
  /// FieldSource::kernel runs, so that both sources are one field.
  void set_field(const Formula& formula, std::int64_t cell_size);

  virtual FrameTimes time(Method method, FieldSource source, const FrameCount& frames) = 0;
  /// Output of the last timed frame.
  virtual const std::vector<std::int16_t>& output() = 0;
  /// How often each voxel is written, from a run of its own. Tetwarp writes what its coverage map says.
  std::vector<std::uint32_t> count_writes(Method method, FieldSource source);

  /// Tetwarp's result on this backend.
  const Exact& exact();
  /// The field in memory.
  const VertexField& field() const { return field_; }

 protected:
  explicit Backend(int threads) : threads_(threads) {}

  virtual std::unique_ptr<ForwardResampler> make_resampler(const Geometry& geometry) const = 0;
  virtual void volume_changed() {}
  /// Fills `field_.displacement`, sized and ready, with the formula.
  virtual void fill_field() = 0;
  virtual std::vector<std::uint32_t> count_baseline_writes(Method method, FieldSource source) = 0;

  const int threads_;
  const Volume<std::int16_t>* volume_ = nullptr;
  std::int16_t background_ = 0;
  Formula formula_;
  std::int64_t cell_size_ = 1;
  VertexField field_;
  std::unique_ptr<ForwardResampler> resampler_;

 private:
  std::optional<Exact> exact_;
};

/// Plain loops on the host, sampling in software, float. @param threads  0: all
std::unique_ptr<Backend> make_cpu_backend(int threads);
/// @throws DeviceError without a device, NotCompiled in a build without CUDA
std::unique_ptr<Backend> make_cuda_backend(int device);

/// Facts of a device and the software that drives it.
struct CudaFacts {
  std::string name, driver, runtime, compute_capability;
};
/// @throws DeviceError, NotCompiled
CudaFacts describe_cuda(int device);

}  // namespace tetwarp::bench
