// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <vector>

#include "deform/resampler.h"

namespace tetwarp::simulate {

/// What machines of SpringSolver whose memory is the host's have in common.
/// @tparam kSlack  how many numbers after the last of a buffer may be read and written
template <std::size_t kSlack>
class HostMachine {
 public:
  static constexpr Memory kMemory = Memory::host;
  static constexpr std::size_t kNumbersOfVector = 3;
  static constexpr int kIterations = 32;  ///< so that a request to stop is soon heard

  template <class T>
  class Buffer {
   public:
    T* reserve(std::size_t size) {
      values_.resize(std::max(values_.size(), size + kSlack));
      return values_.data();
    }
    T* data() { return values_.data(); }

   private:
    std::vector<T> values_;
  };

  struct Scope {
    ~Scope() {}  // makes holding a Scope count as a use of it
  };

  Scope scope() const { return {}; }
  void set_stream(void*) {}
  void wait() const {}
  template <class T>
  void upload(T* place, const T* host, std::size_t size) const {
    std::copy_n(host, size, place);
  }
  template <class T>
  void download(T* to, const T* from, std::size_t count) const {
    std::copy_n(from, count, to);
  }
  template <class T>
  T fetch(const T* place) const {
    return *place;
  }
};

}  // namespace tetwarp::simulate
