#pragma once

// Private to itkbridge/: reading with a library that damaged files bring down.
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "itkbridge/transform_record.h"

namespace tetwarp {

/// What a read in a process of its own may take. What goes beyond fails, or ends that process.
struct IsolatedLimits {
  std::size_t memory_bytes = 0;  ///< that can be written, beyond what this process has
  unsigned cpu_seconds = 0;
  unsigned seconds = 0;  ///< by the clock: a read that waits for ever takes no CPU time
};

/// Runs `read` in a child process and returns what it returned, over a pipe. A crash, an endless loop or an allocation
/// beyond the limits ends the child alone. What it prints is lost; its memory, leaks included, goes with it.
///
/// The child is a copy of the thread that calls: `read` may neither wait for other threads nor use a device, and no
/// destructor of a static object nor handler of `exit` runs behind it.
/// @param library  for errors: who reads
/// @param file     for errors
/// @throws InputError with the words of the one that `read` threw, or naming library and file where the child failed;
///         Error if there can be no child
std::vector<TransformRecord> read_isolated(const std::function<std::vector<TransformRecord>()>& read,
                                           const IsolatedLimits& limits, const std::string& library,
                                           const std::string& file);

}  // namespace tetwarp
