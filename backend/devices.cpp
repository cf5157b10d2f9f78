// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "backend/devices.h"

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

}  // namespace tetwarp
