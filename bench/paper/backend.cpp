// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/paper/backend.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cstdlib>

namespace tetwarp::bench {

namespace {

/// Sums are of integers, so that they do not depend on the order.
struct Sums {
  Tally tally;
  std::int64_t largest = 0, sum = 0, compared = 0;

  void add(const Exact& exact, std::size_t n, std::int16_t output, std::uint32_t writes) {
    const bool covered = exact.coverage[n] != 0;
    tally.writes += writes;
    tally.covered += covered;
    tally.lost += covered && writes == 0;
    tally.multiple += writes > 1;
    tally.spilled += !covered && writes > 0;
    if (!covered || writes == 0) return;
    const std::int64_t difference = std::abs(exact.output[n] - output);
    largest = std::max(largest, difference);
    sum += difference;
    ++compared;
  }
  Sums join(const Sums& other) const {
    const Tally &a = tally, &b = other.tally;
    const Tally both{.writes = a.writes + b.writes,
                     .lost = a.lost + b.lost,
                     .multiple = a.multiple + b.multiple,
                     .spilled = a.spilled + b.spilled,
                     .covered = a.covered + b.covered};
    return {both, std::max(largest, other.largest), sum + other.sum, compared + other.compared};
  }
};

}  // namespace

Tally compare(const Exact& exact, const std::vector<std::int16_t>& output, const std::vector<std::uint32_t>& writes) {
  const std::size_t voxels = exact.output.size();
  require(exact.coverage.size() == voxels && output.size() == voxels && writes.size() == voxels,
          "results of different sizes cannot be compared");
  Sums sums = tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, voxels, std::size_t{1} << 16), Sums{},
      [&](const tbb::blocked_range<std::size_t>& range, Sums part) {
        for (std::size_t n = range.begin(); n != range.end(); ++n) part.add(exact, n, output[n], writes[n]);
        return part;
      },
      [](const Sums& a, const Sums& b) { return a.join(b); });
  sums.tally.largest_difference = static_cast<double>(sums.largest);
  sums.tally.mean_difference = sums.compared ? static_cast<double>(sums.sum) / static_cast<double>(sums.compared) : 0;
  return sums.tally;
}

double differing_fraction(const Exact& exact, std::span<const std::int16_t> output) {
  const std::size_t voxels = exact.output.size();
  require(exact.coverage.size() == voxels && output.size() == voxels, "results of different sizes cannot be compared");
  std::size_t covered = 0, differing = 0;
  for (std::size_t n = 0; n < voxels; ++n) {
    if (exact.coverage[n] == 0) continue;
    ++covered;
    differing += std::abs(exact.output[n] - output[n]) > 1;
  }
  require(covered > 0, "no voxel is covered, so there is nothing to compare");
  return static_cast<double>(differing) / static_cast<double>(covered);
}

void Backend::set_volume(const Volume<std::int16_t>& volume, std::int16_t background) {
  resampler_.reset();
  exact_.reset();
  resampler_ = make_resampler(volume.geometry);
  volume_ = &volume;
  background_ = background;
  volume_changed();
}

void Backend::set_field(const Formula& formula, std::int64_t cell_size) {
  exact_.reset();
  formula_ = formula;
  cell_size_ = cell_size;
  field_.lattice = lattice_over(volume_->geometry, cell_size);
  field_.displacement.resize(static_cast<std::size_t>(voxel_count(field_.lattice)));
  fill_field();
}

const Exact& Backend::exact() {
  if (exact_) return *exact_;
  const std::size_t voxels = volume_->voxels.size();
  Volume<std::int16_t> output{volume_->geometry, std::vector<std::int16_t>(voxels)};
  Volume<std::uint8_t> coverage{volume_->geometry, std::vector<std::uint8_t>(voxels)};
  const Target target{.source = view(*volume_), .output = view(output), .background = static_cast<double>(background_)};
  resampler_->set_field(view(field_));
  resampler_->resample(whole(volume_->geometry), {&target, 1}, {.coverage = view(coverage)});
  return exact_.emplace(Exact{std::move(output.voxels), std::move(coverage.voxels)});
}

std::vector<std::uint32_t> Backend::count_writes(Method method, FieldSource source) {
  if (method != Method::tetwarp) return count_baseline_writes(method, source);
  const std::vector<std::uint8_t>& coverage = exact().coverage;
  return {coverage.begin(), coverage.end()};
}

}  // namespace tetwarp::bench
