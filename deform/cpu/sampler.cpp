#include "deform/cpu/sampler.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <glm/common.hpp>

#include "deform/core/sample.h"

namespace tetwarp::cpu {

namespace {

constexpr int kWidestReach = 2;  // voxels from its place that an interpolation (cubic) reads

std::string describe(const Region& region) {
  const auto corner = [](const glm::i64vec3& at) {
    return "(" + std::to_string(at.x) + ", " + std::to_string(at.y) + ", " + std::to_string(at.z) + ")";
  };
  return corner(region.begin) + " to " + corner(region.end);
}

template <class View>
void check_view(const View& view, const std::string& name) {
  require(view.geometry && view.voxels, name + " is empty");
  require(view.components == 1, name + " has " + std::to_string(view.components) + " components, expected 1");
  require(contains(whole(*view.geometry), view.buffered), name + " buffers " + describe(view.buffered) +
                                                              ", which is not part of its grid of " +
                                                              to_string(view.geometry->size));
}

template <class V>
Padding<V> padding_of(const std::optional<PaddingRange>& range) {
  if (!range) return {false, V{}, V{}};
  if constexpr (std::is_floating_point_v<V>) return {true, static_cast<V>(range->low), static_cast<V>(range->high)};
  constexpr double kLowest = static_cast<double>(std::numeric_limits<V>::lowest());
  constexpr double kHighest = static_cast<double>(std::numeric_limits<V>::max());
  const double low = std::max(std::ceil(range->low), kLowest), high = std::min(std::floor(range->high), kHighest);
  if (!(low <= high)) return {false, V{}, V{}};
  return {true, static_cast<V>(low), static_cast<V>(high)};
}

template <class V, Interpolation kInterpolation>
Sample<V> sample_at(const SourceVoxels<V>& source, const Place& place, const Padding<V>& padding) {
  if constexpr (kInterpolation == Interpolation::nearest) return sample_nearest(source, place, padding);
  if constexpr (kInterpolation == Interpolation::linear) return sample_linear(source, place, padding);
  return sample_cubic(source, place, padding);
}

/// Slices with weight at a place.
template <Interpolation kInterpolation>
void grow(SliceRange& range, const Place& place, std::int64_t slices) {
  std::int64_t first = place.base.z, last = place.base.z;
  if constexpr (kInterpolation == Interpolation::nearest) {
    first = last = place.base.z + (place.fraction.z >= 0.5f);
  } else if (place.fraction.z != 0) {
    const std::int64_t more = kInterpolation == Interpolation::cubic ? 1 : 0;
    first = clamp_index(place.base.z - more, slices);
    last = clamp_index(place.base.z + 1 + more, slices);
  }
  range.first = std::min(range.first, first);
  range.last = std::max(range.last, last);
}

}  // namespace

Region source_box(const Geometry& source, const Geometry& output, const glm::dvec3& low, const glm::dvec3& high) {
  if (!(low.x <= high.x)) return {};
  const AffineMap source_from_output = index_from_point(source) * point_from_index(output);
  glm::dvec3 least(INFINITY), most(-INFINITY);
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 at(corner & 1 ? high.x : low.x, corner >> 1 & 1 ? high.y : low.y, corner >> 2 ? high.z : low.z);
    const glm::dvec3 index = source_from_output(at);
    least = glm::min(least, index);
    most = glm::max(most, index);
  }
  const glm::dvec3 last(source.size);
  least = glm::clamp(glm::floor(least) - double{kWidestReach}, glm::dvec3(0), last);
  most = glm::clamp(glm::floor(most) + double{kWidestReach + 1}, glm::dvec3(0), last);
  return {glm::i64vec3(least), glm::i64vec3(most)};
}

std::vector<TargetSampler> make_samplers(const Resampler& resampler, std::span<const Target> targets,
                                         const Region& region) {
  require(contains(whole(resampler.output()), region),
          "the region asked for is not part of the output grid of " + to_string(resampler.output().size));
  std::vector<TargetSampler> samplers;
  for (const Target& target : targets) {
    const Geometry* grid = target.source.geometry;
    const bool all = !grid || target.source.buffered == whole(*grid);
    samplers.emplace_back(target, resampler.output(), region, all ? Region{} : resampler.source_region(*grid, region));
  }
  return samplers;
}

void sample_targets(const Row& row, std::span<const TargetSampler> samplers, std::uint8_t* coverage, Report& report) {
  std::copy_n(row.mapped, row.count, coverage);
  if (samplers.empty()) {
    const auto covered = static_cast<std::uint64_t>(std::count(row.mapped, row.mapped + row.count, 1));
    report.covered += covered;
    report.uncovered += static_cast<std::uint64_t>(row.count) - covered;
    return;
  }
  samplers.front().sample(row, coverage, report);
  for (const TargetSampler& sampler : samplers.subspan(1)) {
    Report not_counted;
    sampler.sample(row, nullptr, not_counted);
  }
}

TargetSampler::TargetSampler(const Target& target, const Geometry& output, const Region& region, const Region& needed)
    : target_(target) {
  check_view(target.source, "the source");
  check_view(target.output, "the output");
  require_valid(*target.source.geometry, "source grid");
  require(*target.output.geometry == output, "the output of " + to_string(target.output.geometry->size) +
                                                 " voxels is not on the resampler's grid of " + to_string(output.size));
  require(target.output.type == target.source.type, "the output holds " + to_string(target.output.type) +
                                                        ", the source " + to_string(target.source.type) +
                                                        ": they must be the same");
  require(contains(target.output.buffered, region),
          "the output buffers " + describe(target.output.buffered) + ", the region asked for is " + describe(region));
  require(contains(target.source.buffered, needed),
          "the source buffers " + describe(target.source.buffered) + ", needed is " + describe(needed));
  require(target.sampled_slices.empty() || static_cast<std::int64_t>(target.sampled_slices.size()) == output.size.z,
          "sampled_slices has " + std::to_string(target.sampled_slices.size()) + " entries, expected one for each of " +
              std::to_string(output.size.z) + " slices");
  same_grid_ = *target.source.geometry == output;
  source_from_output_ = index_from_point(*target.source.geometry) * point_from_index(output);
  function_ = dispatch(target.source.type, [&](auto voxel) { return choose<decltype(voxel)>(target.interpolation); });
}

template <class V>
TargetSampler::Function TargetSampler::choose(Interpolation interpolation) {
  switch (interpolation) {
    case Interpolation::nearest: return &sample_row<V, Interpolation::nearest>;
    case Interpolation::linear: return &sample_row<V, Interpolation::linear>;
    case Interpolation::cubic: return &sample_row<V, Interpolation::cubic>;
  }
  throw InputError("unknown interpolation " + std::to_string(static_cast<int>(interpolation)));
}

void TargetSampler::note_slices(std::int64_t slice, const SliceRange& sampled) const {
  if (sampled.first > sampled.last) return;
  SliceRange& range = target_.sampled_slices[static_cast<std::size_t>(slice)];
  const std::atomic_ref first(range.first), last(range.last);
  for (std::int64_t seen = first.load(); sampled.first < seen && !first.compare_exchange_weak(seen, sampled.first);) {
  }
  for (std::int64_t seen = last.load(); sampled.last > seen && !last.compare_exchange_weak(seen, sampled.last);) {
  }
}

template <class V, Interpolation kInterpolation>
void TargetSampler::sample_row(const TargetSampler& self, const Row& row, std::uint8_t* coverage, Report& counts) {
  const Target& target = self.target_;
  const glm::i64vec3 held = target.source.buffered.end - target.source.buffered.begin;
  const SourceVoxels<V> source{reinterpret_cast<const V*>(target.source.voxels), target.source.geometry->size,
                               target.source.buffered.begin, glm::i64vec3(1, held.x, held.x * held.y)};
  const Padding<V> padding = padding_of<V>(target.padding);
  bool background_saturated = false;
  const V background = to_voxel<V>(static_cast<Working<V>>(target.background), &background_saturated);

  const Region& kept = target.output.buffered;
  const glm::i64vec3 at = row.voxel - kept.begin, size = kept.end - kept.begin;
  V* output = reinterpret_cast<V*>(target.output.voxels) + ((at.z * size.y + at.y) * size.x + at.x);
  SliceRange sampled;
  for (int i = 0; i < row.count; ++i) {
    const glm::i64vec3 voxel = row.voxel + glm::i64vec3(i, 0, 0);
    bool inside = false;
    Place place;
    if (row.mapped[i]) {
      place = self.same_grid_ ? place_at(voxel, row.offset[i])
                              : place_at(self.source_from_output_(glm::dvec3(voxel) + glm::dvec3(row.offset[i])));
      inside = clamp_to_grid(place, source.size);
    }
    bool saturated = inside ? false : background_saturated;
    if (inside) {
      const Sample<V> sample = sample_at<V, kInterpolation>(source, place, padding);
      output[i] = to_voxel<V>(sample.value, &saturated);
      counts.padded += sample.padded;
      if (!target.sampled_slices.empty()) grow<kInterpolation>(sampled, place, source.size.z);
    } else {
      output[i] = background;
    }
    counts.clamped += saturated;
    counts.covered += inside;
    counts.uncovered += !inside;
    if (coverage) coverage[i] = inside;
  }
  if (!target.sampled_slices.empty()) self.note_slices(row.voxel.z, sampled);
}

}  // namespace tetwarp::cpu
