// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "bench/harness/results.h"
#include "io/dicom_series.h"

namespace tetwarp::bench {

// Steps and programs as they are named in results.
inline constexpr char kTetwarp[] = "tetwarp", kHashed[] = "tetwarp, hashed", kItk[] = "ITK", kDcmtk[] = "DCMTK",
                      kDcmtk1[] = "DCMTK, 1 thread";
inline constexpr char kDicomIn[] = "DICOM in, ", kDicomOut[] = "DICOM out", kNiftiOut[] = ".nii.gz out",
                      kNiftiIn[] = ".nii.gz in, written by ", kJob[] = "whole job, ";
inline constexpr char kJobIn[] = "in alone", kJobField[] = "field alone", kJobDeform[] = "deform alone",
                      kJobOut[] = "out alone", kJobFree[] = "memory given back", kJobProgram[] = "tetwarp deform",
                      kJobCuda[] = "tetwarp deform, CUDA", kJobAwake[] = "CUDA, awake";

/// Lists the folder and reads its one series, as `tetwarp deform` does, or without hashing its files.
/// @throws InputError
DicomVolume read_series(const std::filesystem::path& folder, int threads, FileHash hash = FileHash::made);
/// Writes a derived series with full provenance. @param sampled  source slices of each slice
/// @throws Error
void write_series(const std::filesystem::path& folder, const DicomVolume& source, const ConstVolumeView& volume,
                  const std::vector<SliceRange>& sampled, int threads);

/// `tetwarp deform` of a series, DICOM to DICOM on the CPU, where the program lies beside this one, and each of its
/// stages alone, in this process: in (list and read), field, deform (and hash the field), out (write, flush, give the
/// name). Where there is a GPU, the program and the whole job in this process with CUDA too: the device is awake then,
/// as it is for all cases of a batch but the first.
/// @param scratch  a folder for what is written
std::vector<Contender> job_contenders(const std::filesystem::path& series, const std::filesystem::path& scratch,
                                      std::int64_t cell_size, int threads);

/// A row: how long one program took for one step. CPU time tells work from waiting on a busy machine.
Json time_json(const std::string& step, const std::string& by, const Samples& times);

/// Every ratio whose runs are there, of medians.
Floors find_io_floors(const Json& document);

}  // namespace tetwarp::bench
