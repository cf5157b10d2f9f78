// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <itkImageBase.h>

#include "deform/geometry.h"

namespace tetwarp {

/// Grid of an image's largest possible region: voxel (0, 0, 0) is that region's first index.
Geometry geometry_of(const itk::ImageBase<3>& image);

/// Gives an image the grid, its largest possible region from index `start` on. Nothing is allocated.
/// @throws InputError for slices that are unevenly far apart, which an image of ITK cannot have
void set_geometry(itk::ImageBase<3>& image, const Geometry& geometry, const itk::Index<3>& start = {{0, 0, 0}});

/// A region of an image as voxels of `geometry_of` the image, and back.
Region region_of(const itk::ImageBase<3>& image, const itk::ImageRegion<3>& region);
itk::ImageRegion<3> itk_region(const itk::ImageBase<3>& image, const Region& region);

}  // namespace tetwarp
