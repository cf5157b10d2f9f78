// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/cpu/interval_rows.h"

#include <algorithm>
#include <cmath>

#include "deform/core/barycentric.h"

namespace tetwarp::cpu {

void IntervalRows::prepare(const PlaceForm& form) {
  maps_.clear();
  tile_maps_.clear();
  if (!form.is_coarse) return;
  for (int axis = 0; axis < 3; ++axis) {
    fixed_.u[axis] = form.is_wide ? nullptr : u_[axis];
    fixed_.wide[axis] = form.is_wide ? wide_[axis] : nullptr;
  }
  for (const Tetrahedron& owner : tile.owners()) {
    maps_.emplace_back(owner);
    tile_maps_.emplace_back(maps_.back(), glm::ivec3(tile.box().begin));
  }
}

/// Decides for a row where each voxel comes from.
void IntervalRows::find_places(const PlaceForm& form, const Nudge& nudge, const Row& row, std::int64_t y,
                               std::int64_t z, std::uint32_t stays, const MapWriter& maps, Report& report) {
  const std::uint32_t covered = tile.covered(y, z), rests = stays & ~covered;
  report.conflicts += static_cast<std::uint64_t>(std::popcount(stays & covered));
  const std::uint32_t mapped = covered | rests;
  if (mapped == ~0u) {
    std::fill_n(mapped_, kTile, std::uint8_t{1});
  } else {
    for (int i = 0; i < row.count; ++i) mapped_[i] = static_cast<std::uint8_t>(mapped >> i & 1);
  }
  const bool wants_jacobian = maps.wants_jacobian(), wants_tetrahedra = maps.wants_tetrahedra();
  if (wants_tetrahedra) std::fill_n(tetrahedra_, row.count, kNoTetrahedron);
  if (wants_jacobian) {
    std::fill_n(jacobian_, row.count, NAN);
    for (std::uint32_t left = rests; left != 0; left &= left - 1) jacobian_[std::countr_zero(left)] = 1.0f;
  }
  RowRun runs[kTile];
  struct {
    int begin, end;
    std::size_t owner;
  } slow[kTile];  // later: vectors write over what follows their runs
  int count = 0, slow_count = 0;
  tile.for_each_interval(y, z, [&](int begin, int end, std::size_t owner) {
    if (!form.is_coarse) {
      find_offsets(nudge, row, begin, end, tile.owners()[owner]);
    } else if (form.is_wide || maps_[owner].is_thin) {
      slow[slow_count++] = {begin, end, owner};
    } else {
      runs[count++] = {begin, end, &tile_maps_[owner]};
    }
    if (wants_jacobian) std::fill(jacobian_ + begin, jacobian_ + end, forward_jacobian(tile.owners()[owner]));
    if (wants_tetrahedra) std::fill(tetrahedra_ + begin, tetrahedra_ + end, tile.numbers()[owner]);
  });
  if (count != 0) fill_fixed_row(runs, count, static_cast<int>(y), static_cast<int>(z), u_);
  for (int n = 0; n < slow_count; ++n) find_one_by_one(nudge, row, slow[n].begin, slow[n].end, slow[n].owner);
  const std::uint32_t in_row = ~0u >> (32 - row.count);
  for (std::uint32_t left = ~covered & in_row; left != 0; left &= left - 1) clear(form, std::countr_zero(left));
}

/// A voxel that nobody owns: where it stays, if it does.
void IntervalRows::clear(const PlaceForm& form, int i) {
  if (!form.is_coarse) {
    offset_[i] = glm::vec3(0);
  } else {
    for (int axis = 0; axis < 3; ++axis) {
      u_[axis][i] = 0;
      wide_[axis][i] = 0;
    }
  }
}

/// U of an interval of a coarse field, where the tetrahedron is thin or 32 bits are too few.
void IntervalRows::find_one_by_one(const Nudge& nudge, const Row& row, int begin, int end, std::size_t owner) {
  const CoarseMap& map = maps_[owner];
  for (int i = begin; i < end; ++i) {
    const glm::ivec3 voxel = glm::ivec3(row.voxel) + glm::ivec3(i, 0, 0);
    const glm::i64vec3 u =
        map.is_thin ? thin_u(tile.owners()[owner], voxel, nudge.signs(glm::i64vec3(voxel))) : map.u(voxel);
    for (int axis = 0; axis < 3; ++axis) {
      wide_[axis][i] = u[axis];
      u_[axis][i] = static_cast<std::int32_t>(u[axis]);
    }
  }
}

/// The offsets of an interval of a dense field.
void IntervalRows::find_offsets(const Nudge& nudge, const Row& row, int begin, int end, const Tetrahedron& t) {
  const TetrahedronMap map(t);
  for (int i = begin; i < end; ++i) {
    const glm::i64vec3 voxel = row.voxel + glm::i64vec3(i, 0, 0);
    const glm::i32vec3 steps = glm::i32vec3(voxel) * kStepsPerVoxel;
    offset_[i] = map.u(steps, [&] { return interpolate_u_exactly(t, steps, nudge.signs(voxel)); });
  }
}

}  // namespace tetwarp::cpu
