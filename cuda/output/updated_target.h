// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "deform/resampler.h"

namespace tetwarp::cuda_detail {

/// What must be the same of a target, so that its output holds what the last update gave.
struct UpdatedTarget {
  explicit UpdatedTarget(const Target& target)
      : source(target.source.voxels),
        output(target.output.voxels),
        source_memory(target.source.memory),
        output_memory(target.output.memory),
        source_grid(*target.source.geometry),
        source_region(target.source.buffered),
        output_region(target.output.buffered),
        type(target.source.type),
        components(target.source.components),
        interpolation(target.interpolation),
        background(target.background) {}
  bool operator==(const UpdatedTarget&) const = default;

  const std::byte *source, *output;
  Memory source_memory, output_memory;
  Geometry source_grid;
  Region source_region, output_region;
  VoxelType type;
  int components;
  Interpolation interpolation;
  double background;
};

}  // namespace tetwarp::cuda_detail
