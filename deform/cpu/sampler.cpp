// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/cpu/sampler.h"

#include <algorithm>
#include <atomic>

#include "deform/cpu/rows/linear_row.h"
#include "deform/target_check.h"

namespace tetwarp::cpu {

namespace {

/// A TargetSampler for one type of voxel and one interpolation.
template <class V, Interpolation kInterpolation>
class TypedSampler final : public TargetSampler {
 public:
  /// @param target  passed check_targets (target_check.h)
  TypedSampler(const Target& target, const Geometry& output)
      : target_(target),
        slices_(uneven_slices(*target.source.geometry)),
        plan_(plan_target(target, relate(*target.source.geometry, output, slices_.empty() ? nullptr : slices_.data()),
                          reinterpret_cast<const V*>(target.source.voxels))) {
    if constexpr (kVectors) {
      has_source_ = components() == 1 && LinearSource::make(plan_, voxel_count(target.source.buffered), source_);
    }
  }

  void sample(const Row& row, LinearPlaces& places, std::uint8_t* coverage, Report& counts) const override {
    V* output = output_at(row.voxel);
    SliceRange sampled;
    const auto to = [&](int i) { return output + i * components(); };
    const auto slices = [&](int) -> SliceRange& { return sampled; };
    if (has_source_ && row.count <= kMostTogether) {
      places.find(source_.layout, row);
      // Voxels that vectors left are written below.
      if (coverage) std::fill_n(coverage, row.count, std::uint8_t{1});
      sample_places(places, output);
      if (kInterpolation != Interpolation::nearest)
        sampled = places.slices;
      else if (wants_slices())
        note_places(row, places, slices);
      sample_left(row, places, to, coverage, counts, slices);
    } else {
      for (int i = 0; i < row.count; ++i) sample_one(row, i, to(i), coverage, counts, sampled);
    }
    if (wants_slices()) note_slices(row.voxel.z, sampled);
  }

  void sample(const VoxelList& list, LinearPlaces& places, std::uint8_t* coverage, Report& counts,
              TileSlices* slices) const override {
    V* output = output_at(list.first);
    const glm::i64vec3 size = target_.output.buffered.end - target_.output.buffered.begin;
    const std::int64_t row = size.x * components(), slice = size.x * size.y * components();
    const auto to = [&](int i) {
      const glm::i64vec3 in(list.in_tile_at(i));
      return output + (in.z * slice + in.y * row + in.x * components());
    };
    SliceRange not_noted;
    const auto slices_of = [&](int i) -> SliceRange& {
      return slices ? (*slices)[static_cast<std::size_t>(list.in_tile_at(i).z)] : not_noted;
    };
    if (coverage) std::fill_n(coverage, list.count, std::uint8_t{1});
    if (!has_source_) {
      for (int i = 0; i < list.count; ++i) sample_one(list, i, to(i), coverage, counts, slices_of(i));
      return;
    }
    places.find(source_.layout, list);
    V values[kRoomTogether];
    sample_places(places, values);
    const int written = places.sampled == 0 ? 0 : list.count;  // those that vectors left are written below
    if (slice <= INT32_MAX / kTile) {
      std::int32_t steps[kRoomTogether];
      find_steps(list, static_cast<std::int32_t>(row), static_cast<std::int32_t>(slice), steps);
      for (int i = 0; i < written; ++i) output[steps[i]] = values[i];
    } else {
      for (int i = 0; i < written; ++i) *to(i) = values[i];
    }
    if (slices) note_places(list, places, slices_of);
    sample_left(list, places, to, coverage, counts, slices_of);
  }

  void clear(const glm::i64vec3& voxel, int count, Report& counts) const override {
    std::fill_n(output_at(voxel), count * components(), plan_.background);
    counts.uncovered += static_cast<std::uint64_t>(count);
    if (plan_.background_saturated) counts.clamped += static_cast<std::uint64_t>(count);
  }

  bool wants_slices() const override { return !target_.sampled_slices.empty(); }
  void note(std::int64_t begin, const TileSlices& slices) const override {
    for (std::size_t z = 0; z < slices.size(); ++z) note_slices(begin + static_cast<std::int64_t>(z), slices[z]);
  }

  bool can_copy(const Region& box) const override {
    const Region source{glm::i64vec3(0), plan_.source.size};
    return plan_.relation.same_grid && !plan_.padding.present && contains(source, box);
  }

  void copy(const Region& box, Report& counts) const override {
    const glm::i64vec3& stride = plan_.source.stride;
    const auto width = (box.end.x - box.begin.x) * components();
    for (std::int64_t z = box.begin.z; z < box.end.z; ++z) {
      const glm::i64vec3 first(box.begin.x, box.begin.y, z), in = first - plan_.source.begin;
      const V* from = plan_.source.voxels + (in.z * stride.z + in.y * stride.y + in.x * stride.x);
      V* to = output_at(first);
      const std::int64_t step = (target_.output.buffered.end.x - target_.output.buffered.begin.x) * components();
      for (std::int64_t y = box.begin.y; y < box.end.y; ++y, from += stride.y, to += step) std::copy_n(from, width, to);
      if (wants_slices()) note_slices(z, {z, z});
    }
    counts.covered += static_cast<std::uint64_t>(voxel_count(box));
  }

 private:
  static constexpr bool kVectors =
      kInterpolation == Interpolation::nearest ||
      ((kInterpolation == Interpolation::linear || kInterpolation == Interpolation::vote) && kHasLinearRow<V>);

  int components() const { return target_.source.components; }
  V* output_at(const glm::i64vec3& voxel) const {
    return reinterpret_cast<V*>(target_.output.voxels) +
           buffer_index(target_.output, voxel) * static_cast<std::size_t>(components());
  }

  /// Samples the voxels that vectors can.
  void sample_places(const LinearPlaces& places, V* values) const {
    if constexpr (kInterpolation == Interpolation::nearest) {
      sample_nearest_row(source_.layout, plan_.source.voxels, places, values);
    } else if (kInterpolation == Interpolation::vote) {
      sample_vote_row(source_, places, values);
    } else {
      sample_linear_row(source_, places, values);
    }
  }

  /// Adds the slices of the source from which those were sampled. @param slices  the range of the i-th voxel
  template <class Voxels, class Slices>
  static void note_places(const Voxels& voxels, const LinearPlaces& places, const Slices& slices) {
    for (int i = 0; i < voxels.count; ++i) {
      if (places.state[i] != RowState::sampled) continue;
      SliceRange& of = slices(i);
      std::int64_t first = 0, last = 0;
      slices_at<kInterpolation>({{0, 0, places.slice[i]}, {0, 0, places.z[i]}}, INT64_MAX, first, last);
      of.first = std::min(of.first, first);
      of.last = std::max(of.last, last);
    }
  }

  /// Samples the voxels that vectors did not. @param to, slices  the output and the range of slices of the i-th voxel
  template <class Voxels, class To, class Slices>
  void sample_left(const Voxels& voxels, const LinearPlaces& places, const To& to, std::uint8_t* coverage,
                   Report& counts, const Slices& slices) const {
    counts.covered += static_cast<std::uint64_t>(places.sampled);
    if (places.sampled == voxels.count) return;
    for (int i = 0; i < voxels.count; ++i)
      if (places.state[i] == RowState::left) sample_one(voxels, i, to(i), coverage, counts, slices(i));
  }

  /// Samples the i-th voxel, whatever it is.
  template <class Voxels>
  void sample_one(const Voxels& voxels, int i, V* output, std::uint8_t* coverage, Report& counts,
                  SliceRange& sampled) const {
    const auto at = [&](const auto& offset) {
      const glm::i64vec3 voxel = voxels.voxel_at(i);
      if (components() > 1) {
        return sample_components<V, kInterpolation>(plan_, components(), voxel, voxels.is_mapped(i), offset, output);
      }
      const SampledVoxel<V> found = sample_voxel<V, kInterpolation>(plan_, voxel, voxels.is_mapped(i), offset);
      *output = found.value;
      return found;
    };
    const SampledVoxel<V> voxel = voxels.fixed ? at(voxels.fixed->at(i)) : at(voxels.offset[i]);
    note_voxel(voxel, coverage ? coverage + i : nullptr, counts, sampled);
  }

  static void note_voxel(const SampledVoxel<V>& voxel, std::uint8_t* coverage, Report& counts, SliceRange& sampled) {
    counts.clamped += voxel.saturated;
    counts.padded += voxel.padded;
    counts.covered += voxel.inside;
    counts.uncovered += !voxel.inside;
    if (coverage) *coverage = voxel.inside;
    if (voxel.inside) {
      sampled.first = std::min(sampled.first, voxel.first_slice);
      sampled.last = std::max(sampled.last, voxel.last_slice);
    }
  }

  void note_slices(std::int64_t slice, const SliceRange& sampled) const {
    if (sampled.first > sampled.last) return;
    SliceRange& range = target_.sampled_slices[static_cast<std::size_t>(slice)];
    const std::atomic_ref first(range.first), last(range.last);
    for (std::int64_t seen = first.load(); sampled.first < seen && !first.compare_exchange_weak(seen, sampled.first);) {
    }
    for (std::int64_t seen = last.load(); sampled.last > seen && !last.compare_exchange_weak(seen, sampled.last);) {
    }
  }

  Target target_;
  std::vector<double> slices_;  ///< positions of the slices of an uneven source
  SamplePlan<V> plan_;
  LinearSource source_{};  ///< the source in the form that vector code samples
  bool has_source_ = false;
};

template <class V>
std::unique_ptr<const TargetSampler> make_sampler(const Target& target, const Geometry& output) {
  switch (target.interpolation) {
    case Interpolation::nearest: return std::make_unique<TypedSampler<V, Interpolation::nearest>>(target, output);
    case Interpolation::linear: return std::make_unique<TypedSampler<V, Interpolation::linear>>(target, output);
    case Interpolation::cubic: return std::make_unique<TypedSampler<V, Interpolation::cubic>>(target, output);
    case Interpolation::vote: return std::make_unique<TypedSampler<V, Interpolation::vote>>(target, output);
  }
  throw InputError("unknown interpolation " + std::to_string(static_cast<int>(target.interpolation)));
}

}  // namespace

TargetSamplers make_samplers(const Resampler& resampler, std::span<const Target> targets, const Region& region) {
  check_targets(resampler, targets, region);
  TargetSamplers samplers;
  for (const Target& target : targets) {
    require_host(target.source.memory, "the source");
    require_host(target.output.memory, "the output");
    samplers.push_back(dispatch(target.source.type,
                                [&](auto voxel) { return make_sampler<decltype(voxel)>(target, resampler.output()); }));
  }
  return samplers;
}

void sample_targets(const Row& row, const TargetSamplers& samplers, std::uint8_t* coverage, Report& report) {
  std::copy_n(row.mapped, row.count, coverage);
  if (samplers.empty()) {
    const auto covered = static_cast<std::uint64_t>(std::count(row.mapped, row.mapped + row.count, 1));
    report.covered += covered;
    report.uncovered += static_cast<std::uint64_t>(row.count) - covered;
    return;
  }
  LinearPlaces places;
  samplers.front()->sample(row, places, coverage, report);
  for (std::size_t n = 1; n < samplers.size(); ++n) {
    Report not_counted;
    samplers[n]->sample(row, places, nullptr, not_counted);
  }
}

void clear_targets(const glm::i64vec3& voxel, int count, const TargetSamplers& samplers, Report& report) {
  if (samplers.empty()) report.uncovered += static_cast<std::uint64_t>(count);
  for (std::size_t n = 0; n < samplers.size(); ++n) {
    Report not_counted;
    samplers[n]->clear(voxel, count, n == 0 ? report : not_counted);
  }
}

void sample_targets(const VoxelList& list, const TargetSamplers& samplers, std::uint8_t* coverage, Report& report,
                    TileSlices* slices) {
  if (samplers.empty()) {
    std::fill_n(coverage, list.count, std::uint8_t{1});
    report.covered += static_cast<std::uint64_t>(list.count);
    return;
  }
  LinearPlaces places;
  for (std::size_t n = 0; n < samplers.size(); ++n) {
    Report not_counted;
    samplers[n]->sample(list, places, n == 0 ? coverage : nullptr, n == 0 ? report : not_counted,
                        samplers[n]->wants_slices() ? slices + n : nullptr);
  }
}

}  // namespace tetwarp::cpu
