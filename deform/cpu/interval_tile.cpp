// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/cpu/interval_tile.h"

#include <algorithm>
#include <glm/common.hpp>

#include "deform/core/row_interval.h"

namespace tetwarp::cpu {

static_assert(kTile <= kMostRowTile && kTile == 32, "a row has a bit for each voxel");

void IntervalTile::begin(const Region& box, const Nudge& nudge, bool counts) {
  box_ = box;
  owners_.clear();
  numbers_.clear();
  wants_counts_ = counts;
  if (counts) counts_.assign(static_cast<std::size_t>(voxel_count(box)), 0);
  const glm::i64vec3 size = box.end - box.begin;
  for (std::int64_t z = 0; z < size.z; ++z) {
    for (std::int64_t y = 0; y < size.y; ++y) starts_[number(y, z)] = covered_[number(y, z)] = 0;
  }
  glm::i64vec3 turn;
  for (int axis = 0; axis < 3; ++axis) turn[axis] = std::clamp(nudge.first_down(axis), box.begin[axis], box.end[axis]);
  parts_.clear();
  for (int n = 0; n < 8; ++n) {
    Region part = box;
    for (int axis = 0; axis < 3; ++axis) ((n >> axis & 1) != 0 ? part.begin : part.end)[axis] = turn[axis];
    if (!is_empty(part)) parts_.push_back({{glm::ivec3(part.begin), glm::ivec3(part.end)}, nudge.signs(part.begin)});
  }
}

bool IntervalTile::enter(std::uint64_t number, const Tetrahedron& t) {
  bool shared = false;
  for (const Part& part : parts_) shared = enter(part, number, t) || shared;
  return shared;
}

/// The voxels of a part that a box of snapped vertices may hold, nudged: `detail::candidates`, where all voxels are
/// nudged alike.
IntBox IntervalTile::Part::reached(const glm::i32vec3& low, const glm::i32vec3& high) const {
  IntBox box = voxels;
  for (int axis = 0; axis < 3; ++axis) {
    const int up = signs[axis] > 0 ? 1 : 0;
    box.begin[axis] = std::max(box.begin[axis], ((low[axis] - up) >> 12) + 1);
    box.end[axis] = std::min(box.end[axis], ((high[axis] - up) >> 12) + 1);
  }
  return box;
}

bool IntervalTile::may_reach(const glm::i32vec3& low, const glm::i32vec3& high) const {
  return std::any_of(parts_.begin(), parts_.end(),
                     [&](const Part& part) { return !part.reached(low, high).is_empty(); });
}

bool IntervalTile::enter(const Part& part, std::uint64_t number, const Tetrahedron& t) {
  const Box around = box_of(t);
  const IntBox reached = part.reached(around.low, around.high);
  if (reached.is_empty()) return false;
  const glm::ivec3 &first = part.voxels.begin, size = part.voxels.end - first, from = first - glm::ivec3(box_.begin),
                   begin = reached.begin - first, end = reached.end - first;
  if (!make_row_faces(t, first, part.signs, size, faces_)) {  // perhaps flat
    scan_.found = scan_.unsure = 0;
    for (int z = begin.z; z < end.z; ++z) {
      for (int y = begin.y; y < end.y; ++y)
        scan_.unsure_rows[scan_.unsure++] = static_cast<std::uint16_t>(y + kMostRowTile * z);
    }
  } else {
    scan_rows(faces_, begin.y, end.y, begin.z, end.z, size.x, scan_);
  }
  const Entry entry{from.x, from.y + static_cast<int>(kTile) * from.z, static_cast<std::uint16_t>(owners_.size())};
  std::uint32_t any = 0, shared = 0;
  for (int n = 0; n < scan_.found; ++n) mark(entry, scan_.found_rows[n], scan_.found_bits[n], any, shared);
  for (int n = 0; n < scan_.unsure; ++n) {
    const int row = scan_.unsure_rows[n];
    mark(entry, row, exact_bits(t, part, row % kMostRowTile, row / kMostRowTile), any, shared);
  }
  if (any != 0) {
    owners_.push_back(t);
    numbers_.push_back(static_cast<std::uint32_t>(number));
  }
  return shared != 0;
}

/// Enters what a tetrahedron owns of a row. @param any, shared  get a bit where it got, and did not get, a voxel
inline void IntervalTile::mark(const Entry& entry, int row, std::uint32_t bits, std::uint32_t& any,
                               std::uint32_t& shared) {
  bits <<= entry.column;
  const auto at = static_cast<std::size_t>(entry.row + row);
  const std::uint32_t fresh = bits & ~covered_[at], starts = fresh & ~(fresh << 1);
  shared |= bits ^ fresh;
  any |= fresh;
  covered_[at] |= fresh;
  starts_[at] |= starts;
  for (std::uint32_t left = starts; left != 0; left &= left - 1) owner_[at][std::countr_zero(left)] = entry.owner;
  if (wants_counts_) count(at, bits);
}

/// What a tetrahedron owns of a row, by exact integers.
std::uint32_t IntervalTile::exact_bits(const Tetrahedron& t, const Part& part, int y, int z) {
  const int width = part.voxels.end.x - part.voxels.begin.x;
  const RowInterval in = exact_row(t, part.voxels.begin, part.signs, y, z, width);
  return in.is_empty() ? 0 : (~0u >> (32 - (in.end - in.begin))) << in.begin;
}

void IntervalTile::count(std::size_t row, std::uint32_t bits) {
  const glm::i64vec3 size = box_.end - box_.begin;
  const auto n = static_cast<std::int64_t>(row);
  std::uint16_t* several = counts_.data() + ((n / kTile) * size.y + n % kTile) * size.x;
  for (std::uint32_t left = bits; left != 0; left &= left - 1) {
    std::uint16_t& of = several[std::countr_zero(left)];
    of = static_cast<std::uint16_t>(of + (of < UINT16_MAX));
  }
}

}  // namespace tetwarp::cpu
