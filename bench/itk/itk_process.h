// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <optional>

#include "bench/itk/itk_accuracy.h"

namespace tetwarp::bench {

/// The files of a measurement in a folder, all .mha and not compressed.
struct ItkFiles {
  std::filesystem::path folder;

  std::filesystem::path volume() const { return folder / "volume.mha"; }
  std::filesystem::path forward(const std::string& field, std::int64_t cell_size) const;
  std::filesystem::path inverse(const std::string& field, std::int64_t cell_size) const;
  std::filesystem::path streamed() const { return folder / "streamed.mha"; }
};

/// What a process is asked to do, alone.
struct ItkRequest {
  std::string method;  ///< of an ItkContender
  std::string field;
  std::int64_t cell_size = 1;
  int threads = 1;
  int divisions = 1;        ///< of a stream
  bool is_compared = true;  ///< whether the result is held against the truth afterwards
};

/// What it found.
struct ItkAnswer {
  double ms = 0, cpu_ms = 0;      ///< of Update(), all threads
  std::uint64_t input_bytes = 0;  ///< pixels that were in memory before
  std::uint64_t output_bytes = 0;
  /// Largest resident set of the process up to the end of Update(), less its resident set just before: what lies
  /// beyond the inputs, the output included.
  std::uint64_t peak_bytes = 0;
  std::optional<Deviation> deviation = {};
};

/// Runs this program again, as `tetwarp-bench itk-alone`, and waits: no thread, cache or freed memory of this process
/// comes along. Request and answer are files in the folder. @throws Error where it fails
ItkAnswer ask_alone(const ItkRequest& request, const ItkFiles& files);

/// The other side of `ask_alone`. @throws Error
ItkRequest read_request(const ItkFiles& files);
void write_answer(const ItkAnswer& answer, const ItkFiles& files);

/// The process's resident set, and its largest since `forget_peak` (or its start, where the kernel does not let it be
/// forgotten): VmRSS and VmHWM of /proc/self/status, bytes. @throws Error where there is no such file
std::uint64_t resident_bytes();
std::uint64_t peak_resident_bytes();
void forget_peak();

}  // namespace tetwarp::bench
