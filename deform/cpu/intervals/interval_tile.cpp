// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/cpu/intervals/interval_tile.h"

#include <algorithm>
#include <bit>
#include <glm/common.hpp>

#include "deform/core/row_interval.h"

namespace tetwarp::cpu {

static_assert(kTile <= kMostRowTile && kTile == 32, "a row has a bit for each voxel");

void IntervalTile::begin(const Region& box, const Nudge& nudge, bool counts, IntervalSink* sink) {
  box_ = box;
  sink_ = sink;
  is_shared_ = false;
  batch_.clear();
  wants_counts_ = counts;
  if (counts) counts_.assign(static_cast<std::size_t>(voxel_count(box)), 0);
  const glm::i64vec3 size = box.end - box.begin;
  for (std::int64_t z = 0; z < size.z; ++z) {
    std::fill_n(covered_ + z * kTile, size.y, 0u);
  }
  glm::i64vec3 turn;
  for (int axis = 0; axis < 3; ++axis) turn[axis] = std::clamp(nudge.first_down(axis), box.begin[axis], box.end[axis]);
  parts_.clear();
  for (int n = 0; n < 8; ++n) {
    Region part = box;
    for (int axis = 0; axis < 3; ++axis) ((n >> axis & 1) != 0 ? part.begin : part.end)[axis] = turn[axis];
    if (!is_empty(part)) parts_.push_back({{glm::ivec3(part.begin), glm::ivec3(part.end)}, nudge.signs(part.begin)});
  }
  if (sink) sink->begin();
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

void IntervalTile::enter(std::uint64_t number, const Tetrahedron& t) {
  batch_.add(number, t);
  if (batch_.is_full()) end();
}

void IntervalTile::end() {
  if (batch_.count() == 0) return;
  if (sink_) sink_->meet(batch_);
  for (const Part& part : parts_) enter_batch(part);
  batch_.clear();
}

void IntervalTile::enter_batch(const Part& part) {
  const glm::ivec3& first = part.voxels.begin;
  const glm::ivec3 size = part.voxels.end - first;
  find_in_tile(batch_, first, part.signs, size, in_tile_);
  for (int n = 0; n < batch_.count(); ++n) {
    TileTetrahedron& t = in_tile_[n];
    if (t.reached.is_empty()) continue;
    if (!t.fits_int64 && !make_row_faces(batch_.tetrahedron(n), first, part.signs, size, t.faces))
      t.faces.lower = 0;  // perhaps flat
    enter(part, n);
  }
}

void IntervalTile::enter(const Part& part, int number) {
  const Tetrahedron& t = batch_.tetrahedron(number);
  const RowFaces& faces = in_tile_[number].faces;
  const glm::ivec3 &begin = in_tile_[number].reached.begin, &end = in_tile_[number].reached.end;
  const glm::ivec3 from = part.voxels.begin - glm::ivec3(box_.begin);
  if (faces.lower == 0) {
    scan_.found = scan_.unsure = 0;
    for (int z = begin.z; z < end.z; ++z) {
      for (int y = begin.y; y < end.y; ++y)
        scan_.unsure_rows[scan_.unsure++] = static_cast<std::uint16_t>(y + kMostRowTile * z);
    }
  } else {
    scan_rows(faces, begin.y, end.y, begin.z, end.z, part.voxels.end.x - part.voxels.begin.x, scan_);
  }
  for (int n = 0; n < scan_.unsure; ++n) {
    const int row = scan_.unsure_rows[n];
    const std::uint32_t bits = exact_bits(t, part, row % kMostRowTile, row / kMostRowTile);
    if (bits == 0) continue;
    scan_.found_rows[scan_.found] = static_cast<std::uint16_t>(row);
    scan_.found_bits[scan_.found++] = bits;
  }
  // What others have already goes.
  const int first_row = from.y + static_cast<int>(kTile) * from.z;
  std::uint32_t shared = 0;
  int got = 0;
  for (int n = 0; n < scan_.found; ++n) {
    const int row = first_row + scan_.found_rows[n];
    const std::uint32_t bits = scan_.found_bits[n] << from.x, fresh = bits & ~covered_[row];
    shared |= bits ^ fresh;
    covered_[row] |= fresh;
    if (wants_counts_) count(row, bits);
    scan_.found_rows[got] = static_cast<std::uint16_t>(row);
    scan_.found_bits[got] = fresh;
    got += fresh != 0;
  }
  is_shared_ = is_shared_ || shared != 0;
  if (sink_ && got != 0) sink_->take({batch_, number, scan_.found_rows, scan_.found_bits, got});
}

/// What a tetrahedron owns of a row, by exact integers.
std::uint32_t IntervalTile::exact_bits(const Tetrahedron& t, const Part& part, int y, int z) {
  const int width = part.voxels.end.x - part.voxels.begin.x;
  const RowInterval in = exact_row(t, part.voxels.begin, part.signs, y, z, width);
  return in.is_empty() ? 0 : (~0u >> (32 - (in.end - in.begin))) << in.begin;
}

void IntervalTile::count(int row, std::uint32_t bits) {
  std::uint16_t* several = counts_.data() + first_count(row % kTile, row / kTile);
  for (std::uint32_t left = bits; left != 0; left &= left - 1) {
    std::uint16_t& of = several[std::countr_zero(left)];
    of = static_cast<std::uint16_t>(of + (of < UINT16_MAX));
  }
}

}  // namespace tetwarp::cpu
