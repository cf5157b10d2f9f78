// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/runtime/check.h"

namespace tetwarp::cuda_detail {

/// A mark in a stream, of the device that was current when it was made.
class Event {
 public:
  Event() { TETWARP_CUDA_TRY(cudaEventCreateWithFlags(&event_, cudaEventDisableTiming)); }
  ~Event() { cudaEventDestroy(event_); }
  Event(const Event&) = delete;
  Event& operator=(const Event&) = delete;

  cudaEvent_t get() const { return event_; }
  void record(cudaStream_t stream) { TETWARP_CUDA_TRY(cudaEventRecord(event_, stream)); }
  /// What is queued on the stream from now on waits for the mark; at once where there is none yet.
  void hold_back(cudaStream_t stream) const { TETWARP_CUDA_TRY(cudaStreamWaitEvent(stream, event_, 0)); }
  /// The calling thread waits for it.
  void wait() const { TETWARP_CUDA_TRY(cudaEventSynchronize(event_)); }

 private:
  cudaEvent_t event_ = nullptr;
};

/// A stream that does not wait for the default one.
class Stream {
 public:
  Stream() { TETWARP_CUDA_TRY(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking)); }
  ~Stream() { cudaStreamDestroy(stream_); }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  cudaStream_t get() const { return stream_; }
  void wait() const { TETWARP_CUDA_TRY(cudaStreamSynchronize(stream_)); }

 private:
  cudaStream_t stream_ = nullptr;
};

}  // namespace tetwarp::cuda_detail
