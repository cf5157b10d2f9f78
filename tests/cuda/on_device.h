// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <vector>

#include "cuda/runtime/device_buffer.h"
#include "deform/volume.h"

namespace tetwarp::test {

/// A copy of a host vector on the device.
template <class T>
class OnDevice {
 public:
  explicit OnDevice(const std::vector<T>& host) : size_(host.size()) { buffer_.upload(host.data(), size_, nullptr); }
  T* data() const { return buffer_.data(); }
  std::vector<T> download() const {
    std::vector<T> host(size_);
    buffer_.download(host.data(), size_, nullptr);
    return host;
  }

 private:
  cuda_detail::DeviceBuffer<T> buffer_;
  std::size_t size_;
};

template <class View>
View on_device(View view, const void* voxels) {
  view.voxels = static_cast<decltype(view.voxels)>(const_cast<void*>(voxels));
  view.memory = Memory::device;
  return view;
}

}  // namespace tetwarp::test
