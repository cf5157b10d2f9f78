#include "deform/cpu/sampler.h"

#include <algorithm>
#include <atomic>

#include "deform/cpu/linear_row.h"
#include "deform/target_check.h"

namespace tetwarp::cpu {

namespace {

constexpr int kMostInRow = 64;  ///< voxels that are sampled together; tiles have fewer

}  // namespace

std::vector<TargetSampler> make_samplers(const Resampler& resampler, std::span<const Target> targets,
                                         const Region& region) {
  check_targets(resampler, targets, region);
  std::vector<TargetSampler> samplers;
  for (const Target& target : targets) {
    require_host(target.source.memory, "the source");
    require_host(target.output.memory, "the output");
    samplers.emplace_back(target, resampler.output());
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

TargetSampler::TargetSampler(const Target& target, const Geometry& output)
    : target_(target), relation_(relate(*target.source.geometry, output)) {
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
void TargetSampler::sample_voxels(const SamplePlan<V>& plan, const Row& row, const RowState* state, V* output,
                                  std::uint8_t* coverage, Report& counts, SliceRange& sampled) const {
  for (int i = 0; i < row.count; ++i) {
    if (state && state[i] != RowState::left) continue;
    const SampledVoxel<V> voxel =
        sample_voxel<V, kInterpolation>(plan, row.voxel + glm::i64vec3(i, 0, 0), row.mapped[i] != 0, row.offset[i]);
    output[i] = voxel.value;
    counts.clamped += voxel.saturated;
    counts.padded += voxel.padded;
    counts.covered += voxel.inside;
    counts.uncovered += !voxel.inside;
    if (coverage) coverage[i] = voxel.inside;
    if (voxel.inside) {
      sampled.first = std::min(sampled.first, voxel.first_slice);
      sampled.last = std::max(sampled.last, voxel.last_slice);
    }
  }
}

template <class V>
bool TargetSampler::copy_row(const SamplePlan<V>& plan, const Row& row, V* output, std::uint8_t* coverage,
                             Report& counts) const {
  const glm::i64vec3& size = plan.source.size;
  const glm::i64vec3 last = row.voxel + glm::i64vec3(row.count - 1, 0, 0);
  if (!plan.relation.same_grid || plan.padding.present || last.x >= size.x || last.y >= size.y || last.z >= size.z)
    return false;
  const glm::i64vec3 in = row.voxel - plan.source.begin;
  std::copy_n(plan.source.voxels + (in.z * plan.source.stride.z + in.y * plan.source.stride.y + in.x), row.count,
              output);
  if (coverage) std::fill_n(coverage, row.count, std::uint8_t{1});
  counts.covered += static_cast<std::uint64_t>(row.count);
  return true;
}

template <class V, Interpolation kInterpolation>
void TargetSampler::sample_row(const TargetSampler& self, const Row& row, std::uint8_t* coverage, Report& counts) {
  const Target& target = self.target_;
  const SamplePlan<V> plan = plan_target(target, self.relation_, reinterpret_cast<const V*>(target.source.voxels));
  V* output = reinterpret_cast<V*>(target.output.voxels) + buffer_index(target.output, row.voxel);
  SliceRange sampled;
  if (row.at_rest && self.copy_row(plan, row, output, coverage, counts)) {
    sampled = {row.voxel.z, row.voxel.z};
  } else {
    const RowState* left = nullptr;
    RowState state[kMostInRow];
    if constexpr (kInterpolation == Interpolation::linear && kHasLinearRow<V>) {
      LinearSource source;
      if (row.count <= kMostInRow && LinearSource::make(plan, voxel_count(target.source.buffered), source)) {
        left = state;
        sampled = sample_linear_row(source, row, output, state);
        counts.covered += static_cast<std::uint64_t>(std::count(state, state + row.count, RowState::sampled));
        if (coverage) std::fill_n(coverage, row.count, std::uint8_t{1});  // of those left, written below
      }
    }
    self.sample_voxels<V, kInterpolation>(plan, row, left, output, coverage, counts, sampled);
  }
  if (!target.sampled_slices.empty()) self.note_slices(row.voxel.z, sampled);
}

}  // namespace tetwarp::cpu
