// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "itkbridge/image_geometry.h"

#include "deform/errors.h"

namespace tetwarp {

Geometry geometry_of(const itk::ImageBase<3>& image) {
  const itk::ImageRegion<3>& whole = image.GetLargestPossibleRegion();
  itk::Point<double, 3> origin;
  image.TransformIndexToPhysicalPoint(whole.GetIndex(), origin);
  Geometry geometry;
  for (int axis = 0; axis < 3; ++axis) {
    const auto along = static_cast<unsigned>(axis);
    geometry.size[axis] = static_cast<std::int64_t>(whole.GetSize(along));
    geometry.spacing[axis] = image.GetSpacing()[along];
    geometry.origin[axis] = origin[along];
    for (unsigned row = 0; row < 3; ++row)
      geometry.direction[axis][static_cast<int>(row)] = image.GetDirection()(row, along);
  }
  return geometry;
}

void set_geometry(itk::ImageBase<3>& image, const Geometry& geometry, const itk::Index<3>& start) {
  require(
      geometry.slices.empty(),
      "an image of ITK cannot have slices that are unevenly far apart; resample the volume onto straightened() first");
  itk::ImageRegion<3> whole;
  whole.SetIndex(start);
  itk::ImageBase<3>::SpacingType spacing;
  itk::ImageBase<3>::PointType origin;
  itk::ImageBase<3>::DirectionType direction;
  const AffineMap point = point_from_index(geometry);
  // The point of index 0, which ITK takes for the origin.
  const glm::dvec3 first = point(-glm::dvec3(start[0], start[1], start[2]));
  for (int axis = 0; axis < 3; ++axis) {
    const auto along = static_cast<unsigned>(axis);
    whole.SetSize(along, static_cast<itk::SizeValueType>(geometry.size[axis]));
    spacing[along] = geometry.spacing[axis];
    origin[along] = start == itk::Index<3>{{0, 0, 0}} ? geometry.origin[axis] : first[axis];
    for (unsigned row = 0; row < 3; ++row) direction(row, along) = geometry.direction[axis][static_cast<int>(row)];
  }
  image.SetLargestPossibleRegion(whole);
  image.SetSpacing(spacing);
  image.SetOrigin(origin);
  image.SetDirection(direction);
}

Region region_of(const itk::ImageBase<3>& image, const itk::ImageRegion<3>& region) {
  Region voxels;
  for (int axis = 0; axis < 3; ++axis) {
    const auto along = static_cast<unsigned>(axis);
    voxels.begin[axis] = region.GetIndex(along) - image.GetLargestPossibleRegion().GetIndex(along);
    voxels.end[axis] = voxels.begin[axis] + static_cast<std::int64_t>(region.GetSize(along));
  }
  return voxels;
}

itk::ImageRegion<3> itk_region(const itk::ImageBase<3>& image, const Region& region) {
  itk::ImageRegion<3> voxels;
  for (int axis = 0; axis < 3; ++axis) {
    const auto along = static_cast<unsigned>(axis);
    voxels.SetIndex(along, region.begin[axis] + image.GetLargestPossibleRegion().GetIndex(along));
    voxels.SetSize(along, static_cast<itk::SizeValueType>(region.end[axis] - region.begin[axis]));
  }
  return voxels;
}

}  // namespace tetwarp
