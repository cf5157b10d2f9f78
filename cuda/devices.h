// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>
#include <string>

namespace tetwarp {

/// Devices that this process can use; 0 without a driver, and in a build without CUDA.
int cuda_device_count();
/// Lets the driver do what the first use of a device costs, a fraction of a second; nothing where there is none.
void wake_cuda_device(int device);
/// Name and memory of a device, "NVIDIA H200, 150 GB". @throws DeviceError, NotCompiled
std::string describe_cuda_device(int device);
/// A stream of a device, for `Control::stream`: what is queued on it waits for no other work there.
class DeviceStream {
 public:
  /// @throws DeviceError, NotCompiled
  explicit DeviceStream(int device);
  ~DeviceStream();
  DeviceStream(const DeviceStream&) = delete;
  DeviceStream& operator=(const DeviceStream&) = delete;
  void* get() const { return stream_; }

 private:
  void* stream_ = nullptr;
};
/// Whether CUDA is in this build.
bool has_cuda();

}  // namespace tetwarp
