// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>
#include <string>

// What backend/devices.h is made of. A build without CUDA defines it in backend/not_compiled.cpp.
namespace tetwarp {

/// Whether kernels are in this build.
bool is_cuda_compiled();
/// Number of devices that this process can use; 0 without a driver.
int cuda_device_count();
/// Makes the driver do now what the first use of a device costs. Without such a device nothing happens.
void wake_cuda_device(int device);
/// Name and memory of a device: "NVIDIA H200, 150 GB".
/// @throws DeviceError without such a device
std::string describe_cuda_device(int device);
/// A cudaStream_t of a device that waits for no other work there.
/// @param goes_first  whether its kernels begin before those of streams that do not, where both wait
/// @throws DeviceError without such a device
void* create_cuda_stream(int device, bool goes_first);
/// Waits until a stream has done what was queued. @throws DeviceError
void wait_for_cuda_stream(void* stream);
/// Destroys what `create_cuda_stream` made.
void destroy_cuda_stream(void* stream);
/// Host memory that devices read and write at full speed. @throws DeviceError
void* allocate_pinned(std::size_t bytes);
/// Frees what `allocate_pinned` gave.
void free_pinned(void* memory);
/// Memory of a device. @throws DeviceError without such a device, or where there is no room
void* allocate_on_device(int device, std::size_t bytes);
/// Frees what `allocate_on_device` gave.
void free_on_device(void* memory);
/// Copies from host memory to a device's; done when it returns. @throws DeviceError
void copy_to_device(void* to, const void* from, std::size_t bytes);

}  // namespace tetwarp
