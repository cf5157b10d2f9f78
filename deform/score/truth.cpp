// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/score/truth.h"

#include <tbb/parallel_for.h>

#include <span>

#include "deform/core/trilinear.h"
#include "deform/cpu/first_refusal.h"
#include "deform/cpu/tiles.h"

namespace tetwarp::score {

namespace {

TruthSlab slab_of(std::int64_t voxels) {
  const auto count = static_cast<std::size_t>(voxels);
  return {std::vector<std::uint8_t>(count), std::vector<glm::vec3>(count), std::vector<float>(count)};
}

class ExactInverse final : public Truth {
 public:
  explicit ExactInverse(ForwardResampler& resampler) : resampler_(resampler) {}

  const Geometry& grid() const override { return resampler_.output(); }

  TruthSlab slab(const Region& slices, const Control& control) override {
    TruthSlab slab = slab_of(voxel_count(slices));
    const auto map = [&](auto& values, VoxelType type, int components) {
      return VolumeView{&grid(), slices, type, components, std::as_writable_bytes(std::span(values)).data()};
    };
    resampler_.resample(slices, {},
                        {.coverage = map(slab.is_known, VoxelType::u8, 1),
                         .inverse_mm = map(slab.displacement, VoxelType::f32, 3),
                         .jacobian = map(slab.determinant, VoxelType::f32, 1)},
                        {.stop = control.stop, .stream = control.stream});
    for (float& determinant : slab.determinant) determinant = 1 / determinant;
    return slab;
  }

 private:
  ForwardResampler& resampler_;
};

class ExactForward final : public Truth {
 public:
  ExactForward(const PointMover& mover, const Geometry& moving, const Geometry& fixed, const Limits& limits)
      : mover_(mover),
        grid_(moving),
        fixed_size_(fixed.size),
        fixed_index_(index_from_point(fixed)),
        point_(point_from_index(moving)),
        limits_(limits) {}

  const Geometry& grid() const override { return grid_; }

  TruthSlab slab(const Region& slices, const Control& control) override {
    TruthSlab slab = slab_of(voxel_count(slices));
    cpu::FirstRefusal refusal;
    const Control quiet{.stop = control.stop};
    cpu::Arena arena(limits_);
    const std::int64_t rows = grid_.size.y * (slices.end.z - slices.begin.z);
    cpu::WorkProgress progress(quiet, rows);
    arena.execute([&] {
      tbb::parallel_for(std::int64_t{0}, rows, [&](std::int64_t row) {
        refusal.attempt(row, [&] {
          progress.done(1);
          const std::int64_t j = row % grid_.size.y, k = slices.begin.z + row / grid_.size.y;
          auto at = static_cast<std::size_t>(row * grid_.size.x);
          for (std::int64_t i = 0; i < grid_.size.x; ++i, ++at) {
            const glm::dvec3 from = point_(glm::dvec3(i, j, k));
            glm::dvec3 to = from;
            double determinant = 1;
            slab.is_known[at] = mover_.move(to, &determinant) == PointStatus::moved && is_in_fixed(to);
            slab.displacement[at] = glm::vec3(to - from);
            slab.determinant[at] = static_cast<float>(determinant);
          }
        });
      });
    });
    refusal.rethrow();
    return slab;
  }

 private:
  bool is_in_fixed(const glm::dvec3& point) const {
    const glm::dvec3 index = fixed_index_(point);
    return cell_of(index.x, fixed_size_.x) >= 0 && cell_of(index.y, fixed_size_.y) >= 0 &&
           cell_of(index.z, fixed_size_.z) >= 0;
  }

  const PointMover& mover_;
  Geometry grid_;
  glm::i64vec3 fixed_size_;
  AffineMap fixed_index_, point_;
  Limits limits_;
};

}  // namespace

std::unique_ptr<Truth> exact_inverse(ForwardResampler& resampler) { return std::make_unique<ExactInverse>(resampler); }

std::unique_ptr<Truth> exact_forward(const PointMover& mover, const Geometry& moving, const Geometry& fixed,
                                     const Limits& limits) {
  return std::make_unique<ExactForward>(mover, moving, fixed, limits);
}

}  // namespace tetwarp::score
