// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// What the parts of `gpu` share on the device. Compiled with CUDA only.
#include "bench/gpu/gpu_fields.h"
#include "bench/harness/cuda_objects.h"
#include "bench/paper/baselines.h"
#include "cuda/runtime/device_buffer.h"
#include "deform/resampler.h"

namespace tetwarp::bench {

using cuda_detail::DeviceBuffer;

/// A field on a lattice over a volume, on the device.
class FieldOnDevice {
 public:
  /// A vertex every `cell_size` voxels; done when it returns.
  void generate(const TestField& field, const Geometry& volume, std::int64_t cell_size, const Stream& stream);

  const Geometry& lattice() const { return lattice_; }
  const Grid& grid() const { return grid_; }
  glm::vec3* displacement() { return displacement_.data(); }
  std::size_t vertices() const { return static_cast<std::size_t>(voxel_count(lattice_)); }
  std::size_t size_bytes() const { return vertices() * sizeof(glm::vec3); }
  /// Fraction of the vertices that do not move.
  double at_rest() const { return at_rest_; }
  /// A copy.
  VertexField on_host() const;
  FieldView view() const {
    return {.lattice = &lattice_, .displacement = displacement_.data(), .memory = Memory::device};
  }
  MemoryField memory_field() const { return {displacement_.data(), grid_.vertices_x, grid_.vertices_y}; }

 private:
  Geometry lattice_;
  Grid grid_{};
  DeviceBuffer<glm::vec3> displacement_;
  DeviceBuffer<unsigned long long> moving_;
  double at_rest_ = 0;
};

/// Where each voxel of a volume comes from under `inverse` (continuous index), on the device, i fastest.
void generate_places(const TestField& inverse, const Geometry& volume, DeviceBuffer<glm::vec3>& places,
                     const Stream& stream);

/// int16 voxels of a whole volume on the device.
inline VolumeView device_view(const Geometry& volume, std::int16_t* voxels) {
  return {&volume, whole(volume), VoxelType::i16, 1, reinterpret_cast<std::byte*>(voxels), Memory::device};
}

/// Reports leave out the range of Jacobian determinants, as a frame loop would have it.
inline constexpr FieldOptions kWithoutRange{.jacobian_range = false};
inline Control on_stream(const Stream& stream) { return {.stream = stream.get()}; }

}  // namespace tetwarp::bench
