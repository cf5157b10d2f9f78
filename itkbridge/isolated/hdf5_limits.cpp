// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "itkbridge/isolated/hdf5_limits.h"

#include <algorithm>

#include "deform/errors.h"

namespace tetwarp {

IsolatedLimits hdf5_limits(const std::filesystem::path& path) {
  std::error_code error;
  std::uint64_t bytes = std::filesystem::file_size(path, error);
  require(!error, "cannot read " + path.string() + ": " + error.message());
  constexpr std::uint64_t kMemory = std::uint64_t{64} << 20, kMost = std::uint64_t{1} << 32;
  bytes = std::min(bytes, kMost);
  return {.memory_bytes = kMemory + 3 * kDeflateAtMost * bytes,
          .cpu_seconds = static_cast<unsigned>(5 + bytes / 100'000),
          .seconds = static_cast<unsigned>(60 + bytes / 100'000)};
}

}  // namespace tetwarp
