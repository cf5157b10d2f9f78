// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>
#include <functional>

#include "deform/resampler.h"

namespace tetwarp {

/// Calls `body(i)` once for each i in [0, count), on at most `threads` threads (0: all that this process may use).
///
/// Progress is reported after each call. Of several exceptions the one of the lowest index is thrown, so that the same
/// input gives the same message; indices above it may be left out.
/// @throws Cancelled when `control.stop` was requested before all calls were made
void for_each_index(std::size_t count, int threads, const Control& control,
                    const std::function<void(std::size_t)>& body);

}  // namespace tetwarp
