// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "cuda/output/voxel_sink.cuh"

namespace tetwarp::cuda_detail {

/// Samples a column of voxels along k: while one is made, what the next is made from is on its way.
///
/// @tparam kInside   whether all come from well inside the source
/// @param places     `Weighings`, or `CoarseMaps` of a coarse field
/// @param at         the first voxel  @param in_tile  the same, counted from the first of the tile
/// @param next_slot  called once a voxel: the slot of its owner
/// @param finish     `finish(z)` writes a voxel that float leaves open or nobody owns, and says whether it is covered
/// @return how many are covered
template <bool kInside, class Sink, class Places, class NextSlot, class Finish>
__device__ unsigned sample_column(const Sink& sink, const Places& places, glm::ivec3 at, const glm::ivec3& in_tile,
                                  int count, NextSlot&& next_slot, Finish&& finish) {
  unsigned column = sink.column(at), held = ~0u, left = 0;
  int out = sink.address(at);
  typename Places::From from = places.from(in_tile);
  typename Places::Held m{};
  typename Sink::Pending pending{};
  const auto next_moved = [&] {
    places.hold(next_slot(), m, held);
    const auto moved = places.moved(m, from);
    places.step(from);
    return moved;
  };
  const auto begin = [&](const auto& moved) {
    typename Sink::Origin origin;
    const bool any = sink.template locate<kInside>(at, column, moved, origin);
    sink.begin(origin, any, pending);
    if (!any) left |= 1;
    column += sink.per_source_slice();
    ++at.z;
  };
  begin(next_moved());
#pragma unroll(kInside && !Sink::kIsWide ? 3 : 1)  // fewer registers are copied
  for (int z = 1; z < count; ++z) {
    const auto moved = next_moved();
    left <<= 1;
    if (is_any(moved)) {  // a branch, so that nothing of it is moved before what is read meanwhile
      sink.end(out, pending);
    } else {
      left |= 2;
    }
    out += sink.per_slice();
    begin(moved);
  }
  sink.end(out, pending);
  unsigned covered = static_cast<unsigned>(count - __popc(left));
#pragma unroll 1
  for (; left != 0; left &= left - 1)  // not within the loop above: calls would cost it registers
    covered += finish(count - __ffs(static_cast<int>(left)));
  return covered;
}

template <class Sink, class Offset>
__device__ __noinline__ bool write_out_of_line(const Sink& sink, int out, glm::ivec3 at, Offset u) {
  return sink.write(out, at, u);
}

/// For `finish` above, of a voxel that has an owner.
/// @param slowly  `slowly(out)` writes it with all the arithmetic there is, where its place is not prepared
template <class Sink, class Places, class Slowly>
__device__ bool finish_voxel(const Sink& sink, const Places& places, unsigned slot, const glm::ivec3& at,
                             const glm::ivec3& in_tile, Slowly&& slowly) {
  typename Places::Held m{};
  unsigned held = ~0u;
  places.hold(slot, m, held);
  const auto moved = places.moved(m, places.from(in_tile));
  const int out = sink.address(at);
  return is_any(moved) ? write_out_of_line(sink, out, at, offset_of(moved)) : slowly(out);
}

}  // namespace tetwarp::cuda_detail
