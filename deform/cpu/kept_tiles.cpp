// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/cpu/kept_tiles.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <glm/common.hpp>

#include "deform/cpu/tiles.h"
#include "deform/update/tile_regions.h"

namespace tetwarp::cpu {

KeptTiles::KeptTiles(const Geometry& output) : all_(whole(output)), tiles_((output.size + (kTile - 1)) / kTile) {}

std::size_t KeptTiles::number(const Region& tile) const {
  const glm::i64vec3 at = tile.begin / kTile;
  return static_cast<std::size_t>((at.z * tiles_.y + at.y) * tiles_.x + at.x);
}

void KeptTiles::compare(const LatticeIndex& index, std::span<const Target> targets) {
  const FieldView& field = index.field();
  const std::vector<UpdatedTarget> given(targets.begin(), targets.end());
  const bool is_kept =
      !targets_.empty() && given == targets_ && *field.lattice == lattice_ && field.outside == outside_;
  targets_.clear();
  const auto count = static_cast<std::size_t>(tiles_.x * tiles_.y * tiles_.z);
  reports_.resize(count);
  changed_.assign(count, is_kept ? 0 : 1);
  if (is_kept) mark(index);
}

void KeptTiles::keep(const LatticeIndex& index, std::span<const Target> targets) {
  const FieldView& field = index.field();
  lattice_ = *field.lattice;
  outside_ = field.outside;
  displacement_.assign(field.displacement, field.displacement + voxel_count(lattice_));
  targets_ = std::vector<UpdatedTarget>(targets.begin(), targets.end());
}

std::vector<Region> KeptTiles::changed() const {
  return regions_of_tiles(changed_, tiles_, glm::i64vec3(kTile), glm::i64vec3(0), all_);
}

/// Marks the tiles that cells with a moved vertex reach now, or reached before.
void KeptTiles::mark(const LatticeIndex& index) {
  const glm::vec3* const now = index.field().displacement;
  moved_.resize(displacement_.size());
  std::transform(displacement_.begin(), displacement_.end(), now, moved_.begin(),
                 [](const glm::vec3& a, const glm::vec3& b) { return static_cast<std::uint8_t>(a != b); });
  const glm::i64vec3 cells = index.cells();
  const std::int64_t row = cells.x + 1, slice = row * (cells.y + 1);
  tbb::parallel_for(std::int64_t{0}, cells.z, [&](std::int64_t z) {
    for (std::int64_t y = 0; y < cells.y; ++y) {
      const std::uint8_t* const first = moved_.data() + z * slice + y * row;
      for (std::int64_t x = 0; x < cells.x; ++x) {
        const std::uint8_t* const at = first + x;
        if ((at[0] | at[1] | at[row] | at[row + 1] | at[slice] | at[slice + 1] | at[slice + row] |
             at[slice + row + 1]) != 0)
          mark_cell(index, {x, y, z});
      }
    }
  });
}

void KeptTiles::mark_cell(const LatticeIndex& index, const glm::i64vec3& cell) {
  const glm::i64vec3& size = lattice_.size;
  Cell before, now;
  for (int corner = 0; corner < 8; ++corner) {
    const glm::i64vec3 at = cell + glm::i64vec3(corner & 1, corner >> 1 & 1, corner >> 2);
    before.corner[corner] =
        index.vertex(at, displacement_[static_cast<std::size_t>((at.z * size.y + at.y) * size.x + at.x)]);
    now.corner[corner] = index.vertex(at);
  }
  mark_reached(box_of(before));
  mark_reached(box_of(now));
}

/// Marks all tiles with voxels in a box, its sides included. Several threads may call it at a time.
void KeptTiles::mark_reached(const Box& box) {
  const auto voxel = [](const glm::i32vec3& steps) {
    return glm::i64vec3(glm::floor(glm::dvec3(steps) * (1.0 / kStepsPerVoxel)));
  };
  const glm::i64vec3 first = glm::max(voxel(box.low), all_.begin),
                     last = glm::min(voxel(box.high), all_.end - std::int64_t{1});
  for (std::int64_t z = first.z / kTile; z * kTile <= last.z; ++z) {
    for (std::int64_t y = first.y / kTile; y * kTile <= last.y; ++y) {
      for (std::int64_t x = first.x / kTile; x * kTile <= last.x; ++x) {
        std::uint8_t& changed = changed_[static_cast<std::size_t>((z * tiles_.y + y) * tiles_.x + x)];
        std::atomic_ref<std::uint8_t>(changed).store(1, std::memory_order_relaxed);
      }
    }
  }
}

}  // namespace tetwarp::cpu
