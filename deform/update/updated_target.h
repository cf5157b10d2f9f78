// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to resamplers.

#include "deform/resampler.h"

namespace tetwarp {

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
        background(target.background),
        has_padding(target.padding.has_value()),
        padding_low(has_padding ? target.padding->low : 0),
        padding_high(has_padding ? target.padding->high : 0) {}
  bool operator==(const UpdatedTarget&) const = default;

  const std::byte *source, *output;
  Memory source_memory, output_memory;
  Geometry source_grid;
  Region source_region, output_region;
  VoxelType type;
  int components;
  Interpolation interpolation;
  double background;
  bool has_padding;
  double padding_low, padding_high;
};

}  // namespace tetwarp
