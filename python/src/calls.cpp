// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "python/src/calls.h"

#include <pthread.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "deform/errors.h"

namespace tetwarp::python {

namespace {

using namespace std::chrono_literals;

std::atomic<bool> forked = false;

thread_local bool in_progress_callable = false;
unsigned long main_thread = 0;  // of Python, as PyThread_get_thread_ident has it

bool is_main_thread() { return PyThread_get_thread_ident() == main_thread; }

/// Scopes without the interpreter's lock, so that those of daemon threads end before the interpreter does.
class Calls {
 public:
  /// To be called with the interpreter's lock. Goes no further, without it, if the interpreter ends: an error would
  /// only be printed by a thread that nobody waits for.
  void begin(std::stop_source* stop) {
    {
      const std::lock_guard lock(mutex_);
      if (!closed_ || is_main_thread()) {
        stops_.push_back(stop);
        return;
      }
    }
    const nb::gil_scoped_release released;
    stay();
  }
  void end(std::stop_source* stop) {
    const std::lock_guard lock(mutex_);
    remove(stop);
  }
  /// To be called without the interpreter's lock, when the work is done: goes no further if the interpreter ends.
  void stay_if_closed(std::stop_source* stop) {
    {
      const std::lock_guard lock(mutex_);
      if (!closed_ || is_main_thread()) return;
      remove(stop);
    }
    stay();
  }
  /// Stops all, waits until their work has ended, and lets none go on in other threads than the main one.
  void close() {
    std::unique_lock lock(mutex_);
    closed_ = true;
    for (std::stop_source* stop : stops_) stop->request_stop();
    none_.wait_for(lock, 10s, [&] { return stops_.empty(); });
  }

 private:
  [[noreturn]] static void stay() {
    for (;;) ::pause();
  }
  void remove(std::stop_source* stop) {
    std::erase(stops_, stop);
    if (stops_.empty()) none_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable none_;
  std::vector<std::stop_source*> stops_;
  bool closed_ = false;
};

/// Never destroyed, for threads may outlive this module; another one after a fork, for the parent's threads are gone.
Calls* calls = new Calls;

/// Passes progress to a callable of Python, at most 20 times a second, and keeps what it raises.
class Progress {
 public:
  Progress(const nb::object& callable, std::stop_source& stop) : callable_(callable), stop_(stop) {}

  /// Called without the interpreter's lock.
  void operator()(double share) {
    const auto now = std::chrono::steady_clock::now();
    if (error_ || (now - last_ < 50ms && share < 1)) return;
    last_ = now;
    const nb::gil_scoped_acquire lock;
    in_progress_callable = true;
    try {
      callable_(share);
    } catch (...) {
      error_ = std::current_exception();
      stop_.request_stop();
    }
    in_progress_callable = false;
  }
  const std::exception_ptr& error() const { return error_; }

 private:
  const nb::object& callable_;
  std::stop_source& stop_;
  std::chrono::steady_clock::time_point last_{};
  std::exception_ptr error_;
};

/// Work that another thread does.
class Watched {
 public:
  Watched(const std::function<void(const Control&)>& work, const Control& control)
      : thread_([this, &work, &control] {
          try {
            work(control);
          } catch (...) {
            error_ = std::current_exception();
          }
          const std::lock_guard lock(mutex_);
          done_ = true;
          changed_.notify_all();
        }) {}
  /// Whether the work ended within this time.
  bool wait_for(std::chrono::milliseconds time) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, time, [&] { return done_; });
  }
  /// Waits for the end. @throws what the work threw
  void join() {
    thread_.join();
    if (error_) std::rethrow_exception(error_);
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool done_ = false;
  std::exception_ptr error_;
  std::thread thread_;  // the last member: it uses all others
};

/// @return whether a signal's handler raised an exception, which is set then
bool signal_raised() {
  const nb::gil_scoped_acquire lock;
  return PyErr_CheckSignals() != 0;
}

}  // namespace

WithoutGil::WithoutGil() {
  calls->begin(&stop);
  released_.emplace();
}

WithoutGil::~WithoutGil() {
  calls->stay_if_closed(&stop);
  released_.reset();
  calls->end(&stop);
}

void run_call(const CallOptions& options, bool small, const std::function<void(const Control&)>& work) {
  const bool watches = !small && !is_forked() && is_main_thread();
  bool interrupted = false;
  std::exception_ptr error, error_of_progress;
  {
    WithoutGil released;
    std::stop_source& stop = released.stop;
    Progress progress(options.progress, stop);
    Control control{.stop = stop.get_token(), .stream = reinterpret_cast<void*>(options.stream)};
    if (!options.progress.is_none()) control.progress = std::ref(progress);
    try {
      if (watches) {
        Watched watched(work, control);
        while (!watched.wait_for(20ms)) {
          if (interrupted || !signal_raised()) continue;
          interrupted = true;
          stop.request_stop();
        }
        watched.join();
      } else {
        work(control);
      }
    } catch (...) {
      error = std::current_exception();
    }
    error_of_progress = progress.error();
  }
  if (interrupted) throw nb::python_error();
  if (error_of_progress) std::rethrow_exception(error_of_progress);
  if (error) std::rethrow_exception(error);
}

std::unique_lock<std::timed_mutex> locked(std::timed_mutex& mutex) {
  std::unique_lock lock(mutex, std::try_to_lock);
  if (lock) return lock;
  const bool watches = is_main_thread();
  const WithoutGil released;
  while (!lock.try_lock_for(20ms) && !released.stop.stop_requested()) {
    if (watches && signal_raised()) {
      const nb::gil_scoped_acquire raised;
      throw nb::python_error();
    }
  }
  return lock;
}

bool is_in_progress_callable() { return in_progress_callable; }

int threads_of(int wished) { return is_forked() ? 1 : wished; }

BackendKind kind_of(const std::string& backend) {
  const BackendChoice choice = backend_choice(backend);
  if (!is_forked()) return chosen(choice);
  if (choice == BackendChoice::cuda) {
    throw DeviceError(
        "CUDA does not work in a process that was forked; start processes with the method \"spawn\" "
        "(multiprocessing.set_start_method), or take backend=\"cpu\"");
  }
  return BackendKind::cpu;
}

bool is_forked() { return forked; }

void watch_process() {
  main_thread = nb::cast<unsigned long>(nb::module_::import_("threading").attr("main_thread")().attr("ident"));
  static const int once = pthread_atfork(nullptr, nullptr, [] {
    forked = true;
    calls = new Calls;
  });
  static_cast<void>(once);
  nb::module_::import_("atexit").attr("register")(nb::cpp_function([] {
    const nb::gil_scoped_release released;
    calls->close();
  }));
}

}  // namespace tetwarp::python
