// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>
#include <vector>

#include "bench/harness/results.h"

namespace tetwarp::bench {

/// How long one program took for one step.
struct IoTime {
  std::string step;  ///< "DICOM in, RLE"
  std::string by;    ///< "tetwarp", "ITK", "DCMTK", "DCMTK, 1 thread"
  Summary ms;
  Summary cpu_ms = {};  ///< of all threads, user and system; tells work from waiting on a busy machine
};

/// A file that two programs wrote of the same volume.
struct IoSize {
  std::string file, by;
  std::uint64_t bytes = 0;
};

/// Everything that one call of `tetwarp-bench io` found.
struct IoResults {
  IoOptions options;
  Machine machine;
  glm::i64vec3 size{0};
  std::vector<IoTime> times = {};
  std::vector<IoSize> sizes = {};
};

// Steps and programs as they are named in results.
inline constexpr char kTetwarp[] = "tetwarp", kHashed[] = "tetwarp, hashed", kItk[] = "ITK", kDcmtk[] = "DCMTK",
                      kDcmtk1[] = "DCMTK, 1 thread";
inline constexpr char kDicomIn[] = "DICOM in, ", kDicomOut[] = "DICOM out", kNiftiOut[] = ".nii.gz out",
                      kNiftiIn[] = ".nii.gz in, written by ", kJob[] = "whole job, ";
inline constexpr char kJobIn[] = "in alone", kJobField[] = "field alone", kJobDeform[] = "deform alone",
                      kJobOut[] = "out alone", kJobFree[] = "memory given back", kJobProgram[] = "tetwarp deform",
                      kJobCuda[] = "tetwarp deform, CUDA", kJobAwake[] = "CUDA, awake";

}  // namespace tetwarp::bench
