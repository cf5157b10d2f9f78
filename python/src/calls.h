// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <nanobind/nanobind.h>

#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>

#include "backend/backend.h"
#include "deform/resampler.h"

namespace tetwarp::python {

namespace nb = nanobind;

/// Gives the interpreter's lock (the GIL) free for a scope, in the place of nanobind's class: a thread that takes the
/// lock again once the interpreter ends would be ended by Python amid C++, which ends the process. Such a thread stays
/// here.
class WithoutGil {
 public:
  /// To be called with the lock. Never returns in another thread than the main one once the interpreter ends.
  WithoutGil();
  /// Takes the lock again.
  ~WithoutGil();
  WithoutGil(const WithoutGil&) = delete;
  WithoutGil& operator=(const WithoutGil&) = delete;

  /// Is asked to stop when the interpreter ends, which waits for the scope's end then; and may be asked by others.
  std::stop_source stop;

 private:
  std::optional<nb::gil_scoped_release> released_;
};

/// What every call of Python that may take long is given.
struct CallOptions {
  nb::object progress;        ///< None, or a callable that gets the share that is done, 0 to 1
  std::uintptr_t stream = 0;  ///< a cudaStream_t as a number; 0: the default stream
};

/// Does work without the interpreter's lock, so that other threads of Python go on.
///
/// Called from the main thread of Python, it looks for signals every 20 ms while the work is done by another thread: an
/// exception of a signal's handler, such as KeyboardInterrupt, stops the work and is raised. Work that is small is done
/// at once by the calling thread, as it is in any thread but the main one, which gets no signals. An exception of
/// `progress` stops the work too, and is raised. When the interpreter ends, calls of daemon threads are stopped
/// and never return, nor do later ones of such threads.
/// @param small  whether the work surely takes less than 20 ms
/// @throws what the work throws
void run_call(const CallOptions& options, bool small, const std::function<void(const Control&)>& work);

/// Work on fewer voxels or vertices than this surely takes less than 20 ms.
constexpr std::int64_t kSmallCall = 200'000;
/// A file of fewer voxels or vectors than this is surely written in less than 20 ms.
constexpr std::int64_t kSmallFile = 10000;

/// Locks what serves one call at a time. While another thread has it, the interpreter's lock is given free, which the
/// holder may need to end, and signals are seen in the main thread.
/// @throws the exception of a signal's handler
std::unique_lock<std::timed_mutex> locked(std::timed_mutex& mutex);

/// Whether this thread is within a call of `progress`: what is locked for the call that it belongs to would never be
/// given free.
bool is_in_progress_callable();

/// Number of threads for work: what is wished, or one in a process that was forked, whose parent's threads are gone.
int threads_of(int wished);
/// The backend that a word means in this process.
/// @throws DeviceError for "cuda" in a process that was forked, where CUDA does not work
BackendKind kind_of(const std::string& backend);
/// Whether this process was forked from one that had loaded this module.
bool is_forked();
/// Remembers the main thread, and watches forks from now on. To be called once, when the module is loaded.
void watch_process();

}  // namespace tetwarp::python
