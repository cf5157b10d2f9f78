// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Jacobian determinants, coverage and folds, beside ITK's DisplacementFieldJacobianDeterminantFilter.
#include <gtest/gtest.h>
#include <itkDisplacementFieldJacobianDeterminantFilter.h>
#include <itkLinearInterpolateImageFunction.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "deform/fields/formula.h"
#include "deform/fields/lattice_mesh.h"
#include "itkbridge/itkVertexFieldToCoverageFilter.h"
#include "itkbridge/itkVertexFieldToFoldsFilter.h"
#include "itkbridge/itkVertexFieldToInverseDisplacementFieldFilter.h"
#include "itkbridge/itkVertexFieldToJacobianDeterminantFilter.h"
#include "tests/itkbridge/itk_fields.h"
#include "tests/support/run.h"
#include "tests/support/says.h"

namespace tetwarp::test {
namespace {

using Jacobian = itk::VertexFieldToJacobianDeterminantFilter<>;
using Coverage = itk::VertexFieldToCoverageFilter<>;
using Folds = itk::VertexFieldToFoldsFilter<>;
using Inverse = itk::VertexFieldToInverseDisplacementFieldFilter<>;

template <class TFilter>
auto map_image(const Geometry& output, const VertexField& field, Outside outside = Outside::background) {
  const auto filter = TFilter::New();
  filter->SetVertexField(itk_field(field));
  filter->SetReferenceImage(grid_image(output));
  filter->UseReferenceImageOn();
  filter->SetOutside(outside);
  filter->Update();
  return typename TFilter::OutputImageType::Pointer(filter->GetOutput());
}

template <class TFilter>
auto map_of(const Geometry& output, const VertexField& field, Outside outside = Outside::background) {
  return pixels_of(*map_image<TFilter>(output, field, outside));
}

/// ITK's determinants of a displacement image.
FloatImage::Pointer jacobian_by_itk(const FieldImage& image) {
  const auto filter = itk::DisplacementFieldJacobianDeterminantFilter<FieldImage, double, FloatImage>::New();
  filter->SetInput(&image);
  filter->Update();
  return filter->GetOutput();
}
FloatImage::Pointer jacobian_by_itk(const VertexField& field) {
  return jacobian_by_itk(*field_image(field.lattice, field.displacement));
}

bool is_at_border(const Geometry& grid, const glm::i64vec3& voxel) {
  return !contains({glm::i64vec3(1), grid.size - std::int64_t{1}}, {voxel, voxel + std::int64_t{1}});
}

/// x -> linear (x - centre) + centre, on a vertex every `cell_size` voxels.
VertexField affine_field(const Geometry& volume, const glm::dmat3& linear, std::int64_t cell_size) {
  const glm::dvec3 c = centre(volume);
  return sample_on(lattice_over(volume, cell_size), [&](const glm::dvec3& x) { return linear * (x - c) - (x - c); });
}

/// Entries that float and 2^-12 voxel hold, so that every determinant is exact but for float's rounding.
const glm::dmat3 kLinear(1.125, 0.0625, -0.03125, 0.125, 0.875, 0.0625, -0.0625, 0.03125, 1.25);

TEST(JacobianDeterminant, OfAnAffineFieldIsItks) {
  const Geometry grid = unit_grid({17, 15, 13});
  const VertexField field = affine_field(grid, kLinear, 1);
  const std::vector<float> ours = map_of<Jacobian>(grid, field), itks = pixels_of(*jacobian_by_itk(field));
  const double expected = glm::determinant(kLinear);
  std::size_t owned = 0;
  for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
    ASSERT_TRUE(is_at_border(grid, voxel) || std::abs(itks[n] - expected) < 1e-6) << itks[n];
    if (std::isnan(ours[n])) return;
    ASSERT_NEAR(ours[n], expected, 1e-6) << to_string(voxel);
    ++owned;
  });
  EXPECT_GT(owned, 2000u);
}

/// For any matrix and grid, vertices are rounded by up to 2^-13 voxel, so differences over a cell of B voxels by up to
/// 2^-12 / B.
TEST(JacobianDeterminant, OfAnAffineFieldIsRightOnAnyGrid) {
  const glm::dmat3 linear = rotation({1, -2, 1}, 0.2) * glm::dmat3(1.1, 0, 0, 0.07, 0.93, 0, 0, 0.12, 1.21);
  for (const std::int64_t cell_size : {1, 4}) {
    const Geometry grid = oblique_grid({17, 15, 13});
    const std::vector<float> ours = map_of<Jacobian>(grid, affine_field(grid, linear, cell_size));
    for (const float determinant : ours) {
      if (std::isnan(determinant)) continue;
      ASSERT_NEAR(determinant, glm::determinant(linear), 3 * 2 * std::ldexp(1, -12) / static_cast<double>(cell_size));
    }
    EXPECT_LT(std::ranges::count_if(ours, [](float j) { return std::isnan(j); }), 1000);
  }
}

/// ITK takes differences along i, j and k and adds one to those of x, y and z: det(1 + G D) of the gradient G, where D
/// is the direction. It is right where D is the identity.
TEST(JacobianDeterminant, ItksIsWrongOnAnObliqueGrid) {
  const Geometry grid = oblique_grid({11, 12, 13});
  const VertexField field = affine_field(grid, kLinear, 1);
  const std::vector<float> itks = pixels_of(*jacobian_by_itk(field)), ours = map_of<Jacobian>(grid, field);
  const double right = glm::determinant(kLinear);
  const double theirs = glm::determinant(glm::dmat3(1) + (kLinear - glm::dmat3(1)) * grid.direction);
  ASSERT_GT(std::abs(theirs - right), 0.02);
  const std::size_t middle = offset_of(grid, {5, 6, 6});
  EXPECT_NEAR(itks[middle], theirs, 1e-5);
  EXPECT_NEAR(ours[middle], right, 2e-3);
}

/// Beyond the border ITK repeats the outermost vector, so that half of the difference is missing.
TEST(JacobianDeterminant, ItksMissesHalfOfTheChangeAtTheBorder) {
  const Geometry grid = unit_grid({9, 8, 7});
  const VertexField field = affine_field(grid, glm::dmat3(1.5, 0, 0, 0, 1, 0, 0, 0, 1), 1);
  const std::vector<float> itks = pixels_of(*jacobian_by_itk(field)), ours = map_of<Jacobian>(grid, field);
  for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
    ASSERT_EQ(itks[n], voxel.x == 0 || voxel.x == 8 ? 1.25f : 1.5f) << to_string(voxel);
    ASSERT_EQ(ours[n], 1.5f) << to_string(voxel);
  });
}

struct Differences {
  double from_forward = 0, from_inverse = 0;
};

const Bubble kBubble{20, 0.4, glm::dvec3(23.7, 24.1, 24.4)};

/// The largest differences of our determinants of a bubble in cells of `h` mm from ITK's: of the forward field, at the
/// undeformed place; and of the inverse field, the reciprocal at the voxel itself.
Differences bubble_differences(double h) {
  Geometry grid;
  grid.size = glm::i64vec3(static_cast<std::int64_t>(48 / h) + 1);
  grid.spacing = glm::dvec3(h);
  const VertexField field = sample_on(grid, kBubble);
  const std::vector<float> ours = map_of<Jacobian>(grid, field);
  const auto inverse = map_image<Inverse>(grid, field);
  const std::vector<glm::vec3> by = pixels_of(*inverse);
  const std::vector<float> of_inverse = pixels_of(*jacobian_by_itk(*inverse));
  const auto of_forward = itk::LinearInterpolateImageFunction<FloatImage, double>::New();
  of_forward->SetInputImage(jacobian_by_itk(field));
  Differences largest;
  const AffineMap place = point_from_index(grid);
  for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
    const double undeformed = of_forward->Evaluate(itk_point(place(glm::dvec3(voxel)) + glm::dvec3(by[n])));
    largest.from_forward = std::max(largest.from_forward, std::abs(ours[n] - undeformed));
    largest.from_inverse = std::max(largest.from_inverse, std::abs(ours[n] - 1.0 / of_inverse[n]));
    if (!std::isfinite(ours[n] + undeformed + of_inverse[n])) largest = {INFINITY, INFINITY};
  });
  return largest;
}

/// A determinant that is constant in each tetrahedron, and differences over two cells, are off by what the true one
/// changes over a cell: they near each other as the cells shrink, with the first power. The determinant of a bubble
/// changes most at its centre, by 8 a (1 + a)^2 / R.
TEST(JacobianDeterminant, OfABubbleNearsItksAsTheCellsShrink) {
  const double a = kBubble.strength, steepest = 8 * a * (1 + a) * (1 + a) / kBubble.radius;
  Differences coarser{INFINITY, INFINITY};
  for (const double h : {2.0, 1.0, 0.5}) {
    const Differences found = bubble_differences(h);
    EXPECT_LT(found.from_forward, steepest * h) << h;
    EXPECT_LT(found.from_inverse, steepest * h) << h;
    EXPECT_LT(found.from_forward, 0.67 * coarser.from_forward) << h;
    EXPECT_LT(found.from_inverse, 0.67 * coarser.from_inverse) << h;
    coarser = found;
  }
}

/// Along i only: the mirrored sheet 8 > i > 4 of cells 0 to 3 has the lower numbers, the sheet 4 < i < 12 of cells 4 to
/// 7 is twice as long, and cells 8 to 11 leave the volume.
VertexField folded(const Geometry& grid) {
  VertexField field{lattice_over(grid, 1), {}};
  for_each_voxel(field.lattice, [&](const glm::i64vec3& at, std::size_t) {
    const auto i = static_cast<float>(at.x);
    const float to = i <= 4 ? 8 - i : (i <= 8 ? 2 * i - 4 : i + 4);
    field.displacement.emplace_back(to - i, 0, 0);
  });
  return field;
}

TEST(FieldMaps, OfAFoldTellTheSheetOfTheLowestNumber) {
  const Geometry grid = unit_grid({13, 6, 5});
  const VertexField field = folded(grid);
  const std::vector<float> jacobian = map_of<Jacobian>(grid, field, Outside::refuse);
  const std::vector<unsigned char> coverage = map_of<Coverage>(grid, field, Outside::refuse);
  const std::vector<unsigned short> folds = map_of<Folds>(grid, field, Outside::refuse);
  for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
    SCOPED_TRACE(to_string(voxel));
    const float expected = voxel.x <= 8 ? -1 : 2;  // negative where the sheet is mirrored
    ASSERT_TRUE(voxel.x < 4 ? std::isnan(jacobian[n]) : jacobian[n] == expected) << jacobian[n];
    ASSERT_EQ(coverage[n], voxel.x >= 4);
    ASSERT_EQ(folds[n], voxel.x < 4 ? 0 : (voxel.x <= 8 ? 2 : 1));
  });
}

/// ITK's determinant tells whether the undeformed place is mirrored, so it is negative at other voxels.
TEST(FieldMaps, OfAFoldItksSpeaksOfTheUndeformedPlace) {
  const Geometry grid = unit_grid({13, 6, 5});
  const std::vector<float> itks = pixels_of(*jacobian_by_itk(folded(grid)));
  const std::vector<float> expected = {0, -1, -1, -1, 0.5f, 2, 2, 2, 1.5f, 1, 1, 1, 1};
  for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
    ASSERT_EQ(itks[n], expected[static_cast<std::size_t>(voxel.x)]) << to_string(voxel);
  });
}

/// Two blocks that shared a face are drawn apart by 4.5 mm: between them lies nothing, which differences cannot say.
TEST(FieldMaps, OfATearSayThatNothingIsThere) {
  const Geometry grid = unit_grid({16, 6, 5});
  TetrahedralMesh torn;
  for (const double from : {0, 6}) {
    Geometry block = grid;
    block.size.x = 7;
    block.origin.x = from;
    const TetrahedralMesh half = mesh_of(uniform_field(block, glm::vec3(from > 0 ? 4.5f : 0, 0, 0)));
    const auto first = static_cast<std::uint32_t>(torn.rest.size());
    torn.rest.insert(torn.rest.end(), half.rest.begin(), half.rest.end());
    torn.displacement.insert(torn.displacement.end(), half.displacement.begin(), half.displacement.end());
    for (const glm::u32vec4& t : half.tetrahedra) torn.tetrahedra.push_back(t + first);
  }
  const VertexField field{.lattice = {}, .displacement = {}, .mesh = torn};
  const std::vector<float> jacobian = map_of<Jacobian>(grid, field);
  const std::vector<unsigned char> coverage = map_of<Coverage>(grid, field);
  const std::vector<unsigned short> folds = map_of<Folds>(grid, field);
  for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
    SCOPED_TRACE(to_string(voxel));
    const bool is_there = voxel.x <= 6 || voxel.x >= 11;
    ASSERT_TRUE(is_there ? jacobian[n] == 1 : std::isnan(jacobian[n])) << jacobian[n];
    ASSERT_EQ(coverage[n], is_there);
    ASSERT_EQ(folds[n], is_there);
  });
  VertexField dense = uniform_field(grid, glm::vec3(0));
  for_each_voxel(grid, [&](const glm::i64vec3& at, std::size_t n) { dense.displacement[n].x = at.x > 6 ? 4.5f : 0; });
  const std::vector<float> itks = pixels_of(*jacobian_by_itk(dense));
  for (std::int64_t i = 0; i < 16; ++i)
    EXPECT_EQ(itks[offset_of(grid, {i, 3, 2})], i == 6 || i == 7 ? 3.25f : 1.0f) << "beside the tear";
}

TEST(FieldMaps, OutsideTheLatticeVoxelsRestOrHaveNothing) {
  const Geometry grid = unit_grid({20, 6, 5});
  Geometry lattice = grid;
  lattice.origin.x = 8;
  lattice.size.x = 5;
  const VertexField field = uniform_field(lattice, glm::vec3(2.5f, 0, 0));
  for (const Outside outside : {Outside::rest, Outside::background}) {
    const std::vector<float> jacobian = map_of<Jacobian>(grid, field, outside);
    const std::vector<unsigned char> coverage = map_of<Coverage>(grid, field, outside);
    const std::vector<unsigned short> folds = map_of<Folds>(grid, field, outside);
    for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
      SCOPED_TRACE(to_string(voxel));
      const bool owned = voxel.x >= 11 && voxel.x <= 14, left = voxel.x >= 8 && voxel.x <= 10;
      const bool is_there = owned || (!left && outside == Outside::rest);
      ASSERT_TRUE(is_there ? jacobian[n] == 1 : std::isnan(jacobian[n])) << jacobian[n];
      ASSERT_EQ(coverage[n], is_there);
      ASSERT_EQ(folds[n], owned) << "what rests outside belongs to no tetrahedron";
    });
  }
  EXPECT_TRUE(says(refusal_by_itk([&] { map_of<Folds>(grid, field, Outside::refuse); }), {"does not reach"}));
}

TEST(FieldMaps, WithoutAGridAreRefused) {
  const auto filter = Jacobian::New();
  filter->SetVertexField(itk_field(uniform_field(unit_grid({4, 4, 4}), glm::vec3(0))));
  EXPECT_TRUE(says(refusal_by_itk([&] { filter->Update(); }), {"no output grid", "reference image"}));
  filter->UseReferenceImageOn();
  EXPECT_TRUE(says(refusal_by_itk([&] { filter->Update(); }), {"UseReferenceImage is on", "no reference image"}));
  EXPECT_TRUE(says(refusal_by_itk([&] { Jacobian::New()->Update(); }), {"VertexField", "required"}));
}

}  // namespace
}  // namespace tetwarp::test
