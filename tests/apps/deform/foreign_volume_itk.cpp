// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <itkGDCMImageIO.h>
#include <itkGDCMSeriesFileNames.h>
#include <itkImageSeriesReader.h>

#include "tests/apps/deform/foreign_volumes.h"

namespace tetwarp::test {

Volume<std::int16_t> read_with_itk(const std::filesystem::path& folder) {
  using Image = itk::Image<std::int16_t, 3>;
  const auto names = itk::GDCMSeriesFileNames::New();
  names->SetUseSeriesDetails(true);
  names->SetInputDirectory(folder.string());
  const auto reader = itk::ImageSeriesReader<Image>::New();
  reader->SetImageIO(itk::GDCMImageIO::New());
  reader->SetFileNames(names->GetInputFileNames());
  reader->Update();
  const Image& image = *reader->GetOutput();
  const auto region = image.GetLargestPossibleRegion();
  Volume<std::int16_t> volume;
  Geometry& geometry = volume.geometry;
  for (int axis = 0; axis < 3; ++axis) {
    geometry.size[axis] = static_cast<std::int64_t>(region.GetSize()[axis]);
    geometry.spacing[axis] = image.GetSpacing()[axis];
    geometry.origin[axis] = image.GetOrigin()[axis];
    for (int row = 0; row < 3; ++row) geometry.direction[axis][row] = image.GetDirection()(row, axis);
  }
  volume.voxels.assign(image.GetBufferPointer(), image.GetBufferPointer() + region.GetNumberOfPixels());
  return volume;
}

}  // namespace tetwarp::test
