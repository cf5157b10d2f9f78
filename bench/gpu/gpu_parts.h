// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// The parts of `tetwarp-bench gpu` that a device runs, each on the current one.
#include <algorithm>
#include <memory>

#include "bench/harness/options.h"
#include "bench/harness/turns.h"
#include "deform/resampler.h"

namespace tetwarp::bench {

/// Copies of a volume of this size, and of its field, from one place on the device to another: "volume_ms", "field_ms".
Samples measure_copies(const Geometry& volume, const Options& options);

/// What one field on one volume gave.
struct GpuMeasure {
  Samples times;
  double at_rest = 0;            ///< fraction of the vertices that do not move
  std::uint64_t tetrahedra = 0;  ///< of a mesh
  Report report = {};            ///< of the last frame
};

/// Runs Tetwarp and what it is compared with on one volume, field after field. In each frame every method runs once,
/// so that all see the same clock.
class GpuMethods {
 public:
  /// Methods beside Tetwarp.
  struct Others {
    bool paper = false, gascon = false;
    bool backward = false;  ///< where the inverse of the field is known
  };

  virtual ~GpuMethods() = default;

  /// Everything on the device, the field in memory: "set_field_ms", "resample_ms", "new_field_ms" (the first two),
  /// "two_volumes_ms" (resampling two at once), and of others "paper_ms", "gascon_ms", and "backward_ms" (given the
  /// inverse, float3 coordinates in memory).
  virtual GpuMeasure measure(const std::string& field, std::int64_t cell_size, Others others) = 0;
  /// The tetrahedra of the field given to Tetwarp as a mesh, which is on the host: setting it uploads it. The same
  /// without the two volumes, and "gascon_ms".
  virtual GpuMeasure measure_mesh(const std::string& field, std::int64_t cell_size) = 0;
};
/// @param volume  spacing 1, origin 0; must stay
std::unique_ptr<GpuMethods> make_gpu_methods(const Volume<std::int16_t>& volume, const Options& options);

/// Frames per second of one resampler that takes field after field.
struct FrameLoop {
  double kernels = 0;       ///< fields, source and output on the device
  double with_copies = 0;   ///< fields from pinned host memory, outputs into it, while kernels run; the source stays
  double copies_alone = 0;  ///< the same without the kernels
  double host_views = 0;    ///< source, fields and output in pageable host memory, nothing overlaps
};
/// @throws Error where frames that overlap give other voxels than frames that do not
FrameLoop measure_frame_loop(const Volume<std::int16_t>& volume, std::int64_t cell_size, const Options& options);

/// Device memory, bytes.
struct MemoryUse {
  std::uint64_t data = 0;          ///< source, field and output
  std::uint64_t host_views = 0;    ///< most that a resampler held, given all of them in host memory
  std::uint64_t device_views = 0;  ///< most that a resampler held besides them, given all of them on the device

  /// 10 % or 128 MB more than the data, whichever is more.
  std::uint64_t allowed() const { return data + std::max<std::uint64_t>(data / 10, 128'000'000); }
};
/// With a vertex on every voxel.
MemoryUse measure_memory(const Volume<std::int16_t>& volume, const std::string& field, const Options& options);

}  // namespace tetwarp::bench
