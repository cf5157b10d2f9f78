// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// The parts of `measure_gpu`, each on the current device.
#include <memory>

#include "bench/gpu/gpu_results.h"
#include "deform/volume.h"

namespace tetwarp::bench {

/// Copies of a volume of this size, and of its field, from one place on the device to another.
CopyTimes measure_copies(const Geometry& volume, const GpuOptions& options);

/// Runs Tetwarp and what it is compared with on one volume, field after field. In each frame every method runs once,
/// so that all see the same clock.
class GpuMethods {
 public:
  /// Methods beside Tetwarp.
  struct Others {
    bool paper = false, gascon = false;
    bool backward = false;  ///< where the inverse of the field is known
  };

  /// @param volume  spacing 1, origin 0; must stay
  GpuMethods(const Volume<std::int16_t>& volume, const GpuOptions& options);
  ~GpuMethods();

  GpuRun measure(const std::string& field, std::int64_t cell_size, const Others& others);
  MeshRun measure_mesh(const std::string& field, std::int64_t cell_size);

 private:
  class State;
  std::unique_ptr<State> state_;
};

/// @throws Error where frames that overlap give other voxels than frames that do not
FrameLoop measure_frame_loop(const Volume<std::int16_t>& volume, std::int64_t cell_size, const GpuOptions& options);

/// With a vertex on every voxel.
MemoryUse measure_memory(const Volume<std::int16_t>& volume, const std::string& field, const GpuOptions& options);

}  // namespace tetwarp::bench
