// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "itkbridge/image_view.h"

#include <gtest/gtest.h>

#include "tests/support/says.h"

namespace {

using namespace tetwarp;

using ShortImage = itk::Image<short, 3>;
using FloatImage = itk::Image<float, 3>;

AnyVolume numbered(const Geometry& grid) {
  AnyVolume volume(grid, VoxelType::i16);
  std::int16_t number = 0;
  for (std::int16_t& voxel : volume.as<std::int16_t>()) voxel = number++;
  return volume;
}

TEST(ImageOf, OwnsTheVoxelsOfTheVolumeWhereTheyAre) {
  const Geometry grid{.size = {4, 3, 2}, .spacing = {1, 2, 3}, .origin = {5, -6, 7}};
  AnyVolume volume = numbered(grid);
  const void* const voxels = volume.data();
  const auto image = image_of<ShortImage>(std::move(volume));
  EXPECT_EQ(static_cast<const void*>(image->GetBufferPointer()), voxels);
  EXPECT_EQ(geometry_of(*image), grid);
  EXPECT_EQ(image->GetPixel({{3, 2, 1}}), 23);
}

TEST(ImageOf, RefusesSlicesThatAreUnevenlyFarApart) {
  const Geometry grid{.size = {4, 3, 3}, .slices = {0, 0.5, 2}};
  std::string error;
  try {
    image_of<ShortImage>(numbered(grid));
  } catch (const InputError& thrown) {
    error = thrown.what();
  }
  EXPECT_TRUE(says(error, {"unevenly far apart", "straightened"}));
}

TEST(ImageOf, RefusesVoxelsOfAnotherType) {
  EXPECT_THROW(image_of<FloatImage>(numbered({.size = {4, 3, 2}})), InputError);
}

}  // namespace
