// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/io/io_floors.h"

#include <initializer_list>

#include "bench/io/io_peers.h"

namespace tetwarp::bench {

namespace {

/// Cores for which a floor of compressed series is stated, and what it is there: 1.7 times on two.
constexpr double kCompressedOnTwoCores = 1.7;

std::optional<double> median(const IoResults& results, const std::string& step, const std::string& by) {
  for (const IoTime& time : results.times) {
    if (time.step == step && time.by == by) return time.ms.median;
  }
  return {};
}

std::optional<double> bytes(const IoResults& results, const std::string& file, const std::string& by) {
  for (const IoSize& size : results.sizes) {
    if (size.file == file && size.by == by) return static_cast<double>(size.bytes);
  }
  return {};
}

struct Limits {
  bool at_least;
  std::optional<double> required, aim;
};

void add(std::vector<Floor>& floors, const std::string& ratio, const std::string& where,
         const std::optional<double>& over, const std::optional<double>& under, const Limits& limits) {
  if (over && under) floors.push_back({ratio, where, *over / *under, limits.at_least, limits.required, limits.aim});
}

void add_series_in(const IoResults& results, std::vector<Floor>& floors) {
  for (const Coding coding : {Coding::none, Coding::jpeg, Coding::jpeg_ls, Coding::rle}) {
    const std::string step = kDicomIn + to_string(coding);
    const auto ours = median(results, step, kTetwarp), itk = median(results, step, kItk),
               loop = median(results, step, kDcmtk), one = median(results, step, kDcmtk1);
    if (coding == Coding::none) {
      add(floors, "ITK / tetwarp", step, itk, ours, {true, 1.5, {}});
      add(floors, "tetwarp / DCMTK", step, ours, loop, {false, 1.1, {}});
    } else {
      add(floors, "ITK / tetwarp", step, itk, ours, {true, {}, {}});
      add(floors, "DCMTK, 1 thread / tetwarp", step, one, ours,
          {true, results.machine.threads == 1 ? std::optional<double>() : kCompressedOnTwoCores, {}});
    }
  }
}

void add_nifti(const IoResults& results, std::vector<Floor>& floors) {
  add(floors, "ITK / tetwarp", kNiftiOut, median(results, kNiftiOut, kItk), median(results, kNiftiOut, kTetwarp),
      {true, 12, {}});
  add(floors, "bytes, tetwarp / ITK", kNiftiOut, bytes(results, "nii.gz", kTetwarp), bytes(results, "nii.gz", kItk),
      {false, 1.03, {}});
  for (const std::string by : {kItk, kTetwarp}) {
    const std::string step = kNiftiIn + by;
    add(floors, "ITK / tetwarp", step, median(results, step, kItk), median(results, step, kTetwarp),
        {true, by == kItk ? std::optional<double>(2) : std::nullopt, {}});
  }
}

void add_job(const IoResults& results, std::vector<Floor>& floors) {
  for (const IoTime& time : results.times) {
    const std::string& step = time.step;
    const auto sum_of = [&](std::initializer_list<const char*> stages) {
      std::optional<double> sum = 0;
      for (const char* stage : stages) {
        const auto ms = median(results, step, stage);
        sum = sum && ms ? std::optional(*sum + *ms) : std::nullopt;
      }
      return sum;
    };
    if (time.by == kJobProgram) {
      add(floors, "program / sum of its stages", step, time.ms.median,
          sum_of({kJobIn, kJobField, kJobDeform, kJobOut, kJobFree}), {false, 1.05, {}});
    } else if (time.by == kJobCuda) {
      add(floors, "program with CUDA / in and out", step, time.ms.median, sum_of({kJobIn, kJobOut}), {false, 1.3, {}});
    } else if (time.by == kJobAwake) {
      add(floors, "job with CUDA awake / in and out", step, time.ms.median, sum_of({kJobIn, kJobOut}),
          {false, 1.3, {}});
    }
  }
}

}  // namespace

std::vector<Floor> find_floors(const IoResults& results) {
  std::vector<Floor> floors;
  add_series_in(results, floors);
  add(floors, "ITK / tetwarp", kDicomOut, median(results, kDicomOut, kItk), median(results, kDicomOut, kTetwarp),
      {true, 1, 2});
  add_nifti(results, floors);
  add_job(results, floors);
  return floors;
}

}  // namespace tetwarp::bench
