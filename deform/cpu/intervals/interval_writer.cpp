// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/cpu/intervals/interval_writer.h"

#include <algorithm>
#include <cmath>

#include "deform/core/barycentric.h"

namespace tetwarp::cpu {

/// Forgets what was found of the tile.
void IntervalWriter::begin() {
  report_ = {};
  count_ = 0;
  slices_.assign(to_->samplers.size(), {});
}

/// Adds voxels of rows to the list, and writes it as often as it is full.
/// @param fill  `fill(from)` finds out where voxels come from: those from number `from` of the list to its end
template <class Fill>
inline void IntervalWriter::append(const std::uint16_t* rows, const std::uint32_t* bits, int count, const Fill& fill) {
  for (int done = 0; done < count;) {
    const int from = count_;
    done += list_voxels(rows + done, bits + done, count - done, numbers_, count_, kMostTogether);
    fill(from);
    if (done < count) write_list();
  }
}

void IntervalWriter::meet(const TetrahedronBatch& batch) {
  if (to_->form.is_coarse && !to_->form.is_wide) find_maps(batch, glm::ivec3(tile.box().begin), maps_);
}

void IntervalWriter::take(const OwnedRows& owned) {
  append(owned.rows, owned.bits, owned.count, [&](int from) { find_places(owned, from); });
}

/// Finds where the voxels of a tetrahedron come from. @param from  the first of them; they end the list
void IntervalWriter::find_places(const OwnedRows& owned, int from) {
  if (from == count_) return;
  const Tetrahedron& t = owned.batch.tetrahedron(owned.n);
  const glm::ivec3 first(tile.box().begin);
  const auto voxel = [&](int i) { return first + VoxelList::in_tile(numbers_[i]); };
  if (!to_->form.is_coarse) {
    const TetrahedronMap of_t(t);
    for (int i = from; i < count_; ++i) {
      const glm::i32vec3 steps = voxel(i) * kStepsPerVoxel;
      offset_[i] =
          of_t.u(steps, [&] { return interpolate_u_exactly(t, steps, to_->nudge.signs(glm::i64vec3(voxel(i)))); });
    }
  } else if (!to_->form.is_wide && !maps_.is_thin[owned.n]) {
    fill_fixed_list(maps_.map[owned.n], numbers_ + from, count_ - from, {u_[0] + from, u_[1] + from, u_[2] + from});
  } else {
    const CoarseMap of_t(t);
    for (int i = from; i < count_; ++i) {
      const glm::i64vec3 u =
          of_t.is_thin ? thin_u(t, voxel(i), to_->nudge.signs(glm::i64vec3(voxel(i)))) : of_t.u(voxel(i));
      for (int axis = 0; axis < 3; ++axis) {
        wide_[axis][i] = u[axis];
        u_[axis][i] = static_cast<std::int32_t>(u[axis]);
      }
    }
  }
  if (to_->maps.wants_jacobian()) std::fill(jacobian_ + from, jacobian_ + count_, forward_jacobian(t));
  if (to_->maps.wants_tetrahedra())
    std::fill(tetrahedra_ + from, tetrahedra_ + count_, static_cast<std::uint32_t>(owned.batch.number(owned.n)));
}

/// The voxels that end the list stay where they are.
void IntervalWriter::stay(int from) {
  for (int axis = 0; axis < 3; ++axis) {
    std::fill(u_[axis] + from, u_[axis] + count_, 0);
    std::fill(wide_[axis] + from, wide_[axis] + count_, 0);
  }
  std::fill(offset_ + from, offset_ + count_, glm::vec3(0));
  std::fill(jacobian_ + from, jacobian_ + count_, 1.0f);
  std::fill(tetrahedra_ + from, tetrahedra_ + count_, kNoTetrahedron);
}

/// The voxels of a row that nobody owns.
void IntervalWriter::finish_row(int y, int z, std::uint32_t stays) {
  const glm::i64vec3 first = tile.box().begin + glm::i64vec3(0, y, z);
  const auto width = static_cast<int>(tile.box().end.x - tile.box().begin.x);
  const std::uint32_t all = ~0u >> (32 - width), covered = tile.covered(y, z), rests = stays & all & ~covered;
  if (to_->maps.wants_owners()) to_->maps.write_owners(first, width, tile.counts(y, z));
  if (stays != 0) report_.conflicts += static_cast<std::uint64_t>(std::popcount(stays & covered));
  if (rests != 0) {
    const auto row = static_cast<std::uint16_t>(y + kTile * z);
    append(&row, &rests, 1, [&](int from) { stay(from); });
  }
  for (std::uint32_t left = all & ~covered & ~rests; left != 0;) {
    const int begin = std::countr_zero(left), length = std::countr_one(left >> begin);
    clear_targets(first + glm::i64vec3(begin, 0, 0), length, to_->samplers, report_);
    to_->maps.clear(first + glm::i64vec3(begin, 0, 0), length);
    left = begin + length == kTile ? 0 : left & ~0u << (begin + length);
  }
}

void IntervalWriter::finish_tile(Report& report) {
  if (to_->maps.wants_owners()) report_.multiply_owned = count_of_several(tile.counts());
  for (std::size_t n = 0; n < to_->samplers.size(); ++n) {
    if (to_->samplers[n]->wants_slices()) to_->samplers[n]->note(tile.box().begin.z, slices_[n]);
  }
  report += report_;
}

/// Samples the voxels of the list, and empties it.
void IntervalWriter::write_list() {
  if (count_ == 0) return;
  const PlaceForm& form = to_->form;
  FixedOffsets fixed{{u_[0], u_[1], u_[2]}, {}};
  if (form.is_wide) fixed = {{}, {wide_[0], wide_[1], wide_[2]}};
  const VoxelList list{tile.box().begin, count_, numbers_, form.is_coarse ? nullptr : offset_,
                       form.is_coarse ? &fixed : nullptr};
  sample_targets(list, to_->samplers, coverage_, report_, slices_.data());
  if (to_->maps.wants_any()) to_->maps.write(list, coverage_, {jacobian_, nullptr, tetrahedra_});
  count_ = 0;
}

}  // namespace tetwarp::cpu
