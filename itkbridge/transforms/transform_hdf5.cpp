// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>

#include "deform/errors.h"
#include "itkbridge/transforms/hdf5_reader.h"
#include "itkbridge/transforms/isolated_read.h"

namespace tetwarp {
namespace {

/// Limits for reading a file of `bytes` bytes. A damaged file can lead HDF5 1.10.8 out of its memory, round in circles
/// and into allocations of any size. An undamaged file takes its values as double, stored as float perhaps, twice while
/// a chunk is inflated.
IsolatedLimits limits_for(std::uint64_t bytes) {
  constexpr std::uint64_t kMemory = std::uint64_t{64} << 20, kMost = std::uint64_t{1} << 32;
  bytes = std::min(bytes, kMost);
  return {.memory_bytes = kMemory + 3 * kDeflateAtMost * bytes,
          .cpu_seconds = static_cast<unsigned>(5 + bytes / 100'000),
          .seconds = static_cast<unsigned>(60 + bytes / 100'000)};
}

}  // namespace

std::vector<TransformRecord> read_transform_hdf5(const std::filesystem::path& path, const std::stop_token& stop) {
  std::error_code error;
  const std::uint64_t bytes = std::filesystem::file_size(path, error);
  require(!error, "cannot read " + path.string() + ": " + error.message());
  return read_isolated("transform-hdf5", path, limits_for(bytes), "HDF5", stop);
}

}  // namespace tetwarp
