// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "bench/harness/results.h"

namespace tetwarp::bench {

/// Tetwarp's stages on one field, ms. Set_field counts inverted tetrahedra and takes the range of Jacobian
/// determinants, as it does unless told otherwise. The third is the first two.
struct OwnTimes {
  Summary set_field_ms, resample_ms, new_field_ms;
};

/// Another program on the same field.
struct PeerTimes {
  Summary ms;
  double differing = 0;  ///< fraction of the voxels covered by Tetwarp whose values differ by more than 1
};

/// What slices of a field that moves elsewhere cost: resampling them, and set_field of them alone.
struct RestingSlices {
  double share = 0;  ///< of all slices
  Summary new_field_ms;
};

/// Tetwarp, and what it is compared with, on one field of one volume; all on the same threads, in turn.
struct CpuRun {
  glm::i64vec3 size{0};
  std::string field;
  std::int64_t cell_size = 1;
  double at_rest = 0;         ///< fraction of the vertices that do not move
  std::uint64_t covered = 0;  ///< voxels
  OwnTimes ours;
  std::optional<Summary> two_ms = {};         ///< resampling two volumes at once
  std::optional<RestingSlices> resting = {};  ///< where part of the slices, not all, rest and have resting neighbours
  std::optional<Summary> bytes_ms = {};       ///< reading field and source once and writing the output once
  std::optional<PeerTimes> paper = {};        ///< Algorithm 2, the field in memory, the output cleared first
  std::optional<PeerTimes> itk_warp = {};     ///< given the inverse
  std::optional<PeerTimes> itk_invert_and_warp = {};
  std::optional<PeerTimes> vtk_probe = {};
};

/// Tetwarp on one thread and on all.
struct Scaling {
  std::string field;
  int threads = 0;
  OwnTimes one, all;

  /// How much of the work of `threads` threads is left where each could do what one alone does.
  double efficiency() const { return one.new_field_ms.median / (threads * all.new_field_ms.median); }
};

/// Everything that one call of `tetwarp-bench cpu` found.
struct CpuResults {
  CpuOptions options;
  Machine machine;
  std::optional<std::string> itk, vtk;  ///< their versions; none: not in this build
  std::vector<CpuRun> runs;             ///< a vertex on every voxel, every field
  std::vector<CpuRun> slow;             ///< the same on fewer slices, beside peers that take minutes
  std::vector<CpuRun> coarse;           ///< larger cells
  std::vector<CpuRun> growth;           ///< one field on volumes from small to large
  std::vector<glm::i64vec3> left_out;   ///< volumes of `growth` that this machine's memory does not hold
  std::optional<Scaling> scaling;       ///< none on one thread
};

inline double ns_a_voxel(const Summary& ms, const glm::i64vec3& size) {
  return ms.median * 1e6 / (static_cast<double>(size.x) * static_cast<double>(size.y) * static_cast<double>(size.z));
}

}  // namespace tetwarp::bench
