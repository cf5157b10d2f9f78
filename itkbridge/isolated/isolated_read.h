// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to itkbridge/: reads files with libraries that damaged files can bring down.
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <stop_token>
#include <string>
#include <vector>

#include "itkbridge/isolated/read_record.h"

namespace tetwarp {

/// What a read in a process of its own may take. What goes beyond a limit fails, or ends that process.
struct IsolatedLimits {
  /// Bytes of memory that can be written, beyond those with which the program begins.
  std::size_t memory_bytes = 0;
  unsigned cpu_seconds = 0;
  unsigned seconds = 0;  ///< elapsed time: a read that waits for ever takes no CPU time
};

/// Lets the program tetwarp-read (read_program.h) read a file and returns what it read, which comes over a pipe. A
/// crash, an endless loop or an allocation beyond the limits ends that program alone. What it prints is lost; its
/// memory, leaks included, goes with it. It has no file of this process open, and is no copy of it: other threads may
/// do what they like, even use a device.
/// @param kind     name of the reader that tetwarp-read is to use
/// @param part     number of what is to be read, in files of several parts; the reader of the kind says which
/// @param library  name of the library that reads, for messages
/// @param stop     ends the read at once
/// @throws InputError with the words of the error that the reader threw, or naming library and file where it failed;
/// Error where there is no tetwarp-read, or none that starts; Cancelled
std::vector<ReadRecord> read_isolated(const std::string& kind, const std::filesystem::path& path, std::uint64_t part,
                                      const IsolatedLimits& limits, const std::string& library,
                                      const std::stop_token& stop = {});

}  // namespace tetwarp
