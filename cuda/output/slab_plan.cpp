// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "cuda/output/slab_plan.h"

#include <algorithm>
#include <cstdio>

#include "deform/errors.h"

namespace tetwarp::cuda_detail {

namespace {

std::string megabytes(std::uint64_t bytes) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3f MB", static_cast<double>(bytes) * 1e-6);
  return text;
}

constexpr char kWhatToDo[] = "; allow more, or use --backend cpu, the bits are the same";

}  // namespace

SlabNeeds larger(const SlabNeeds& a, const SlabNeeds& b) {
  return {std::max(a.field, b.field), std::max(a.source, b.source), std::max(a.output, b.output)};
}

SlabPlan plan_slabs(std::int64_t begin, std::int64_t end, std::uint64_t allowed,
                    const std::function<SlabNeeds(std::int64_t begin, std::int64_t end)>& needs_of) {
  for (std::int64_t slices = end - begin;; slices = (slices + 1) / 2) {
    SlabNeeds needs;
    for (std::int64_t k = begin; k < end && needs.total() <= allowed; k += slices)
      needs = larger(needs, needs_of(k, std::min(k + slices, end)));
    if (needs.total() <= allowed) return {slices, needs};
    if (slices <= 1) return {0, needs};
  }
}

void refuse_slab(const SlabNeeds& needs, const std::string& held, std::uint64_t allowed) {
  throw DeviceMemoryError("one slice of the output needs " + megabytes(needs.total()) + " of device memory (" + held +
                          " " + megabytes(needs.field) + ", sources " + megabytes(needs.source) + ", results " +
                          megabytes(needs.output) + "), " + megabytes(allowed) + " are allowed" + kWhatToDo);
}

void refuse_field(std::uint64_t bytes, std::uint64_t allowed) {
  throw DeviceMemoryError("a pull field is held whole and needs " + megabytes(bytes) + " of device memory, " +
                          megabytes(allowed) + " are allowed" + kWhatToDo);
}

std::int64_t cells_of_piece(std::int64_t cells, std::uint64_t slice_bytes, std::uint64_t held, std::uint64_t allowed) {
  constexpr std::uint64_t kShare = 4;  // of what is allowed: sources and results will need some
  const std::uint64_t least = static_cast<std::uint64_t>(std::min<std::int64_t>(cells, 2) + 1) * slice_bytes;
  if (least > allowed) {
    throw DeviceMemoryError("two slices of cells of the field need " + megabytes(least) + " of device memory, " +
                            megabytes(allowed) + " are allowed" + kWhatToDo);
  }
  const std::uint64_t room = held >= least && held <= allowed ? held : std::max(least, allowed / kShare);
  const std::int64_t fit = static_cast<std::int64_t>(room / slice_bytes) - 1;
  return fit >= cells ? cells : fit - fit % 2;
}

}  // namespace tetwarp::cuda_detail
