// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "itkbridge/itkVertexFieldResampleImageFilter.h"

#include <gtest/gtest.h>
#include <itkCovariantVector.h>
#include <itkRGBPixel.h>
#include <itkSymmetricSecondRankTensor.h>

#include "deform/fields/lattice_mesh.h"
#include "tests/itkbridge/filter_case.h"
#include "tests/support/says.h"

namespace tetwarp::test {
namespace {

using Filter = itk::VertexFieldResampleImageFilter<ShortImage>;

Filter::Pointer warp_of(const ShortImage* image, const itk::VertexField* field) {
  const auto filter = Filter::New();
  filter->SetInput(image);
  filter->SetVertexField(field);
  filter->SetBackend("cpu");
  return filter;
}

template <class TImage>
class VertexFieldResamplePixels : public testing::Test {};
using ImageTypes =
    testing::Types<itk::Image<unsigned char, 3>, itk::Image<signed char, 3>, itk::Image<char, 3>,
                   itk::Image<unsigned short, 3>, itk::Image<short, 3>, itk::Image<unsigned int, 3>, itk::Image<int, 3>,
                   itk::Image<float, 3>, itk::Image<double, 3>, itk::Image<itk::RGBPixel<unsigned char>, 3>,
                   itk::Image<itk::Vector<float, 2>, 3>, itk::Image<itk::CovariantVector<double, 3>, 3>,
                   itk::Image<itk::SymmetricSecondRankTensor<float, 3>, 3>, itk::VectorImage<short, 3>>;
TYPED_TEST_SUITE(VertexFieldResamplePixels, ImageTypes);

TYPED_TEST(VertexFieldResamplePixels, HaveTheBitsOfTheCore) {
  const Geometry grid = turned_grid({21, 18, 15});
  const auto image = noise_image<TypeParam>(grid, {{0, 0, 0}}, 4);
  const auto field = twist_over(grid, 3);
  const auto filter = itk::VertexFieldResampleImageFilter<TypeParam>::New();
  filter->SetInput(image);
  filter->SetVertexField(field);
  filter->SetBackend("cpu");
  filter->Update();
  Report report;
  const auto expected = resampled_by_core(*image, grid, field->GetView(), {}, &report);
  EXPECT_TRUE(same_pixels(*filter->GetOutput(), *expected));
  EXPECT_FALSE(same_pixels(*filter->GetOutput(), *image));
  EXPECT_EQ(geometry_of(*filter->GetOutput()), grid);
  EXPECT_EQ(filter->GetReport().covered, report.covered);
  EXPECT_GT(report.uncovered, 0u);
  EXPECT_EQ(filter->GetUsedBackend(), "cpu");
}

TEST(VertexFieldResample, SettingsReachTheCore) {
  const Geometry grid = turned_grid({21, 18, 15});
  const auto image = noise_image<ShortImage>(grid);
  const auto field = twist_over(grid, 3);
  const auto filter = warp_of(image, field);
  filter->SetDefaultPixelValue(-1024);
  for (const Interpolation interpolation :
       {Interpolation::nearest, Interpolation::linear, Interpolation::cubic, Interpolation::vote}) {
    for (const std::optional<PaddingRange> padding : {std::optional<PaddingRange>{}, {{90, 100}}}) {
      filter->SetInterpolation(interpolation);
      padding ? filter->SetPadding(padding->low, padding->high) : filter->ClearPadding();
      filter->Update();
      Target settings;
      settings.interpolation = interpolation;
      settings.background = -1024;
      settings.padding = padding;
      const auto expected = resampled_by_core(*image, grid, field->GetView(), settings);
      EXPECT_TRUE(same_pixels(*filter->GetOutput(), *expected)) << interpolation << (padding ? " padded" : "");
    }
  }
}

TEST(VertexFieldResample, GridIsThatOfTheReferenceImage) {
  const Geometry grid = turned_grid({21, 18, 15});
  Geometry wanted = turned_grid({13, 17, 11});
  wanted.spacing = {1.2, 1, 0.8};
  wanted.origin = point_from_index(grid)({3, 2, 2});
  const auto image = noise_image<ShortImage>(grid);
  const auto reference = noise_image<ShortImage>(wanted, {{5, -7, 2}});
  const auto field = twist_over(grid, 3);
  const auto expected = resampled_by_core(*image, geometry_of(*reference), field->GetView());

  const auto by_image = warp_of(image, field);
  by_image->SetReferenceImage(reference);
  by_image->UseReferenceImageOn();
  by_image->Update();
  EXPECT_EQ(by_image->GetOutput()->GetLargestPossibleRegion(), reference->GetLargestPossibleRegion());
  EXPECT_EQ(by_image->GetOutput()->GetOrigin(), reference->GetOrigin());
  const auto bytes = expected->GetBufferedRegion().GetNumberOfPixels() * sizeof(short);
  EXPECT_EQ(std::memcmp(by_image->GetOutput()->GetBufferPointer(), expected->GetBufferPointer(), bytes), 0);

  const auto by_numbers = warp_of(image, field);
  by_numbers->SetOutputParametersFromImage(reference);
  by_numbers->Update();
  EXPECT_TRUE(same_pixels(*by_numbers->GetOutput(), *by_image->GetOutput()));
}

TEST(VertexFieldResample, FirstIndexOfTheInputDoesNotMatter) {
  const Geometry grid = turned_grid({21, 18, 15});
  const auto field = twist_over(grid, 3);
  const auto plain = warp_of(noise_image<ShortImage>(grid), field);
  const auto shifted = warp_of(noise_image<ShortImage>(grid, {{-4, 9, 100}}), field);
  shifted->SetOutputParametersFromImage(noise_image<ShortImage>(grid));
  plain->Update();
  shifted->Update();
  // ITK's origin is that of index 0, so the first voxel's place is rounded once more.
  std::size_t different = 0;
  const short *a = plain->GetOutput()->GetBufferPointer(), *b = shifted->GetOutput()->GetBufferPointer();
  for (std::int64_t n = 0; n < voxel_count(grid); ++n) {
    different += a[n] != b[n];
    ASSERT_LE(std::abs(a[n] - b[n]), 1) << n;
  }
  EXPECT_LT(different, static_cast<std::size_t>(voxel_count(grid) / 100));
}

TEST(VertexFieldResample, MeshInThePlaceOfALatticeGivesTheSame) {
  const Geometry grid = turned_grid({21, 18, 15});
  const auto image = noise_image<ShortImage>(grid);
  const VertexField lattice = twist(grid, 0.4, 4);
  VertexField mesh;
  mesh.mesh = mesh_of(lattice);
  const auto of_lattice = itk::VertexField::New(), of_mesh = itk::VertexField::New();
  of_lattice->SetField(lattice);
  of_mesh->SetField(std::move(mesh));
  const auto a = warp_of(image, of_lattice), b = warp_of(image, of_mesh);
  a->Update();
  b->Update();
  EXPECT_TRUE(same_pixels(*a->GetOutput(), *b->GetOutput()));
}

TEST(VertexFieldResample, BuffersAreUsedInPlace) {
  const Geometry grid = turned_grid({21, 18, 15});
  const auto image = noise_image<ShortImage>(grid);
  const auto filter = warp_of(image, twist_over(grid, 3));
  const auto mine = noise_image<ShortImage>(grid);
  const short* const pixels = mine->GetBufferPointer();
  filter->GraftOutput(mine);
  filter->Update();
  EXPECT_EQ(filter->GetOutput()->GetBufferPointer(), pixels);
  EXPECT_TRUE(same_pixels(*filter->GetOutput(), *mine));
  const auto alone = warp_of(image, twist_over(grid, 3));
  alone->Update();
  EXPECT_TRUE(same_pixels(*mine, *alone->GetOutput()));
}

TEST(VertexFieldResample, OutsideSaysWhatBecomesOfVoxelsBeyondTheLattice) {
  const Geometry grid = turned_grid({21, 18, 15});
  Geometry half = lattice_over(grid, 2);
  half.size.z = 4;  // up to slice 6
  const auto image = noise_image<ShortImage>(grid);
  const auto field = itk::VertexField::New();
  field->SetField({half, std::vector<glm::vec3>(static_cast<std::size_t>(voxel_count(half)))});
  const auto filter = warp_of(image, field);
  filter->SetDefaultPixelValue(-7);
  EXPECT_TRUE(says(itk_error_of([&] { filter->Update(); }), {"VertexFieldResampleImageFilter", "does not"}));
  filter->SetOutside(Outside::rest);
  filter->Update();
  EXPECT_TRUE(same_pixels(*filter->GetOutput(), *image));
  filter->SetOutside(Outside::background);
  filter->Update();
  EXPECT_EQ(filter->GetOutput()->GetPixel({{3, 3, 6}}), image->GetPixel({{3, 3, 6}}));
  EXPECT_EQ(filter->GetOutput()->GetPixel({{3, 3, 7}}), -7);
}

TEST(VertexFieldResample, ErrorsAreItksExceptions) {
  const Geometry grid = turned_grid({21, 18, 15});
  const auto image = noise_image<ShortImage>(grid);
  const auto without_field = Filter::New();
  without_field->SetInput(image);
  EXPECT_TRUE(says(itk_error_of([&] { without_field->Update(); }), {"VertexField"}));
  const auto empty = warp_of(image, itk::VertexField::New());
  EXPECT_TRUE(says(itk_error_of([&] { empty->Update(); }), {"there is no field"}));

  VertexField broken = twist(grid, 0.4, 3);
  broken.displacement[77].y = NAN;
  const auto field = itk::VertexField::New();
  field->SetField(std::move(broken));
  const auto filter = warp_of(image, field);
  EXPECT_TRUE(says(itk_error_of([&] { filter->Update(); }), {"finite"}));
  EXPECT_TRUE(says(itk_error_of([&] { filter->SetBackend("gpu"); }), {"\"gpu\"", "auto, cpu or cuda"}));
  filter->UseReferenceImageOn();
  EXPECT_TRUE(says(itk_error_of([&] { filter->Update(); }), {"no reference image"}));
  filter->UseReferenceImageOff();
  filter->SetVertexField(twist_over(grid, 3));  // and works again
  filter->Update();
  EXPECT_EQ(itk_error_of([&] { filter->Update(); }), "");
}

TEST(VertexFieldResample, UnequalComponentsOfTheDefaultPixelValueAreRefused) {
  using Color = itk::Image<itk::RGBPixel<unsigned char>, 3>;
  const Geometry grid = turned_grid({9, 8, 7});
  const auto filter = itk::VertexFieldResampleImageFilter<Color>::New();
  filter->SetInput(noise_image<Color>(grid));
  filter->SetVertexField(twist_over(grid, 3, 1.5));
  filter->SetBackend("cpu");
  Color::PixelType value;
  value.Set(1, 2, 3);
  filter->SetDefaultPixelValue(value);
  EXPECT_TRUE(says(itk_error_of([&] { filter->Update(); }), {"unequal components"}));
  value.Set(9, 9, 9);
  filter->SetDefaultPixelValue(value);
  filter->Update();
  EXPECT_EQ(filter->GetOutput()->GetPixel({{0, 0, 0}}), value);
}

}  // namespace
}  // namespace tetwarp::test
