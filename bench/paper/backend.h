// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bench/harness/turns.h"
#include "bench/paper/fields.h"
#include "bench/paper/method.h"
#include "deform/resampler.h"

namespace tetwarp::bench {

/// How often a frame is run: first untimed, then timed, then with copies in and out.
struct FrameCount {
  int warmup = 3, timed = 50, end_to_end = 5;
};

/// What Tetwarp makes of a volume and a field.
struct Exact {
  std::vector<std::int16_t> output;
  std::vector<std::uint8_t> coverage;
};

/// A method's result against Tetwarp's.
struct Tally {
  std::uint64_t writes = 0;       ///< of any voxel, several of one counted each
  std::uint64_t lost = 0;         ///< covered, and never written
  std::uint64_t multiple = 0;     ///< written more than once
  std::uint64_t spilled = 0;      ///< written, and not covered
  std::uint64_t covered = 0;      ///< by Tetwarp
  double largest_difference = 0;  ///< absolute, stored units, over voxels both covered and written
  double mean_difference = 0;

  friend bool operator==(const Tally&, const Tally&) = default;
};

/// @param output, writes  of the method; all of one size. @throws InputError where they are not
Tally compare(const Exact& exact, const std::vector<std::int16_t>& output, const std::vector<std::uint32_t>& writes);

/// Of the voxels that Tetwarp covers, the fraction whose value in `output` differs by more than 1, stored units: more
/// than truncating instead of rounding explains. @throws InputError for another size, or where nothing is covered
double differing_fraction(const Exact& exact, std::span<const std::int16_t> output);

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

  /// Milliseconds of each frame, by these names; a name that is missing has no such time.
  ///
  /// | name | what it is |
  /// | --- | --- |
  /// | kernel_ms | the method itself; all data where it computes, the output cleared before |
  /// | field_ms | tetwarp: set_field, and for FieldSource::kernel the formula before it |
  /// | total_ms | tetwarp: both of a frame |
  /// | copy_in_ms | source, and for FieldSource::memory the field, from pageable host memory |
  /// | copy_out_ms | the output, to pageable host memory |
  /// | end_to_end_ms | wall clock: copies in, clearing the output, the method, copy out |
  virtual Samples time(Method method, FieldSource source, const FrameCount& frames) = 0;
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

/// The paper's Algorithm 2 in straightforward C++, the field in memory, on the threads that oneTBB may use. Voxels that
/// no tetrahedron contains keep what `output` holds.
///
/// @param volume  spacing 1, origin 0
/// @param field   a vertex every `cell_size` voxels of the volume
/// @param output  as many voxels as the volume
void run_paper_loop(const Volume<std::int16_t>& volume, const VertexField& field, std::int64_t cell_size,
                    std::int16_t* output);

/// Facts of a device and the software that drives it.
struct CudaFacts {
  std::string name, driver, runtime, compute_capability;
};
/// @throws DeviceError, NotCompiled
CudaFacts describe_cuda(int device);

}  // namespace tetwarp::bench
