// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <cstring>

#include "deform/volume.h"

namespace tetwarp::cuda_detail {

/// A box of voxels of a view of host memory, seen as one line of bytes: its rows, one after the other, without the gaps
/// that lie between them in memory. Results that come from a device in pieces of any size are written through it.
struct HostRows {
  std::byte* first;                    ///< the first voxel of the box
  std::size_t row;                     ///< bytes of a row
  std::size_t rows_per_slice;          ///< rows that lie `row_pitch` apart
  std::size_t row_pitch, slice_pitch;  ///< bytes from the begin of a row, or slice, to that of the next

  /// Copies `size` bytes to the line, from its byte `begin` on. Parts of the line may be written by several threads.
  void write(std::size_t begin, const std::byte* from, std::size_t size) const {
    while (size > 0) {
      const std::size_t number = begin / row, in = begin % row, bytes = std::min(size, row - in);
      std::memcpy(first + number / rows_per_slice * slice_pitch + number % rows_per_slice * row_pitch + in, from,
                  bytes);
      begin += bytes;
      from += bytes;
      size -= bytes;
    }
  }
};

/// The rows of a box. Rows, and slices, that follow each other in memory without a gap become one longer row, so that
/// fewer copies are made.
/// @param box  a part of what the view buffers, in voxels of its grid
inline HostRows rows_of(const VolumeView& view, const Region& box) {
  const std::size_t voxel = size_bytes(view.type) * static_cast<std::size_t>(view.components);
  const glm::i64vec3 held = view.buffered.end - view.buffered.begin, size = box.end - box.begin,
                     at = box.begin - view.buffered.begin;
  const std::size_t pitch = static_cast<std::size_t>(held.x) * voxel;
  HostRows rows{view.voxels + static_cast<std::size_t>((at.z * held.y + at.y) * held.x + at.x) * voxel,
                static_cast<std::size_t>(size.x) * voxel, static_cast<std::size_t>(size.y), pitch,
                pitch * static_cast<std::size_t>(held.y)};
  if (rows.row == rows.row_pitch) {
    rows.row *= rows.rows_per_slice;
    rows.row_pitch = rows.slice_pitch;
    rows.rows_per_slice = 1;
  }
  if (rows.rows_per_slice == 1 && rows.row == rows.slice_pitch) rows.row *= static_cast<std::size_t>(size.z);
  return rows;
}

}  // namespace tetwarp::cuda_detail
