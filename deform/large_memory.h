// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace tetwarp {

/// Has the system provide the pages of memory that nobody has touched yet, by several threads: the page faults of one
/// thread that sets a volume to zero would take longer than to read it. A wish: what the system refuses is no error,
/// and memory of less than a few MB is left alone.
void prepare_memory(std::span<std::byte> untouched, int threads);

/// `values.resize(count)` for an empty vector, in prepared memory.
template <class T>
void resize_large(std::vector<T>& values, std::size_t count, int threads) {
  values.reserve(count);
  prepare_memory({reinterpret_cast<std::byte*>(values.data()), count * sizeof(T)}, threads);
  values.resize(count);
}

}  // namespace tetwarp
