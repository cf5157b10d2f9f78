// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <itkImageBase.h>

#include "deform/geometry.h"

namespace tetwarp {

/// The grid of an image's largest possible region: voxel (0, 0, 0) is the first index of that region.
Geometry geometry_of(const itk::ImageBase<3>& image);

/// Gives an image a grid, whose first voxel has index `start`. It sets the largest possible region and allocates
/// nothing.
/// @throws InputError for slices at unequal distances, which an image of ITK cannot have
void set_geometry(itk::ImageBase<3>& image, const Geometry& geometry, const itk::Index<3>& start = {{0, 0, 0}});

/// A region of an image as voxels of `geometry_of` that image.
Region region_of(const itk::ImageBase<3>& image, const itk::ImageRegion<3>& region);
/// Voxels of `geometry_of` an image as a region of that image.
itk::ImageRegion<3> itk_region(const itk::ImageBase<3>& image, const Region& region);

}  // namespace tetwarp
