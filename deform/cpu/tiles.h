// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <tbb/enumerable_thread_specific.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <utility>
#include <vector>

#include "deform/cpu/arena.h"
#include "deform/resampler.h"

namespace tetwarp::cpu {

/// Side, in voxels, of the tile on which one task works at a time. What a task keeps of each voxel (owner, offset) fits
/// the second-level cache of a core.
constexpr std::int64_t kTile = 32;

/// Calls `Control::progress` with the share of work that is done: one call at a time, with rising shares, from
/// whichever thread has done some.
class WorkProgress {
 public:
  /// @param total  amount of work, in any unit
  WorkProgress(const Control& control, std::int64_t total) : control_(control), total_(total) {}

  /// Adds an amount of work that is done. @throws Cancelled if a stop was requested
  void done(std::int64_t amount) {
    if (control_.stop.stop_requested()) throw Cancelled();
    if (!control_.progress) return;
    const std::scoped_lock lock(mutex_);
    done_ += amount;
    control_.progress(total_ == 0 ? 1.0 : static_cast<double>(done_) / static_cast<double>(total_));
  }

 private:
  const Control& control_;
  std::int64_t total_, done_ = 0;
  std::mutex mutex_;
};

/// Calls `finished` for each layer of tiles (all tiles with the same range of k) when its last row of tiles is
/// done. Layers may finish in any order.
class FinishedLayers {
 public:
  FinishedLayers(const PartSink& finished, const Region& region, const glm::i64vec3& tiles)
      : finished_(finished), region_(region), rows_left_(static_cast<std::size_t>(tiles.z)) {
    for (std::atomic<std::int64_t>& rows : rows_left_) rows = tiles.y;
  }

  /// Takes note of a row of tiles that is done. Several threads may call it at a time.
  void row_done(std::int64_t layer) {
    if (!finished_ || --rows_left_[static_cast<std::size_t>(layer)] != 0) return;
    Region slices = region_;
    slices.begin.z += layer * kTile;
    slices.end.z = std::min(slices.begin.z + kTile, region_.end.z);
    finished_(slices);
  }

 private:
  const PartSink& finished_;
  Region region_;
  std::vector<std::atomic<std::int64_t>> rows_left_;
};

/// Runs `work(box, scratch)` for all tiles of the region, each thread with a Scratch of its own, and adds up the
/// reports. Rows of tiles are begun in rising order of k, so that slices are finished early.
///
/// @param finished  gets layers of tiles that are done
/// @param at_once   whether a row of tiles along i is one piece of work: then the box is the row
template <class Scratch, class AtOnce, class Work>
Report for_each_tile(Arena& arena, const Region& region, const Control& control, const PartSink& finished,
                     AtOnce&& at_once, Work&& work) {
  Report total;
  if (is_empty(region)) return total;
  const glm::i64vec3 tiles = (region.end - region.begin + (kTile - 1)) / kTile;
  WorkProgress progress(control, voxel_count(region));
  FinishedLayers layers(finished, region, tiles);
  tbb::enumerable_thread_specific<Scratch> scratch;
  tbb::enumerable_thread_specific<Report> reports;
  const auto run = [&](const Region& box) {
    reports.local() += work(box, scratch.local());
    progress.done(voxel_count(box));
  };
  const auto run_row = [&](const glm::i64vec3& begin) {
    const Region row = intersection(region, {begin, begin + glm::i64vec3(tiles.x, 1, 1) * kTile});
    if (at_once(row)) return run(row);
    tbb::parallel_for(std::int64_t{0}, tiles.x, [&](std::int64_t n) {
      const glm::i64vec3 first = begin + glm::i64vec3(n * kTile, 0, 0);
      run(intersection(row, {first, first + kTile}));
    });
  };
  std::atomic<std::int64_t> next = 0;
  arena.execute([&] {
    tbb::parallel_for(std::int64_t{0}, tiles.y * tiles.z, [&](std::int64_t) {
      const std::int64_t number = next++;
      run_row(region.begin + glm::i64vec3(0, number % tiles.y, number / tiles.y) * kTile);
      layers.row_done(number / tiles.y);
    });
  });
  for (const Report& report : reports) total += report;
  return total;
}

/// Runs `work(box, scratch)` for all tiles of the region, each tile a piece of work, and adds up the reports.
template <class Scratch, class Work>
Report for_each_tile(Arena& arena, const Region& region, const Control& control, const PartSink& finished,
                     Work&& work) {
  const auto never = [](const Region&) { return false; };
  return for_each_tile<Scratch>(arena, region, control, finished, never, std::forward<Work>(work));
}

}  // namespace tetwarp::cpu
