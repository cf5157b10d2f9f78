// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "cuda/runtime/host_copies.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <cstring>
#include <new>
#include <utility>

namespace tetwarp::cuda_detail {

namespace {

constexpr std::size_t kPieces = 4;                       ///< that a ring may have
constexpr std::size_t kFewBytes = std::size_t{1} << 17;  ///< up to here, the driver's own copy is as good

/// Whether the device can copy from and to it without our help.
bool is_direct(const void* host, std::size_t bytes) {
  if (bytes <= kFewBytes) return true;
  cudaPointerAttributes found{};
  TETWARP_CUDA_TRY(cudaPointerGetAttributes(&found, host));
  return found.type != cudaMemoryTypeUnregistered;
}

/// One thread does not reach the speed of the bus.
template <class Copy>
void copy_with_all_threads(std::size_t bytes, Copy&& copy) {
  constexpr std::size_t kGrain = std::size_t{1} << 19;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, bytes, kGrain),
                    [&](const auto& range) { copy(range.begin(), range.size()); });
}

}  // namespace

/// All threads touch the memory before it is pinned: cudaMallocHost takes 4 ms for these 8 MB, this half of one.
PinnedPiece::PinnedPiece() : bytes_(static_cast<std::byte*>(std::aligned_alloc(4096, kBytes))) {
  if (!bytes_) throw std::bad_alloc();
  copy_with_all_threads(kBytes, [&](std::size_t first, std::size_t count) { std::memset(bytes() + first, 0, count); });
  TETWARP_CUDA_TRY(cudaHostRegister(bytes(), kBytes, cudaHostRegisterDefault));
}

PinnedPiece::~PinnedPiece() {
  cudaEventSynchronize(done.get());
  cudaHostUnregister(bytes());
}

void Uploads::copy(std::byte* device, const std::byte* host, std::size_t bytes, cudaStream_t stream) {
  if (bytes == 0) return;
  if (is_direct(host, bytes)) {
    TETWARP_CUDA_TRY(cudaMemcpyAsync(device, host, bytes, cudaMemcpyHostToDevice, stream));
    return;
  }
  for (std::size_t begin = 0; begin < bytes; begin += PinnedPiece::kBytes, next_ = (next_ + 1) % kPieces) {
    if (next_ == ring_.size()) ring_.push_back(std::make_unique<PinnedPiece>());
    PinnedPiece& piece = *ring_[next_];
    piece.done.wait();
    const std::size_t size = std::min(PinnedPiece::kBytes, bytes - begin);
    copy_with_all_threads(size, [&](std::size_t first, std::size_t count) {
      std::memcpy(piece.bytes() + first, host + begin + first, count);
    });
    TETWARP_CUDA_TRY(cudaMemcpyAsync(device + begin, piece.bytes(), size, cudaMemcpyHostToDevice, stream));
    piece.done.record(stream);
  }
}

void copy_box(const VolumeView& view, const Region& box, const void* from, cudaStream_t stream) {
  const glm::i64vec3 held = view.buffered.end - view.buffered.begin, at = box.begin - view.buffered.begin,
                     size = box.end - box.begin;
  const std::size_t voxel = size_bytes(view.type) * static_cast<std::size_t>(view.components);
  cudaMemcpy3DParms copy{};
  const auto pitched = [&](const void* bytes, const glm::i64vec3& of) {
    const auto width = static_cast<std::size_t>(of.x);
    return make_cudaPitchedPtr(const_cast<void*>(bytes), width * voxel, width, static_cast<std::size_t>(of.y));
  };
  copy.srcPtr = pitched(from, size);
  copy.dstPtr = pitched(view.voxels, held);
  copy.dstPos = make_cudaPos(static_cast<std::size_t>(at.x) * voxel, static_cast<std::size_t>(at.y),
                             static_cast<std::size_t>(at.z));
  copy.extent = make_cudaExtent(static_cast<std::size_t>(size.x) * voxel, static_cast<std::size_t>(size.y),
                                static_cast<std::size_t>(size.z));
  copy.kind = view.memory == Memory::host ? cudaMemcpyDeviceToHost : cudaMemcpyDeviceToDevice;
  TETWARP_CUDA_TRY(cudaMemcpy3DAsync(&copy, stream));
}

void Downloads::copy(const VolumeView& view, const Region& box, const std::byte* device) {
  const HostRows to = rows_of(view, box);
  const std::size_t bytes =
      static_cast<std::size_t>(voxel_count(box)) * size_bytes(view.type) * static_cast<std::size_t>(view.components);
  if (is_direct(to.first, bytes)) return copy_box(view, box, device, stream_.get());
  if (!worker_.joinable()) worker_ = std::jthread([this](const std::stop_token& stop) { work(stop); });
  for (std::size_t begin = 0; begin < bytes; begin += PinnedPiece::kBytes) {
    const std::size_t size = std::min(PinnedPiece::kBytes, bytes - begin);
    PinnedPiece& piece = free_piece();
    TETWARP_CUDA_TRY(cudaMemcpyAsync(piece.bytes(), device + begin, size, cudaMemcpyDeviceToHost, stream_.get()));
    piece.done.record(stream_.get());
    const std::scoped_lock lock(mutex_);
    free_.pop_front();
    tasks_.push_back({&piece, to, begin, size});
    changed_.notify_all();
  }
}

/// A piece that nobody uses, the first one of `free_`; waits for one.
PinnedPiece& Downloads::free_piece() {
  std::unique_lock lock(mutex_);
  if (free_.empty() && pieces_.size() < kPieces) {
    pieces_.push_back(std::make_unique<PinnedPiece>());
    free_.push_back(pieces_.back().get());
  }
  changed_.wait(lock, [&] { return !free_.empty(); });
  return *free_.front();
}

void Downloads::finish() {
  {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return tasks_.empty(); });
  }
  stream_.wait();
  const std::scoped_lock lock(mutex_);
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
}

void Downloads::work(const std::stop_token& stop) {
  cudaSetDevice(device_);
  std::unique_lock lock(mutex_);
  while (changed_.wait(lock, stop, [&] { return !tasks_.empty(); })) {
    const Task task = tasks_.front();
    lock.unlock();
    std::exception_ptr failure;
    try {
      task.piece->done.wait();
      copy_with_all_threads(task.bytes, [&](std::size_t first, std::size_t count) {
        task.to.write(task.begin + first, task.piece->bytes() + first, count);
      });
    } catch (...) {
      failure = std::current_exception();
    }
    lock.lock();
    if (failure && !failure_) failure_ = failure;
    tasks_.pop_front();
    free_.push_back(task.piece);
    changed_.notify_all();
  }
}

}  // namespace tetwarp::cuda_detail
