// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "backend/devices.h"

#include <cstring>

#include "cuda/devices.h"

namespace tetwarp {

bool has_cuda() { return is_cuda_compiled(); }

int device_count() { return cuda_device_count(); }

void wake_device(int device) { wake_cuda_device(device); }

std::string describe_device(int device) { return describe_cuda_device(device); }

DeviceStream::DeviceStream(int device, Turn turn) : stream_(create_cuda_stream(device, turn == Turn::first)) {}

DeviceStream::~DeviceStream() { destroy_cuda_stream(stream_); }

void DeviceStream::wait() const { wait_for_cuda_stream(stream_); }

PinnedMemory::PinnedMemory(std::size_t bytes) : memory_(allocate_pinned(bytes)), bytes_(bytes) {}

PinnedMemory::~PinnedMemory() { free_pinned(memory_); }

BackendVolume::BackendVolume(BackendKind backend, const Geometry& geometry, VoxelType type, int device)
    : geometry_(geometry), type_(type), memory_(runs_on_device(backend) ? Memory::device : Memory::host) {
  if (memory_ == Memory::device) {
    voxels_ = static_cast<std::byte*>(allocate_on_device(device, bytes()));
  } else {
    owned_ = AnyVolume(geometry, type);
    voxels_ = owned_.data();
  }
}

BackendVolume::~BackendVolume() {
  if (memory_ == Memory::device) free_on_device(voxels_);
}

void BackendVolume::take(const ConstVolumeView& from) {
  require(from.geometry->size == geometry_.size && from.buffered == whole(*from.geometry) && from.type == type_ &&
              from.components == 1 && from.memory == Memory::host,
          "a volume takes the voxels of another one of its size and type in host memory alone");
  if (memory_ == Memory::device) {
    copy_to_device(voxels_, from.voxels, bytes());
  } else {
    std::memcpy(voxels_, from.voxels, bytes());
  }
}

}  // namespace tetwarp
