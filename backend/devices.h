// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "backend/backend.h"
#include "deform/volume.h"

namespace tetwarp {

/// Whether this build contains CUDA.
bool has_cuda();
/// Number of CUDA devices that this process can use; 0 without a driver, and in a build without CUDA.
int device_count();
/// Makes the driver do now what the first use of a device costs, a fraction of a second, so that other work can go on
/// meanwhile. Without such a device nothing happens.
/// @param device  from 0, below `device_count()`: the number that CUDA gives it, after CUDA_VISIBLE_DEVICES
void wake_device(int device);
/// Name and memory of a device: "NVIDIA H200, 150 GB".
/// @throws DeviceError without such a device
/// @throws NotCompiled in a build without CUDA
std::string describe_device(int device);

/// A stream of a device, for `Control::stream`: a queue whose work runs in order and waits for no other work on the
/// device. It must outlive the calls that it is given to.
class DeviceStream {
 public:
  /// Which kernels a device begins with where those of several streams wait.
  enum class Turn : std::uint8_t { last, first };

  /// Makes a stream of the device with this number.
  /// @throws DeviceError without such a device
  /// @throws NotCompiled in a build without CUDA
  explicit DeviceStream(int device, Turn turn = Turn::last);
  /// Destroys the stream.
  ~DeviceStream();
  DeviceStream(const DeviceStream&) = delete;
  DeviceStream& operator=(const DeviceStream&) = delete;
  /// The stream, a cudaStream_t.
  void* get() const { return stream_; }
  /// Waits until all that was queued is done. @throws DeviceError for what failed
  void wait() const;

 private:
  void* stream_;
};

/// Host memory that devices write at full speed, for results that are read on the host.
class PinnedMemory {
 public:
  /// @throws DeviceError without a device, or where there is no room
  /// @throws NotCompiled in a build without CUDA
  explicit PinnedMemory(std::size_t bytes);
  /// Frees it.
  ~PinnedMemory();
  PinnedMemory(const PinnedMemory&) = delete;
  PinnedMemory& operator=(const PinnedMemory&) = delete;
  /// The memory.
  std::span<std::uint8_t> bytes() const { return {static_cast<std::uint8_t*>(memory_), bytes_}; }

 private:
  void* memory_;
  std::size_t bytes_;
};

/// Voxels where a backend works: in host memory for the CPU, else in memory of its device.
class BackendVolume {
 public:
  /// Uninitialised voxels of one component.
  /// @param backend   where they are used
  /// @param geometry  their grid
  /// @param type      of a voxel
  /// @param device    number of its device
  /// @throws DeviceError without such a device, or where there is no room
  BackendVolume(BackendKind backend, const Geometry& geometry, VoxelType type, int device = 0);
  /// Frees them.
  ~BackendVolume();
  BackendVolume(const BackendVolume&) = delete;
  BackendVolume& operator=(const BackendVolume&) = delete;

  /// A view for writing of the whole volume.
  VolumeView view() { return {&geometry_, whole(geometry_), type_, 1, voxels_, memory_}; }
  /// Copies voxels from a whole volume of the same size and type in host memory.
  void take(const ConstVolumeView& from);

 private:
  std::size_t bytes() const { return static_cast<std::size_t>(voxel_count(geometry_)) * size_bytes(type_); }

  Geometry geometry_;
  VoxelType type_;
  Memory memory_;
  AnyVolume owned_;  ///< voxels in host memory
  std::byte* voxels_;
};

}  // namespace tetwarp
