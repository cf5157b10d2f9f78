// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <future>
#include <utility>

namespace tetwarp::apps {

/// Calls it in a thread of its own; where the system gives none, as soon as the result is asked for.
/// @return its result, whose destructor waits
template <class Call>
auto beside(Call&& call) {
  return std::async(std::launch::async | std::launch::deferred, std::forward<Call>(call));
}

}  // namespace tetwarp::apps
