// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <future>
#include <utility>

namespace tetwarp::apps {

/// Calls a function in a thread of its own. If the system gives no thread, the call is made when the result is first
/// used.
/// @return the future result; its destructor waits
template <class Call>
auto in_background(Call&& call) {
  return std::async(std::launch::async | std::launch::deferred, std::forward<Call>(call));
}

}  // namespace tetwarp::apps
