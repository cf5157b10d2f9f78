// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>
#include <cstring>
#include <span>
#include <type_traits>
#include <vector>

#include "deform/errors.h"

namespace tetwarp::simulate {

/// Puts arrays into the bytes of `Simulation::state`, one after the other.
template <class T>
void put_bytes(std::vector<std::byte>& to, std::span<const T> values) {
  static_assert(std::is_trivially_copyable_v<T>);
  const std::size_t before = to.size();
  to.resize(before + values.size_bytes());
  std::memcpy(to.data() + before, values.data(), values.size_bytes());
}

/// Takes them out again, in the same order.
class StateBytes {
 public:
  /// @throws InputError for a state of another size
  StateBytes(std::span<const std::byte> state, std::size_t expected) : left_(state) {
    require(state.size() == expected, "a state of " + std::to_string(state.size()) +
                                          " bytes, where one of this model has " + std::to_string(expected) +
                                          "; it is of another model or method");
  }
  /// The next values. @param count  how many; no more than are left
  template <class T>
  std::vector<T> take(std::size_t count) {
    std::vector<T> values(count);
    std::memcpy(values.data(), left_.data(), count * sizeof(T));
    left_ = left_.subspan(count * sizeof(T));
    return values;
  }

 private:
  std::span<const std::byte> left_;
};

}  // namespace tetwarp::simulate
