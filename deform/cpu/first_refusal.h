// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <atomic>
#include <cstdint>
#include <exception>
#include <mutex>

#include "deform/errors.h"

namespace tetwarp::cpu {

/// Of what several threads refuse, the first in the field is told: what a thread comes upon first in time is chance,
/// and the same input shall give the same words.
class FirstRefusal {
 public:
  /// Does a part of the work, unless an earlier part was refused. Exceptions other than InputError pass through.
  /// @param begin  where the part lies in the field, in any order that parts have
  template <class Work>
  void attempt(std::int64_t begin, Work&& work) {
    if (lowest_.load() < begin) return;
    try {
      work();
    } catch (const InputError&) {
      const std::scoped_lock lock(mutex_);
      if (lowest_.load() < begin) return;
      lowest_ = begin;
      refusal_ = std::current_exception();
    }
  }
  /// To be called when all parts are done. @throws InputError of the first part that was refused
  void rethrow() const {
    if (refusal_) std::rethrow_exception(refusal_);
  }

 private:
  std::mutex mutex_;
  std::atomic<std::int64_t> lowest_{INT64_MAX};
  std::exception_ptr refusal_;
};

}  // namespace tetwarp::cpu
