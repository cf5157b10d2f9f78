#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <vector>

#include "deform/core/fixed_point.h"
#include "deform/cpu/map_writer.h"
#include "deform/cpu/sampler.h"
#include "deform/cpu/tiles.h"
#include "deform/target_check.h"

namespace tetwarp {

namespace cpu {

namespace {

struct RowScratch {
  std::uint8_t mapped[kTile], coverage[kTile];
  glm::vec3 offset[kTile];
};

/// x0 = p + d(p), d trilinear between samples. Samples are snapped to 2^-12 voxel of output index like the vertices of
/// a forward field, so that whole shifts copy exactly whatever the spacing.
class PullResampler final : public Resampler {
 public:
  PullResampler(Geometry output, const Limits& limits) : Resampler(output), arena_(make_arena(limits)) {}

  void set_field(const PullFieldView& field, const Control& control) override {
    ready_ = false;
    require(field.grid && field.displacement, "the pull field is empty");
    field_ = field;
    require_valid(*field.grid, "pull field grid");
    grid_from_output_ = index_from_point(*field.grid) * point_from_index(output());
    output_from_mm_ = index_from_point(output()).linear;
    if (field.outside == Outside::refuse) check_reach();
    check_samples(control);
    ready_ = true;
  }

  Region source_region(const Geometry& source, Region region) const override {
    require(ready_, "source_region needs a field: call set_field first");
    region = intersection(region, whole(output()));
    if (tetwarp::is_empty(region)) return {};
    const glm::dvec3 first(region.begin), last(region.end - std::int64_t{1});
    Region samples = source_box(*field_.grid, output(), first, last);
    glm::dvec3 least(0), most(0);
    for (std::int64_t z = samples.begin.z; z < samples.end.z; ++z) {
      for (std::int64_t y = samples.begin.y; y < samples.end.y; ++y) {
        for (std::int64_t x = samples.begin.x; x < samples.end.x; ++x) {
          const glm::dvec3 shift = sample({x, y, z});
          least = glm::min(least, shift);
          most = glm::max(most, shift);
        }
      }
    }
    return source_box(source, output(), first + least, last + most);
  }

  Report resample(Region region, std::span<const Target> targets, const Maps& maps, const Control& control) override {
    require(ready_, "resample needs a field: call set_field first");
    require(!maps.jacobian.voxels && !maps.owners.voxels, "a pull field has no tetrahedra: no Jacobian or owners map");
    const std::vector<TargetSampler> samplers = make_samplers(*this, targets, region);
    const MapWriter writer(maps, output(), region);
    return for_each_tile<RowScratch>(arena_, region, control, [&](const Region& box, RowScratch& scratch) {
      Report report;
      for (std::int64_t z = box.begin.z; z < box.end.z; ++z) {
        for (std::int64_t y = box.begin.y; y < box.end.y; ++y) {
          const Row row{{box.begin.x, y, z}, static_cast<int>(box.end.x - box.begin.x), scratch.mapped, scratch.offset};
          for (int i = 0; i < row.count; ++i) {
            scratch.mapped[i] = offset_at(row.voxel + glm::i64vec3(i, 0, 0), &scratch.offset[i]);
          }
          sample_targets(row, samplers, scratch.coverage, report);
          writer.write(row, scratch.coverage, nullptr, nullptr);
        }
      }
      return report;
    });
  }

 private:
  void check_reach() const {
    for (int corner = 0; corner < 8; ++corner) {
      const glm::dvec3 at =
          glm::dvec3(corner & 1, corner >> 1 & 1, corner >> 2) * glm::dvec3(output().size - std::int64_t{1});
      glm::dvec3 index = grid_from_output_(at);
      const glm::dvec3 found = index;
      require(clamp_to_samples(&index),
              "the pull field's grid of " + to_string(field_.grid->size) +
                  " samples does not reach over the whole output grid: a corner of the output lies at (" +
                  std::to_string(found.x) + ", " + std::to_string(found.y) + ", " + std::to_string(found.z) +
                  ") of it");
    }
  }

  void check_samples(const Control& control) {
    const glm::i64vec3 size = field_.grid->size;
    arena_.execute([&] {
      tbb::parallel_for(std::int64_t{0}, size.z, [&](std::int64_t z) {
        if (control.stop.stop_requested()) throw Cancelled();
        for (std::int64_t y = 0; y < size.y; ++y) {
          for (std::int64_t x = 0; x < size.x; ++x) {
            const glm::dvec3 shift = output_from_mm_ * glm::dvec3(displacement({x, y, z}));
            const bool usable = std::abs(shift.x) < kLargestIndex && std::abs(shift.y) < kLargestIndex &&
                                std::abs(shift.z) < kLargestIndex;
            require(usable, "the pull field's displacement at (" + std::to_string(x) + ", " + std::to_string(y) + ", " +
                                std::to_string(z) + ") is not finite or longer than 262144 voxels");
          }
        }
      });
    });
  }

  const glm::vec3& displacement(const glm::i64vec3& at) const {
    const glm::i64vec3& size = field_.grid->size;
    return field_.displacement[(at.z * size.y + at.y) * size.x + at.x];
  }

  /// A sample in voxels of output index.
  glm::dvec3 sample(const glm::i64vec3& at) const {
    return glm::dvec3(snap(output_from_mm_ * glm::dvec3(displacement(at)))) * (1.0 / kStepsPerVoxel);
  }

  /// Takes an index up to 2^-12 sample outside the grid onto it. @return false if it is further out
  bool clamp_to_samples(glm::dvec3* index) const {
    constexpr double kSlack = 1.0 / kStepsPerVoxel;
    for (int axis = 0; axis < 3; ++axis) {
      const auto last = static_cast<double>(field_.grid->size[axis] - 1);
      if (!((*index)[axis] >= -kSlack && (*index)[axis] <= last + kSlack)) return false;
      (*index)[axis] = std::clamp((*index)[axis], 0.0, last);
    }
    return true;
  }

  bool offset_at(const glm::i64vec3& voxel, glm::vec3* offset) const {
    glm::dvec3 index = grid_from_output_(glm::dvec3(voxel));
    if (!clamp_to_samples(&index)) {
      *offset = glm::vec3(0);
      return field_.outside == Outside::rest;
    }
    const glm::dvec3 base = glm::floor(index), t = index - base;
    const glm::i64vec3 low(base), high = glm::min(low + std::int64_t{1}, field_.grid->size - std::int64_t{1});
    glm::dvec3 along_z[2];
    for (int z = 0; z < 2; ++z) {
      glm::dvec3 along_y[2];
      for (int y = 0; y < 2; ++y) {
        const glm::i64vec3 a(low.x, y ? high.y : low.y, z ? high.z : low.z), b(high.x, a.y, a.z);
        const glm::dvec3 first = sample(a);
        along_y[y] = first + t.x * (sample(b) - first);
      }
      along_z[z] = along_y[0] + t.y * (along_y[1] - along_y[0]);
    }
    *offset = glm::vec3(along_z[0] + t.z * (along_z[1] - along_z[0]));
    return true;
  }

  mutable tbb::task_arena arena_;
  PullFieldView field_;
  AffineMap grid_from_output_;
  glm::dmat3 output_from_mm_{1};
  bool ready_ = false;
};

}  // namespace

}  // namespace cpu

std::unique_ptr<Resampler> make_cpu_pull_resampler(Geometry output, Limits limits) {
  return std::make_unique<cpu::PullResampler>(output, limits);
}

}  // namespace tetwarp
