#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "deform/core/sample_voxel.h"
#include "deform/target_check.h"

namespace tetwarp::cpu {

enum class RowState : std::uint8_t;  // linear_row.h

/// A run of output voxels along i and what the field says of each.
struct Row {
  glm::i64vec3 voxel;  ///< the first
  int count;
  const std::uint8_t* mapped;  ///< 1: comes from `voxel + offset`; 0: nothing maps there
  const glm::vec3* offset;     ///< undeformed minus deformed, voxels of output index
  bool at_rest = false;        ///< all are mapped, with an offset of zero
};

/// Samples one source at the undeformed places of rows. Its source may be on any grid.
class TargetSampler {
 public:
  /// @param target  checked (target_check.h); its views outlive the sampler
  TargetSampler(const Target& target, const Geometry& output);

  /// Writes a row of the output; adds to the counts. `coverage`, where not null, receives 1 or 0 a voxel.
  void sample(const Row& row, std::uint8_t* coverage, Report& counts) const { function_(*this, row, coverage, counts); }

 private:
  using Function = void (*)(const TargetSampler&, const Row&, std::uint8_t*, Report&);

  template <class V>
  static Function choose(Interpolation interpolation);
  /// One voxel after the other: all, or where `state` is not null those that are left.
  template <class V, Interpolation kInterpolation>
  void sample_voxels(const SamplePlan<V>& plan, const Row& row, const RowState* state, V* output,
                     std::uint8_t* coverage, Report& counts, SliceRange& sampled) const;
  template <class V, Interpolation kInterpolation>
  static void sample_row(const TargetSampler& self, const Row& row, std::uint8_t* coverage, Report& counts);
  /// A row that stays where it is. @return false where it must be sampled
  template <class V>
  bool copy_row(const SamplePlan<V>& plan, const Row& row, V* output, std::uint8_t* coverage, Report& counts) const;
  void note_slices(std::int64_t slice, const SliceRange& sampled) const;

  Target target_;
  SourceRelation relation_;
  Function function_;
};

/// The samplers of all targets of one call, checked.
std::vector<TargetSampler> make_samplers(const Resampler& resampler, std::span<const Target> targets,
                                         const Region& region);

/// Sends a row through all targets; the report counts the voxels of the first. `coverage` receives 1 or 0 a voxel: of
/// the first target, or of the field where there is none.
void sample_targets(const Row& row, std::span<const TargetSampler> samplers, std::uint8_t* coverage, Report& report);

}  // namespace tetwarp::cpu
