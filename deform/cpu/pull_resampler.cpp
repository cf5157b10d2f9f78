// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <tbb/parallel_for.h>

#include <algorithm>
#include <glm/common.hpp>
#include <optional>
#include <vector>

#include "deform/cpu/first_refusal.h"
#include "deform/cpu/map_writer.h"
#include "deform/cpu/sampler.h"
#include "deform/cpu/tiles.h"
#include "deform/field_check.h"

namespace tetwarp {

namespace cpu {

namespace {

/// The sample on which a row's first voxel lies, if each voxel of the row lies on a sample and the row runs along the
/// samples.
std::optional<glm::i64vec3> find_first_sample(const PullFrame& frame, const glm::i64vec3& first, int count) {
  const glm::dmat3& map = frame.grid_from_output.linear;
  if (map[0] != glm::dvec3(1, 0, 0) || map[1].x != 0 || map[2].x != 0) return {};
  const glm::i64vec3 along(count - 1, 0, 0);
  glm::dvec3 begin = frame.grid_from_output(glm::dvec3(first)), end = frame.grid_from_output(glm::dvec3(first + along));
  if (!frame.clamp_to_samples(begin) || !frame.clamp_to_samples(end)) return {};
  const glm::i64vec3 low(begin);
  if (glm::dvec3(low) != begin || glm::dvec3(low + along) != end) return {};
  return low;
}

/// The samples around a row of voxels that runs along the first axis of the samples, converted once for all voxels.
class RowSamples {
 public:
  /// @return false where the row runs in another direction, leaves the grid, or has its voxels as far apart as the
  /// samples are, so that there is little to share
  bool find(const PullFrame& frame, const glm::i64vec3& first, int count) {
    const glm::dvec3& step = frame.grid_from_output.linear[0];
    if (!(step.x > 0 && step.x < 1 && step.y == 0 && step.z == 0)) return false;
    glm::dvec3 begin = frame.grid_from_output(glm::dvec3(first)),
               end = frame.grid_from_output(glm::dvec3(first + glm::i64vec3(count - 1, 0, 0)));
    if (!frame.clamp_to_samples(begin) || !frame.clamp_to_samples(end)) return false;
    low_ = glm::i64vec3(begin);
    const glm::i64vec3 last = frame.size - std::int64_t{1}, high = glm::min(low_ + std::int64_t{1}, last);
    const std::int64_t width = std::min(static_cast<std::int64_t>(end.x) + 1, last.x) - low_.x + 1;
    for (int row = 0; row < 4; ++row) {
      const glm::i64vec3 from(low_.x, row & 1 ? high.y : low_.y, row & 2 ? high.z : low_.z);
      for (std::int64_t x = 0; x < width; ++x) samples_[row][x] = frame.sample(from + glm::i64vec3(x, 0, 0));
    }
    return true;
  }

  const glm::dvec3& operator()(const glm::i64vec3& at) const {
    return samples_[(at.y != low_.y) + 2 * (at.z != low_.z)][at.x - low_.x];
  }

 private:
  glm::i64vec3 low_{0};
  glm::dvec3 samples_[4][kTile + 2];
};

struct RowScratch {
  std::uint8_t mapped[kTile], coverage[kTile];
  glm::vec3 offset[kTile];
  RowSamples samples;
};

/// Deforms volumes row by row: computes where each voxel comes from, then samples there.
class RowPullResampler final : public PullResampler {
 public:
  RowPullResampler(Geometry output, const Limits& limits) : PullResampler(output), arena_(limits) {}

  void set_field(const PullFieldView& field, const Control& control) override {
    ready_ = false;
    require_host(field.memory, "the pull field");
    frame_ = make_pull_frame(output(), field);
    grid_ = *field.grid;
    check_samples(control);
    ready_ = true;
  }

  Region source_region(const Geometry& source, Region region) const override {
    require(ready_, "source_region needs a field: call set_field first");
    return pull_source_region(frame_, grid_, output(), source, region);
  }

  Report resample(Region region, std::span<const Target> targets, const Maps& maps, const Control& control,
                  const PartSink& finished) override {
    require(ready_, "resample needs a field: call set_field first");
    require(!maps.jacobian.voxels && !maps.owners.voxels && !maps.tetrahedra.voxels,
            "a pull field has no tetrahedra: no map of Jacobian determinants, owners or tetrahedra");
    const TargetSamplers samplers = make_samplers(*this, targets, region);
    const MapWriter writer(maps, output(), region);
    return for_each_tile<RowScratch>(arena_, region, control, finished, [&](const Region& box, RowScratch& scratch) {
      Report report;
      for (std::int64_t z = box.begin.z; z < box.end.z; ++z) {
        for (std::int64_t y = box.begin.y; y < box.end.y; ++y) {
          const Row row{{box.begin.x, y, z}, static_cast<int>(box.end.x - box.begin.x), scratch.mapped, scratch.offset};
          find_offsets(row, scratch);
          sample_targets(row, samplers, scratch.coverage, report);
          writer.write(row, scratch.coverage);
        }
      }
      return report;
    });
  }

 private:
  void find_offsets(const Row& row, RowScratch& scratch) const {
    if (const auto first = find_first_sample(frame_, row.voxel, row.count)) {
      for (int i = 0; i < row.count; ++i) {
        const glm::dvec3 found = frame_.sample(*first + glm::i64vec3(i, 0, 0));
        scratch.mapped[i] = !PullFrame::is_missing(found);
        scratch.offset[i] = scratch.mapped[i] ? glm::vec3(found) : glm::vec3(0);
      }
      return;
    }
    const bool shared = scratch.samples.find(frame_, row.voxel, row.count);
    for (int i = 0; i < row.count; ++i) {
      const glm::i64vec3 voxel = row.voxel + glm::i64vec3(i, 0, 0);
      glm::vec3& offset = scratch.offset[i];
      scratch.mapped[i] = shared ? frame_.offset_at(voxel, offset, scratch.samples) : frame_.offset_at(voxel, offset);
    }
  }

  void check_samples(const Control& control) {
    const glm::i64vec3 size = frame_.size;
    const auto check_slice = [&](std::int64_t z) {
      const glm::vec3* slice = frame_.displacement + z * size.y * size.x;
      for (std::int64_t n = 0; n < size.y * size.x; ++n) {
        if (!frame_.is_usable(slice[n])) refuse_sample({n % size.x, n / size.x, z});
      }
    };
    FirstRefusal refusal;
    arena_.execute([&] {
      tbb::parallel_for(std::int64_t{0}, size.z, [&](std::int64_t z) {
        if (control.stop.stop_requested()) throw Cancelled();
        refusal.attempt(z, [&] { check_slice(z); });
      });
    });
    refusal.rethrow();
  }

  mutable Arena arena_;
  PullFrame frame_;
  Geometry grid_;
  bool ready_ = false;
};

}  // namespace

}  // namespace cpu

std::unique_ptr<PullResampler> make_cpu_pull_resampler(Geometry output, Limits limits) {
  return std::make_unique<cpu::RowPullResampler>(output, limits);
}

}  // namespace tetwarp
