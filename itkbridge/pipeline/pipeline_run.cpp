// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "itkbridge/pipeline/pipeline_run.h"

#include <itkMultiThreaderBase.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <sstream>
#include <thread>

namespace tetwarp {

namespace {

constexpr std::chrono::milliseconds kLookEvery{5};
constexpr float kSmallestStep = 0.01f;  ///< progress is told to observers in steps of at least this

std::string name(const itk::ProcessObject& filter) {
  std::ostringstream text;
  text << filter.GetNameOfClass() << "(" << &filter << "): ";
  return text.str();
}

/// Work in a thread of its own. If this object is destroyed before the work has ended, as by an exception, it stops the
/// work and waits for its end.
class WorkThread {
 public:
  explicit WorkThread(const std::function<void(const Control&)>& work)
      : thread_([this, &work](const std::stop_token& stop) { run(work, stop); }) {}

  /// Waits a few milliseconds. @return whether the work has ended
  bool wait() {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, kLookEvery, [&] { return ended_; });
  }
  void stop() { thread_.request_stop(); }
  double progress() const { return progress_.load(std::memory_order_relaxed); }
  /// Throws the exception that the work threw, if any.
  void finish() {
    thread_.join();
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  void run(const std::function<void(const Control&)>& work, const std::stop_token& stop) {
    try {
      work({.progress = [this](double done) { progress_.store(done, std::memory_order_relaxed); }, .stop = stop});
    } catch (...) {
      failure_ = std::current_exception();
    }
    const std::lock_guard lock(mutex_);
    ended_ = true;
    changed_.notify_one();
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  bool ended_ = false;
  std::exception_ptr failure_;
  std::atomic<double> progress_ = 0;
  std::jthread thread_;  // the last member, since it uses the others
};

[[noreturn]] void throw_aborted(const itk::ProcessObject& filter) {
  itk::ProcessAborted aborted(__FILE__, __LINE__);
  aborted.SetDescription("Object " + std::string(filter.GetNameOfClass()) + ": AbortGenerateDataOn");
  throw aborted;
}

}  // namespace

void run_for(itk::ProcessObject& filter, ProgressShare share, const std::function<void(const Control&)>& work) {
  float told = share.begin;
  const auto tell = [&](double done, float least) {
    const float progress = share.begin + (share.end - share.begin) * static_cast<float>(done);
    if (!(progress >= told + least)) return;
    told = std::min(progress, share.end);
    filter.UpdateProgress(told);
  };
  if (share.end > share.begin) filter.UpdateProgress(told);
  translate_errors(filter, [&] {
    WorkThread worker(work);
    while (!worker.wait()) {
      if (filter.GetAbortGenerateData())
        worker.stop();
      else
        tell(worker.progress(), kSmallestStep);
    }
    worker.finish();
  });
  if (filter.GetAbortGenerateData()) throw_aborted(filter);
  if (share.end > told) tell(1, 0);
}

void warn(const itk::ProcessObject& filter, const std::string& text) {
  if (itk::Object::GetGlobalWarningDisplay())
    itk::OutputWindowDisplayWarningText(("WARNING: " + name(filter) + text + "\n\n").c_str());
}

void translate_errors(const itk::ProcessObject& filter, const std::function<void()>& work) {
  try {
    work();
  } catch (const Cancelled&) {
    throw_aborted(filter);
  } catch (const Error& error) {
    throw itk::ExceptionObject(__FILE__, __LINE__, name(filter) + error.what(), "Tetwarp");
  }
}

int threads_of(const itk::ProcessObject& filter) {
  // GetMultiThreader has no const form
  const auto* threader = const_cast<itk::ProcessObject&>(filter).GetMultiThreader();
  const itk::ThreadIdType most = threader->GetMaximumNumberOfThreads();
  return static_cast<int>(std::min(most, filter.GetNumberOfWorkUnits()));
}

}  // namespace tetwarp
