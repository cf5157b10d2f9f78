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
    if constexpr (kVectors) has_source_ = LinearSource::make(plan_, voxel_count(target.source.buffered), source_);
  }

  void sample(const Row& row, LinearPlaces& places, std::uint8_t* coverage, Report& counts) const override {
    V* output = output_at(row.voxel);
    SliceRange sampled;
    if (components() > 1) {
      sample_vectors(row, output, coverage, counts, sampled);
    } else if (has_source_ && row.count <= kMostInRow) {
      places.find(source_.layout, row);
      sampled = places.slices;
      // Voxels that vectors left are written below.
      if (coverage) std::fill_n(coverage, row.count, std::uint8_t{1});
      if (kInterpolation == Interpolation::vote)
        sample_vote_row(source_, places, output);
      else
        sample_linear_row(source_, places, output);
      sample_left(row, places, output, coverage, counts, sampled);
    } else {
      for (int i = 0; i < row.count; ++i) sample_one(row, i, output, coverage, counts, sampled);
    }
    if (!target_.sampled_slices.empty()) note_slices(row.voxel.z, sampled);
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
      if (!target_.sampled_slices.empty()) note_slices(z, {z, z});
    }
    counts.covered += static_cast<std::uint64_t>(voxel_count(box));
  }

 private:
  static constexpr bool kVectors =
      (kInterpolation == Interpolation::linear || kInterpolation == Interpolation::vote) && kHasLinearRow<V>;

  int components() const { return target_.source.components; }
  V* output_at(const glm::i64vec3& voxel) const {
    return reinterpret_cast<V*>(target_.output.voxels) +
           buffer_index(target_.output, voxel) * static_cast<std::size_t>(components());
  }

  /// Calls `work` with the offset of voxel i of a row, in the type that its field has.
  template <class Work>
  static auto with_offset(const Row& row, int i, Work&& work) {
    return row.fixed ? work(row.fixed->at(i)) : work(row.offset[i]);
  }

  /// Samples the voxels that vectors did not.
  void sample_left(const Row& row, const LinearPlaces& places, V* output, std::uint8_t* coverage, Report& counts,
                   SliceRange& sampled) const {
    counts.covered += static_cast<std::uint64_t>(places.sampled);
    if (places.sampled == row.count) return;
    for (int i = 0; i < row.count; ++i)
      if (places.state[i] == RowState::left) sample_one(row, i, output, coverage, counts, sampled);
  }

  void sample_one(const Row& row, int i, V* output, std::uint8_t* coverage, Report& counts, SliceRange& sampled) const {
    const SampledVoxel<V> voxel = with_offset(row, i, [&](const auto& offset) {
      return sample_voxel<V, kInterpolation>(plan_, row.voxel + glm::i64vec3(i, 0, 0), row.mapped[i] != 0, offset);
    });
    output[i] = voxel.value;
    note_voxel(voxel, coverage ? coverage + i : nullptr, counts, sampled);
  }

  /// Samples all voxels of a row whose voxels have several values each.
  void sample_vectors(const Row& row, V* output, std::uint8_t* coverage, Report& counts, SliceRange& sampled) const {
    for (int i = 0; i < row.count; ++i, output += components()) {
      const SampledVoxel<V> voxel = with_offset(row, i, [&](const auto& offset) {
        return sample_components<V, kInterpolation>(plan_, components(), row.voxel + glm::i64vec3(i, 0, 0),
                                                    row.mapped[i] != 0, offset, output);
      });
      note_voxel(voxel, coverage ? coverage + i : nullptr, counts, sampled);
    }
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

}  // namespace tetwarp::cpu
