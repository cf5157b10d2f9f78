#pragma once

#include <tbb/enumerable_thread_specific.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <mutex>

#include "deform/resampler.h"

namespace tetwarp::cpu {

/// Output voxels that one task works on at a time: what it keeps of each (owner, offset) fits a core's second-level
/// cache.
constexpr std::int64_t kTile = 32;

/// Calls back with the share of work that is done, one call at a time and rising.
class Progress {
 public:
  Progress(const Control& control, std::int64_t total) : control_(control), total_(total) {}

  /// @throws Cancelled where a stop was requested
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

inline tbb::task_arena make_arena(const Limits& limits) {
  require(limits.threads >= 0, "threads is " + std::to_string(limits.threads) + ", expected 0 (all) or more");
  const int most = tbb::info::default_concurrency();
  return tbb::task_arena(limits.threads > 0 ? std::min(limits.threads, most) : most);
}

/// Runs `work(tile, scratch)` for every tile of the region, each thread with a Scratch of its own, and adds up the
/// reports.
template <class Scratch, class Work>
Report for_each_tile(tbb::task_arena& arena, const Region& region, const Control& control, Work&& work) {
  Report total;
  if (is_empty(region)) return total;
  const glm::i64vec3 tiles = (region.end - region.begin + (kTile - 1)) / kTile;
  Progress progress(control, voxel_count(region));
  tbb::enumerable_thread_specific<Scratch> scratch;
  tbb::enumerable_thread_specific<Report> reports;
  arena.execute([&] {
    tbb::parallel_for(std::int64_t{0}, tiles.x * tiles.y * tiles.z, [&](std::int64_t number) {
      const glm::i64vec3 at(number % tiles.x, number / tiles.x % tiles.y, number / (tiles.x * tiles.y));
      const glm::i64vec3 begin = region.begin + at * kTile;
      const Region tile = intersection(region, {begin, begin + kTile});
      reports.local() += work(tile, scratch.local());
      progress.done(voxel_count(tile));
    });
  });
  for (const Report& report : reports) total += report;
  return total;
}

}  // namespace tetwarp::cpu
