// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <vector>

#include "deform/volume.h"

namespace tetwarp {

enum class AnatomicalPlane : std::uint8_t { axial, coronal, sagittal };

/// A grid axis along one side of a picture.
struct PictureAxis {
  int grid_axis = 0;
  bool reversed = false;        ///< the index falls from left to right, or from top to bottom
  double length_mm = 0;         ///< mm that all voxels take, their outer halves included
  char begin = ' ', end = ' ';  ///< patient directions at the left (top) and at the right (bottom)
};

/// One slice of a grid, as radiologists look at it: axial from the feet with the front up, coronal from the front,
/// sagittal from the patient's left; the patient's right, and the front, are on the left of the picture, the head is
/// up.
///
/// Each patient axis is shown by a grid axis of its own, the three nearest as a whole; an oblique grid is shown along
/// its own axes, with the letters of the nearest patient directions.
struct Slice {
  AnatomicalPlane plane = AnatomicalPlane::axial;
  PictureAxis right, down;
  int normal_axis = 2;     ///< grid axis across the slice
  std::int64_t voxel = 0;  ///< index along it

  /// Continuous index under a place of the picture: `across` from 0 at the left edge to 1 at the right, `below` from 0
  /// at the top to 1 at the bottom.
  glm::dvec3 index_at(const Geometry& geometry, double across, double below) const;
};

/// For the patient axes L, P, S: the grid axis that runs along each.
std::array<int, 3> patient_to_grid_axes(const Geometry& geometry);

/// The slice through the middle of the grid (of two middle ones the lower index).
Slice middle_slice(const Geometry& geometry, AnatomicalPlane plane);

/// The slice on width x height pixels, rows from the top: linear between voxel centres, the outer ones continued.
/// Reads just the voxels that it shows. @throws InputError unless the view has one component and holds the whole grid
std::vector<double> sample_slice(const ConstVolumeView& volume, const Slice& slice, int width, int height);

}  // namespace tetwarp
