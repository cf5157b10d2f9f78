// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <gtest/gtest.h>

#include "itkbridge/itkVertexFieldResampleAdjointImageFilter.h"
#include "itkbridge/itkVertexFieldResampleImageFilter.h"
#include "tests/itkbridge/filter_case.h"
#include "tests/support/says.h"

namespace tetwarp::test {
namespace {

using FloatImage = itk::Image<float, 3>;
using Adjoint = itk::VertexFieldResampleAdjointImageFilter<FloatImage>;

double dot(const FloatImage& a, const FloatImage& b) {
  double sum = 0;
  const auto count = a.GetBufferedRegion().GetNumberOfPixels();
  for (std::size_t n = 0; n < count; ++n)
    sum += static_cast<double>(a.GetBufferPointer()[n]) * static_cast<double>(b.GetBufferPointer()[n]);
  return sum;
}

Adjoint::Pointer adjoint_of(const FloatImage* gradient, const itk::VertexField* field) {
  const auto filter = Adjoint::New();
  filter->SetInput(gradient);
  filter->SetVertexField(field);
  filter->SetBackend("cpu");
  return filter;
}

TEST(VertexFieldAdjoint, IsTheTransposeOfTheResampleFilterOnOtherGrids) {
  const Geometry grid = turned_grid({21, 18, 15});
  Geometry deformed = turned_grid({13, 17, 11});
  deformed.spacing = {1.2, 1, 0.8};
  deformed.origin = point_from_index(grid)({3, 2, 2});
  const auto x = noise_image<FloatImage>(grid), y = noise_image<FloatImage>(deformed);
  for (const std::int64_t cell : {1, 3}) {
    const auto field = twist_over(grid, cell);
    for (const Interpolation interpolation : {Interpolation::linear, Interpolation::nearest, Interpolation::cubic}) {
      const auto forward = itk::VertexFieldResampleImageFilter<FloatImage>::New();
      forward->SetInput(x);
      forward->SetVertexField(field);
      forward->SetOutputParametersFromImage(y);
      forward->SetInterpolation(interpolation);
      forward->SetBackend("cpu");
      forward->Update();
      const auto back = adjoint_of(y, field);
      back->SetOutputParametersFromImage(x);
      back->SetInterpolation(interpolation);
      back->Update();
      EXPECT_EQ(geometry_of(*back->GetOutput()), grid);
      EXPECT_EQ(back->GetUsedBackend(), "cpu");
      EXPECT_TRUE(back->GetDisplacementGradient().empty());
      const double wanted = dot(*forward->GetOutput(), *y);
      EXPECT_NEAR(dot(*back->GetOutput(), *x), wanted, 1e-6 * wanted) << interpolation << ", cells of " << cell;
    }
  }
}

TEST(VertexFieldAdjoint, TheGradientOfTheDisplacementHasTheBitsOfTheCore) {
  const Geometry grid = turned_grid({21, 18, 15});
  const auto source = noise_image<FloatImage>(grid), given = noise_image<FloatImage>(grid);
  const auto field = twist_over(grid, 3);
  const auto filter = adjoint_of(given, field);
  filter->SetSourceImage(source);
  filter->Update();
  const auto core = make_cpu_adjoint(grid);
  core->set_field(field->GetView());
  std::vector<glm::vec3> expected(static_cast<std::size_t>(vertex_count(field->GetView())));
  const AdjointTarget target{.source = view_of(*source, grid), .output_gradient = view_of(*given, grid)};
  core->apply({&target, 1}, {expected});
  EXPECT_EQ(filter->GetDisplacementGradient(), expected);
  EXPECT_GT(std::count_if(expected.begin(), expected.end(), [](const glm::vec3& g) { return g != glm::vec3(0); }), 100);
}

TEST(VertexFieldAdjoint, RefusesAGridThatIsNotTheSourceImages) {
  const Geometry grid = turned_grid({21, 18, 15});
  const auto given = noise_image<FloatImage>(grid), other = noise_image<FloatImage>(turned_grid({9, 9, 9}));
  const auto filter = adjoint_of(given, twist_over(grid, 3));
  filter->SetSourceImage(given);
  filter->SetOutputParametersFromImage(other);
  EXPECT_TRUE(says(itk_error_of([&] { filter->Update(); }), {"not that of the source image"}));
  const auto nearest = adjoint_of(given, twist_over(grid, 3));
  nearest->SetSourceImage(given);
  nearest->SetInterpolation(Interpolation::nearest);
  EXPECT_TRUE(says(itk_error_of([&] { nearest->Update(); }), {"nearest", "linear"}));
}

}  // namespace
}  // namespace tetwarp::test
