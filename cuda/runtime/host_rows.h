// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <cstring>

#include "deform/volume.h"

namespace tetwarp::cuda_detail {

/// A box of a view of host memory, seen as one line of bytes: its rows, one after the other.
struct HostRows {
  std::byte* first;
  std::size_t row;  ///< bytes
  std::size_t rows_per_slice;
  std::size_t row_pitch, slice_pitch;  ///< bytes from one to the next

  /// Writes bytes `begin` to `begin + size` of the line.
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

/// @param box  part of what the view buffers. Rows that follow each other in memory are one row.
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
