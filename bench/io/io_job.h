// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>

#include "bench/harness/turns.h"

namespace tetwarp::bench {

/// The program tetwarp beside this one; empty if there is none.
std::filesystem::path tetwarp_program();

/// Adds `tetwarp deform` of a series, DICOM to DICOM on the CPU, and each of its stages alone, in this process: in
/// (list and read), field, deform (and hash the field), out (write, flush, give the name). Where there is a GPU, the
/// program and the whole job in this process with CUDA too: the device is awake then, as it is for all cases of a batch
/// but the first.
/// @param scratch  a folder for what is written
void add_job(Turns& turns, const std::filesystem::path& series, const std::filesystem::path& scratch,
             std::int64_t cell_size, int threads);

}  // namespace tetwarp::bench
