// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>

#include "bench/harness/results.h"
#include "deform/resampler.h"

namespace tetwarp::bench {

/// Tetwarp, and what it is compared with, on one field of one volume; everything on the device, ms a frame.
struct GpuRun {
  glm::i64vec3 size{0};
  std::string field;
  std::int64_t cell_size = 1;
  double at_rest = 0;                               ///< fraction of the vertices that do not move
  Summary set_field_ms, resample_ms, new_field_ms;  ///< the third is the first two
  Summary two_ms;                                   ///< resampling two volumes at once
  std::optional<Summary> paper_ms, gascon_ms;       ///< the field in memory
  std::optional<Summary> backward_ms;               ///< given the inverse, float3 coordinates in memory
  Report report;                                    ///< of the last frame
};

/// The tetrahedra of a field with large cells given to Tetwarp as a mesh, and to `gascon`; ms a frame. The mesh is on
/// the host: setting it uploads it.
struct MeshRun {
  std::string field;
  std::int64_t cell_size = 0;
  std::uint64_t tetrahedra = 0;
  Summary set_field_ms, resample_ms, gascon_ms;
};

/// Copies on the device, ms: of a volume, and of a field with a vertex on every voxel.
struct CopyTimes {
  Summary volume_ms, field_ms;

  /// What source and output cost at this speed: a copy reads the one and writes the other.
  double volume_floor_ms() const { return volume_ms.median; }
  /// Source, field and output: a copy reads and writes, a field is read only.
  double bytes_floor_ms() const { return volume_ms.median + field_ms.median / 2; }
};

/// Frames per second of one resampler that takes field after field.
struct FrameLoop {
  std::int64_t cell_size = 1;
  double kernels = 0;       ///< fields, source and output on the device
  double with_copies = 0;   ///< fields from pinned host memory, outputs into it, while kernels run; the source stays
  double copies_alone = 0;  ///< the same without the kernels
  double host_views = 0;    ///< source, fields and output in pageable host memory, nothing overlaps
};

/// Device memory, bytes.
struct MemoryUse {
  std::string field;
  std::uint64_t data = 0;          ///< source, field and output
  std::uint64_t host_views = 0;    ///< most that a resampler held, given all of them in host memory
  std::uint64_t device_views = 0;  ///< most that a resampler held besides them, given all of them on the device

  /// 10 % or 128 MB more than the data, whichever is more.
  std::uint64_t allowed() const { return data + std::max<std::uint64_t>(data / 10, 128'000'000); }
};

/// Everything that one call of `tetwarp-bench gpu` found.
struct GpuResults {
  GpuOptions options;
  std::string input_kind;  ///< phantom, dicom, image or raw
  Machine machine;
  glm::i64vec3 size{0};  ///< of the first volume; all but the long runs are on it
  CopyTimes copies;
  std::vector<GpuRun> runs;
  std::vector<MeshRun> meshes;
  std::vector<FrameLoop> loops;
  std::vector<MemoryUse> memory;
};

}  // namespace tetwarp::bench
