#include <tbb/parallel_for.h>

#include <vector>

#include "deform/cpu/map_writer.h"
#include "deform/cpu/sampler.h"
#include "deform/cpu/tiles.h"
#include "deform/field_check.h"

namespace tetwarp {

namespace cpu {

namespace {

struct RowScratch {
  std::uint8_t mapped[kTile], coverage[kTile];
  glm::vec3 offset[kTile];
};

/// Row by row: where each voxel comes from, then the samples there.
class PullResampler final : public Resampler {
 public:
  PullResampler(Geometry output, const Limits& limits) : Resampler(output), arena_(make_arena(limits)) {}

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

  Report resample(Region region, std::span<const Target> targets, const Maps& maps, const Control& control) override {
    require(ready_, "resample needs a field: call set_field first");
    require(!maps.jacobian.voxels && !maps.owners.voxels, "a pull field has no tetrahedra: no Jacobian or owners map");
    const TargetSamplers samplers = make_samplers(*this, targets, region);
    const MapWriter writer(maps, output(), region);
    return for_each_tile<RowScratch>(arena_, region, control, [&](const Region& box, RowScratch& scratch) {
      Report report;
      for (std::int64_t z = box.begin.z; z < box.end.z; ++z) {
        for (std::int64_t y = box.begin.y; y < box.end.y; ++y) {
          const Row row{{box.begin.x, y, z}, static_cast<int>(box.end.x - box.begin.x), scratch.mapped, scratch.offset};
          for (int i = 0; i < row.count; ++i) {
            scratch.mapped[i] = frame_.offset_at(row.voxel + glm::i64vec3(i, 0, 0), scratch.offset[i]);
          }
          sample_targets(row, samplers, scratch.coverage, report);
          writer.write(row, scratch.coverage, nullptr, nullptr);
        }
      }
      return report;
    });
  }

 private:
  void check_samples(const Control& control) {
    const glm::i64vec3 size = frame_.size;
    arena_.execute([&] {
      tbb::parallel_for(std::int64_t{0}, size.z, [&](std::int64_t z) {
        if (control.stop.stop_requested()) throw Cancelled();
        const glm::vec3* slice = frame_.displacement + z * size.y * size.x;
        for (std::int64_t n = 0; n < size.y * size.x; ++n) {
          if (!frame_.is_usable(slice[n])) refuse_sample({n % size.x, n / size.x, z});
        }
      });
    });
  }

  mutable tbb::task_arena arena_;
  PullFrame frame_;
  Geometry grid_;
  bool ready_ = false;
};

}  // namespace

}  // namespace cpu

std::unique_ptr<Resampler> make_cpu_pull_resampler(Geometry output, Limits limits) {
  return std::make_unique<cpu::PullResampler>(output, limits);
}

}  // namespace tetwarp
