// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <hwy/targets.h>
#include <tbb/parallel_for.h>

#include <atomic>

#include "deform/core/ray_pick.h"
#include "deform/cpu/tiles.h"
#include "deform/render/ray_blocks.h"
#include "deform/render/ray_frame.h"
#include "deform/render/stale_patches.h"
#include "deform/update/tile_regions.h"

namespace tetwarp {

namespace {

/// Side of the square of pixels that one task casts, for near rays read the same voxels.
constexpr int kPatch = 16;

class CpuRenderer final : public Renderer {
 public:
  explicit CpuRenderer(Limits limits) : limits_(limits) {}

  void set_volume(const ConstVolumeView& volume, const Control&) override {
    require_renderable(volume);
    require(volume.memory == Memory::host, "the CPU cannot render a volume in device memory; use the CUDA renderer");
    geometry_ = *volume.geometry;
    volume_ = volume;
    volume_.geometry = &geometry_;
    const Region all = whole(geometry_);
    find_ranges({&all, 1});
    distances_.clear();
    changed_.clear();
    tint_numbers_ = nullptr;
    stale_.forget();
  }

  void update_volume(std::span<const Region> changed, const Control&) override {
    require(volume_.voxels != nullptr, "no volume is set that could have changed: call set_volume first");
    find_ranges(changed);
    mark_blocks_of(geometry_, changed, changed_);
  }

  void set_style(const RenderStyle& style) override {
    require_valid(style);
    style_ = style;
    table_step_ = 0;
    distances_.clear();
    stale_.forget();
  }

  void set_tints(const Tints& tints) override {
    require_valid(tints, volume_);
    tint_numbers_ = reinterpret_cast<const std::uint8_t*>(tints.numbers.voxels);
    tint_colours_ = tint_table(tints);
    stale_.forget();
  }

  void render(const ViewPlane& plane, std::span<std::uint8_t> rgb, const Control& control) override;
  std::optional<glm::dvec3> pick(const ViewPlane& plane, int column, int row, const Control& control) override;

 private:
  void find_ranges(std::span<const Region> changed) {
    const std::vector<int> rows = block_rows_of(geometry_, changed);
    if (rows.empty()) return;
    find_block_ranges(volume_, rows, limits_, ranges_);
    distances_are_stale_ = true;
  }
  void find_distances(const RayFrame& frame);
  void prepare(const RayFrame& frame, double step);
  template <class Use>
  void with_scene(const ViewPlane& plane, Use&& use);
  template <class V>
  void cast(const RayScene<V>& scene, const ViewPlane& plane, const std::optional<std::vector<int>>& patches,
            std::uint8_t* rgb, const Control& control) const;

  Limits limits_;
  Geometry geometry_;
  ConstVolumeView volume_;
  RenderStyle style_;
  std::vector<BlockRange> ranges_;
  std::vector<TransferEntry> table_;
  TransferIntegrals integrals_;
  ClearValues clear_;
  std::vector<std::uint8_t> distances_;  ///< empty: not known yet
  bool distances_are_stale_ = true;
  std::vector<std::uint8_t> changed_;  ///< whether each block has changed since they were found; empty: none has
  const std::uint8_t* tint_numbers_ = nullptr;
  std::vector<TransferEntry> tint_colours_;
  double table_step_ = 0;  ///< mm between samples, for which the tables were made
  StalePatches stale_{kPatch, kPatch};
  std::vector<std::uint8_t> picture_;  ///< that was kept
};

void CpuRenderer::prepare(const RayFrame& frame, double step) {
  if (step != table_step_) {
    table_ = transfer_table(style_.transfer, step);
    integrals_ = transfer_integrals(table_, step);
    clear_ = clear_values(table_, frame);
    table_step_ = step;
  }
  if (distances_are_stale_ || distances_.empty()) find_distances(frame);
}

/// Finds the distances of blocks anew. A sum or a composite shows nothing of blocks in which nothing is to be seen, so
/// of those that have changed, only those are noted beside which something is to be seen, or was.
void CpuRenderer::find_distances(const RayFrame& frame) {
  const glm::ivec3 blocks = ray_blocks(geometry_);
  const std::vector<std::uint8_t> before = std::exchange(distances_, block_distances(ranges_, blocks, frame, table_));
  distances_are_stale_ = false;
  if (changed_.empty()) return;
  if (!before.empty() && frame.projection != Projection::maximum) {
    for (std::size_t n = 0; n < changed_.size(); ++n)
      if (std::min(before[n], distances_[n]) > 1) changed_[n] = 0;
  }
  stale_.change(geometry_, regions_of_tiles(changed_, glm::i64vec3(blocks), glm::i64vec3(kRayBlock), glm::i64vec3(0),
                                            whole(geometry_)));
  changed_.clear();
}

/// Casts the rays of a row of pixels.
/// @param rgb  of the first pixel
template <class V>
[[gnu::always_inline]] inline void cast_row(const RayScene<V>& scene, int left, int right, int y, std::uint8_t* rgb) {
  for (int x = left; x < right; ++x, rgb += 3) {
    const RayColour colour = cast_ray(scene, x, y);
    rgb[0] = colour.red;
    rgb[1] = colour.green;
    rgb[2] = colour.blue;
  }
}

template <class V>
void cast_plain_row(const RayScene<V>& scene, int left, int right, int y, std::uint8_t* rgb) {
  cast_row(scene, left, right, y, rgb);
}
#if defined(__x86_64__) && !defined(__FMA__)
/// With an instruction for `fused`, which the compiler may not take for granted.
template <class V>
[[gnu::target("avx2,fma")]] void cast_fast_row(const RayScene<V>& scene, int left, int right, int y,
                                               std::uint8_t* rgb) {
  cast_row(scene, left, right, y, rgb);
}
#endif

/// `cast_row` for this processor.
template <class V>
auto best_row() {
#if defined(__x86_64__) && !defined(__FMA__)
  if ((hwy::SupportedTargets() & HWY_AVX2) != 0) return &cast_fast_row<V>;
#endif
  return &cast_plain_row<V>;
}

/// Casts the rays of patches of a picture. @param patches  empty: all
template <class V>
void CpuRenderer::cast(const RayScene<V>& scene, const ViewPlane& plane, const std::optional<std::vector<int>>& patches,
                       std::uint8_t* rgb, const Control& control) const {
  const int columns = (plane.width + kPatch - 1) / kPatch, rows = (plane.height + kPatch - 1) / kPatch;
  const int count = patches ? static_cast<int>(patches->size()) : columns * rows;
  const auto cast = best_row<V>();
  std::atomic<bool> stopped = false;
  tbb::parallel_for(0, count, [&](int n) {
    const int patch = patches ? (*patches)[static_cast<std::size_t>(n)] : n;
    if (stopped || control.stop.stop_requested()) {
      stopped = true;
      return;
    }
    const int left = patch % columns * kPatch, top = patch / columns * kPatch;
    for (int y = top; y < std::min(top + kPatch, plane.height); ++y) {
      const int right = std::min(left + kPatch, plane.width);
      cast(scene, left, right, y,
           rgb + 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(plane.width) +
                      static_cast<std::size_t>(left)));
    }
  });
  if (stopped) throw Cancelled();
}

/// Calls `use` with what rays of a picture see, in the arena of this renderer.
template <class Use>
void CpuRenderer::with_scene(const ViewPlane& plane, Use&& use) {
  const RayFrame frame = ray_frame(geometry_, style_, plane);
  cpu::Arena arena(limits_);
  arena.execute([&] {
    prepare(frame, step_mm(geometry_, style_, plane));
    const RayTables tables{ranges_.data(),
                           distances_.data(),
                           ray_blocks(geometry_),
                           table_.data(),
                           integrals_.before.data(),
                           integrals_.lowest,
                           integrals_.highest,
                           clear_,
                           tint_numbers_,
                           tint_colours_.data()};
    dispatch(volume_.type, [&](auto voxel) {
      using V = decltype(voxel);
      const auto* const voxels = reinterpret_cast<const V*>(volume_.voxels);
      const glm::ivec3 size(geometry_.size);
      use(RayScene<V>{frame, tables, {voxels, size, {1, size.x, size.x * size.y}}});
    });
  });
}

void CpuRenderer::render(const ViewPlane& plane, std::span<std::uint8_t> rgb, const Control& control) {
  require_ready(volume_, style_, plane, rgb.size());
  if (control.stop.stop_requested()) throw Cancelled();
  with_scene(plane, [&](const auto& scene) {
    const std::optional<std::vector<int>> patches = stale_.take(plane);
    if (patches) std::copy(picture_.begin(), picture_.end(), rgb.begin());
    cast(scene, plane, patches, rgb.data(), control);
  });
  if (!stale_.is_worth_keeping()) return;
  picture_.assign(rgb.begin(), rgb.end());
  stale_.keep(plane);
}

std::optional<glm::dvec3> CpuRenderer::pick(const ViewPlane& plane, int column, int row, const Control&) {
  require_pixel(volume_, style_, plane, column, row);
  std::optional<glm::dvec3> place;
  with_scene(plane, [&](const auto& scene) {
    glm::vec3 index;
    if (ray::pick(scene, column, row, index)) place = point_from_index(geometry_)(glm::dvec3(index));
  });
  return place;
}

}  // namespace

std::unique_ptr<Renderer> make_cpu_renderer(Limits limits) { return std::make_unique<CpuRenderer>(limits); }

}  // namespace tetwarp
