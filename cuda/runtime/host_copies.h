// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <condition_variable>
#include <cstdlib>
#include <deque>
#include <exception>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "cuda/runtime/device_buffer.h"
#include "cuda/runtime/host_rows.h"
#include "cuda/runtime/stream.h"

namespace tetwarp::cuda_detail {

/// Host memory that the device reads and writes at full speed, and when it is done with it.
class PinnedPiece {
 public:
  static constexpr std::size_t kBytes = std::size_t{8} << 20;

  PinnedPiece();
  ~PinnedPiece();
  PinnedPiece(const PinnedPiece&) = delete;
  PinnedPiece& operator=(const PinnedPiece&) = delete;

  std::byte* bytes() const { return bytes_.get(); }
  Event done;

 private:
  struct Free {
    void operator()(std::byte* bytes) const { std::free(bytes); }
  };
  std::unique_ptr<std::byte, Free> bytes_;
};

/// A copy from the host by the calling thread, through a small ring of pinned pieces.
class Uploads {
 public:
  /// Queued on the stream; memory that is not pinned has been read when it returns.
  void copy(std::byte* device, const std::byte* host, std::size_t bytes, cudaStream_t stream);

 private:
  std::vector<std::unique_ptr<PinnedPiece>> ring_;
  std::size_t next_ = 0;
};

/// Queues a copy of a box, which `from` (on the device) holds alone, into its place in a view of host or device memory.
void copy_box(const VolumeView& view, const Region& box, const void* from, cudaStream_t stream);

/// Copies to the host beside the kernels: on a stream of its own into pinned pieces, and from there by a thread.
class Downloads {
 public:
  explicit Downloads(int device) : device_(device) {}

  /// Where the copies are queued: it must wait for what is to be copied.
  cudaStream_t stream() const { return stream_.get(); }
  /// Queues a copy of a box; `device` holds it alone.
  void copy(const VolumeView& view, const Region& box, const std::byte* device);
  /// Waits until the host has everything. @throws DeviceError for what failed since the last call
  void finish();

 private:
  struct Task {
    PinnedPiece* piece;
    HostRows to;
    std::size_t begin, bytes;
  };

  PinnedPiece& free_piece();
  void work(const std::stop_token& stop);

  int device_;
  Stream stream_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::vector<std::unique_ptr<PinnedPiece>> pieces_;
  std::deque<PinnedPiece*> free_;
  std::deque<Task> tasks_;  ///< the first one is being worked on
  std::exception_ptr failure_;
  std::jthread worker_;  ///< from the first task on
};

}  // namespace tetwarp::cuda_detail
