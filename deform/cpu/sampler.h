#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "deform/resampler.h"

namespace tetwarp::cpu {

/// A run of output voxels along i and what the field says of each.
struct Row {
  glm::i64vec3 voxel;  ///< the first
  int count;
  const std::uint8_t* mapped;  ///< 1: comes from `voxel + offset`; 0: nothing maps there
  const glm::vec3* offset;     ///< undeformed minus deformed, voxels of output index
};

/// Samples one source at the undeformed places of rows. Its source may be on any grid.
class TargetSampler {
 public:
  /// @throws InputError for views that do not fit the output geometry, the region, or each other
  TargetSampler(const Target& target, const Geometry& output, const Region& region, const Region& needed);

  /// Writes a row of the output; adds to the counts. `coverage`, where not null, receives 1 or 0 a voxel.
  void sample(const Row& row, std::uint8_t* coverage, Report& counts) const { function_(*this, row, coverage, counts); }

 private:
  using Function = void (*)(const TargetSampler&, const Row&, std::uint8_t*, Report&);

  template <class V>
  static Function choose(Interpolation interpolation);
  template <class V, Interpolation kInterpolation>
  static void sample_row(const TargetSampler& self, const Row& row, std::uint8_t* coverage, Report& counts);
  void note_slices(std::int64_t slice, const SliceRange& sampled) const;

  Target target_;
  bool same_grid_;
  AffineMap source_from_output_;
  Function function_;
};

/// The samplers of all targets of one call. @param resampler  tells what part of a source is needed
std::vector<TargetSampler> make_samplers(const Resampler& resampler, std::span<const Target> targets,
                                         const Region& region);

/// Sends a row through all targets; the report counts the voxels of the first. `coverage` receives 1 or 0 a voxel: of
/// the first target, or of the field where there is none.
void sample_targets(const Row& row, std::span<const TargetSampler> samplers, std::uint8_t* coverage, Report& report);

/// The part of the source grid within `reach` of a box in continuous output index, clipped to the grid.
Region source_box(const Geometry& source, const Geometry& output, const glm::dvec3& low, const glm::dvec3& high);

}  // namespace tetwarp::cpu
