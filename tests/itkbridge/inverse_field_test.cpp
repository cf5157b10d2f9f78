// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Exact inverses of forward fields, beside the core, the program, ITK's own inverter and ITK's resampler.
#include <gtest/gtest.h>
#include <itkInvertDisplacementFieldImageFilter.h>

#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "deform/fields/formula.h"
#include "io/field_file.h"
#include "io/image_file.h"
#include "itkbridge/itkExactInvertDisplacementFieldImageFilter.h"
#include "itkbridge/itkVertexFieldResampleImageFilter.h"
#include "itkbridge/itkVertexFieldToInverseDisplacementFieldFilter.h"
#include "itkbridge/itkVertexFieldTransform.h"
#include "tests/itkbridge/itk_resampler.h"
#include "tests/support/program.h"
#include "tests/support/run.h"
#include "tests/support/scratch.h"

namespace tetwarp::test {
namespace {

using Inverse = itk::VertexFieldToInverseDisplacementFieldFilter<>;
using ExactInvert = itk::ExactInvertDisplacementFieldImageFilter<FieldImage>;

Geometry volume_grid() { return oblique_grid({24, 20, 18}); }

/// The inverse as the core gives it.
std::vector<glm::vec3> inverse_by_core(const Geometry& output, const VertexField& field) {
  const auto resampler = make_cpu_resampler(output);
  resampler->set_field(view(field, Outside::background));
  return run(*resampler, poisoned<std::uint8_t>(output)).inverse_mm.voxels;
}

FieldImage::Pointer inverse_by_filter(const itk::ImageBase<3>& output, const VertexField& field,
                                      Outside outside = Outside::background) {
  const auto filter = Inverse::New();
  filter->SetVertexField(itk_field(field));
  filter->SetOutputParametersFromImage(&output);
  filter->SetOutside(outside);
  filter->Update();
  return filter->GetOutput();
}

bool is_nan(const glm::vec3& v) { return std::isnan(v.x) && std::isnan(v.y) && std::isnan(v.z); }

TEST(InverseDisplacementField, IsTheCoresBitForBit) {
  const VertexField field = shaken(volume_grid(), 4);
  const auto image = grid_image(volume_grid(), kFarStart);
  const std::vector<glm::vec3> expected = inverse_by_core(geometry_of(*image), field);
  EXPECT_TRUE(same_bits(expected, pixels_of(*inverse_by_filter(*image, field))));
  EXPECT_GT(std::ranges::count_if(expected, is_nan), 100);
  EXPECT_GT(expected.size() - std::ranges::count_if(expected, is_nan), 5000U);
}

TEST(ExactInvert, IsTheCoresBitForBitOnItsOwnGridAndAnother) {
  const VertexField field = shaken(volume_grid(), 4);
  const auto exact = ExactInvert::New();
  exact->SetInput(field_image(field.lattice, field.displacement));
  exact->Update();
  EXPECT_EQ(geometry_of(*exact->GetOutput()), field.lattice);
  EXPECT_TRUE(same_bits(inverse_by_core(field.lattice, field), pixels_of(*exact->GetOutput())));
  exact->SetOutputParametersFromImage(grid_image(volume_grid()));
  exact->UpdateLargestPossibleRegion();
  const std::vector<glm::vec3> expected = inverse_by_core(volume_grid(), field);
  EXPECT_TRUE(same_bits(expected, pixels_of(*exact->GetOutput())));
  const auto of_doubles = itk::ExactInvertDisplacementFieldImageFilter<DoubleFieldImage>::New();
  of_doubles->SetInput(field_image<double>(field.lattice, field.displacement));
  of_doubles->SetOutputParametersFromImage(grid_image(volume_grid()));
  of_doubles->Update();
  EXPECT_TRUE(same_bits(expected, pixels_of(*of_doubles->GetOutput())));
}

TEST(ExactInvert, SeesThatItsInputWasChanged) {
  const VertexField field = shaken(volume_grid(), 4, 1), other = shaken(volume_grid(), 4, 2);
  const auto image = field_image(field.lattice, field.displacement);
  const auto exact = ExactInvert::New();
  exact->SetInput(image);
  exact->Update();
  for (std::size_t n = 0; n < other.displacement.size(); ++n)
    image->GetBufferPointer()[n] = itk_vector<float>(other.displacement[n]);
  image->Modified();
  exact->Update();
  EXPECT_TRUE(same_bits(inverse_by_core(other.lattice, other), pixels_of(*exact->GetOutput())));
}

TEST(ExactInvert, KeepsTheStartIndexOfItsInput) {
  const VertexField field = shaken(volume_grid(), 1);
  const auto image = field_image(field.lattice, field.displacement, kFarStart);
  const auto exact = ExactInvert::New();
  exact->SetInput(image);
  exact->Update();
  EXPECT_EQ(exact->GetOutput()->GetLargestPossibleRegion(), image->GetLargestPossibleRegion());
  VertexField moved = field;
  moved.lattice = geometry_of(*image);
  EXPECT_TRUE(same_bits(inverse_by_core(moved.lattice, moved), pixels_of(*exact->GetOutput())));
}

TEST(InverseDisplacementField, IsWhatTheProgramWrites) {
  const Scratch scratch;
  write_image(scratch / "x.mha", AnyVolume(volume_grid(), VoxelType::u8).view());
  write_field_file(scratch / "f.mha", shaken(volume_grid(), 4));
  const auto run = run_tetwarp(scratch.path(), "invert f.mha --like x.mha -o inverse.mha --backend cpu");
  ASSERT_EQ(run.status, 0) << run.err;
  const PullField expected = read_pull_field(scratch / "inverse.mha");
  const VertexField field = read_forward_field(scratch / "f.mha");
  const auto image = grid_image(read_image_header(scratch / "x.mha").geometry);
  EXPECT_TRUE(same_bits(expected.displacement, pixels_of(*inverse_by_filter(*image, field))));
}

/// Moves each voxel to where it comes from and forward again. What differs then is rounding to 2^-12 voxel and to
/// float.
TEST(InverseDisplacementField, ForwardMapReturnsToTheVoxel) {
  const Geometry grid = volume_grid();
  const double step = glm::length(grid.spacing) / 4096;  // mm, of 2^-12 voxel on each axis
  for (const std::int64_t cell_size : {1, 4}) {
    const VertexField field = shaken(grid, cell_size);
    const auto image = grid_image(grid);
    const auto inverse = inverse_by_filter(*image, field);
    const auto forward = itk::VertexFieldTransform::New();
    forward->SetVertexField(itk_field(field), image);
    double largest = 0;
    std::size_t returned = 0;
    const std::vector<glm::vec3> by = pixels_of(*inverse);
    for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
      if (is_nan(by[n])) return;
      const glm::dvec3 p = point_from_index(grid)(glm::dvec3(voxel));
      const itk::Point<double, 3> from = itk_point(p + glm::dvec3(by[n]));
      if (!forward->IsInside(from)) return;  // by rounding, at the border
      largest = std::max(largest, glm::distance(glm_of(forward->TransformPoint(from)), p));
      ++returned;
    });
    EXPECT_GT(returned, 5000u);
    EXPECT_LT(largest, step) << "cells of " << cell_size;
  }
}

struct Errors {
  double mean = 0, largest = 0;
};

/// How far an inverse is from the true one, mm, over the voxels that have a source on the grid. Infinite for NaN.
Errors errors_of(const FieldImage& inverse, const PointMap& truth) {
  const Geometry grid = geometry_of(inverse);
  const AffineMap index = index_from_point(grid);
  const glm::dvec3 least(1e-3), most = glm::dvec3(grid.size - std::int64_t{1}) - least;
  const std::vector<glm::vec3> by = pixels_of(inverse);
  Errors errors;
  std::size_t count = 0;
  for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
    const glm::dvec3 p = point_from_index(grid)(glm::dvec3(voxel)), true_by = truth(p), at = index(p + true_by);
    if (glm::clamp(at, least, most) != at) return;
    const double off = glm::distance(true_by, glm::dvec3(by[n]));
    errors.mean += std::isfinite(off) ? off : INFINITY;
    errors.largest = std::max(errors.largest, std::isfinite(off) ? off : INFINITY);
    ++count;
  });
  errors.mean /= static_cast<double>(count);
  return errors;
}

struct Inverters {
  Errors ours, itks, itks_longer;  ///< with ITK's defaults; after 200 iterations, the border not held at zero
};

/// A forward map sampled on a vertex at every voxel, inverted.
Inverters inverted(const Geometry& grid, const PointMap& forward, const PointMap& truth) {
  const auto image = field_image(grid, sample_on(grid, forward).displacement);
  const auto exact = ExactInvert::New();
  exact->SetInput(image);
  exact->Update();
  const auto itks = itk::InvertDisplacementFieldImageFilter<FieldImage>::New();
  itks->SetInput(image);
  itks->Update();
  const auto longer = itk::InvertDisplacementFieldImageFilter<FieldImage>::New();
  longer->SetInput(image);
  longer->SetEnforceBoundaryCondition(false);
  longer->SetMaximumNumberOfIterations(200);
  longer->SetMeanErrorToleranceThreshold(1e-7f);
  longer->SetMaxErrorToleranceThreshold(1e-7f);
  longer->Update();
  return {errors_of(*exact->GetOutput(), truth), errors_of(*itks->GetOutput(), truth),
          errors_of(*longer->GetOutput(), truth)};
}

/// The true inverse of a twist is the twist back, and a vertex on every voxel says it but for the rounding to 2^-12
/// voxel.
TEST(ExactInvert, OfATwistIsRightWhereItksIterationIsVoxelsOff) {
  const Geometry grid = unit_grid({32, 32, 32});
  const auto twist = [&](double angle) { return Twist{angle, half_length(grid, 2), 2, centre(grid)}; };
  const Inverters found = inverted(grid, twist(1), twist(-1));
  EXPECT_LT(found.ours.largest, 1.0 / 4096);
  EXPECT_GT(found.itks.mean, 1000 * found.ours.mean);
  EXPECT_GT(found.itks.largest, 5);
  EXPECT_GT(found.itks_longer.largest, 5) << "more iterations do not help";
}

/// The displacement back to where a point of a bubble comes from: its radial profile, inverted by bisection.
PointMap inverse_of(const Bubble& bubble) {
  return [bubble](const glm::dvec3& point) {
    const glm::dvec3 d = point - bubble.centre;
    const double r = glm::length(d);
    if (r == 0 || r >= bubble.radius) return glm::dvec3(0);
    double low = 0, high = bubble.radius;
    for (int n = 0; n < 60; ++n) {
      const double middle = (low + high) / 2, left = 1 - middle / bubble.radius;
      ((1 + bubble.strength * left * left) * middle < r ? low : high) = middle;
    }
    return d * (low / r - 1);
  };
}

/// A bubble bends: a field of tetrahedra is off by the square of the cells, and a trilinear one, of which ITK finds the
/// inverse, about as much. ITK stops before that: as soon as the mean residual is below 0.001 voxel or the largest
/// below 0.1.
TEST(ExactInvert, OfABubbleIsAsCloseAsItksIterationComesInTheEnd) {
  const Geometry grid = unit_grid({40, 40, 40});
  const Bubble bubble{17, 0.3, centre(grid)};
  const Inverters found = inverted(grid, bubble, inverse_of(bubble));
  EXPECT_GT(found.itks.mean, 3 * found.ours.mean);
  EXPECT_GT(found.itks.largest, 3 * found.ours.largest);
  EXPECT_NEAR(found.itks_longer.mean / found.ours.mean, 1, 0.2);
  EXPECT_NEAR(found.itks_longer.largest / found.ours.largest, 1, 0.2);
}

TEST(InverseDisplacementField, IsNanWhereNothingMaps) {
  const Geometry grid = unit_grid({20, 12, 10});
  const VertexField field = uniform_field(lattice_over(grid, 1), glm::vec3(5.5f, 0, 0));
  const auto by = pixels_of(*inverse_by_filter(*grid_image(grid), field, Outside::refuse));
  for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
    if (voxel.x <= 5)
      ASSERT_TRUE(is_nan(by[n])) << to_string(voxel);
    else
      ASSERT_EQ(by[n], glm::vec3(-5.5f, 0, 0)) << to_string(voxel);
  });
}

/// Voxels that the undeformed lattice does not hold: NaN with background; with rest they come from where they are.
TEST(InverseDisplacementField, OutsideTheLatticeItIsZeroWithRestAndNanWithBackground) {
  const Geometry grid = unit_grid({20, 12, 10});
  Geometry lattice = grid;
  lattice.origin.x = 8;
  lattice.size.x = 5;
  const VertexField field = uniform_field(lattice, glm::vec3(2.5f, 0, 0));
  EXPECT_THROW(inverse_by_filter(*grid_image(grid), field, Outside::refuse), itk::ExceptionObject);
  for (const Outside outside : {Outside::rest, Outside::background}) {
    const auto by = pixels_of(*inverse_by_filter(*grid_image(grid), field, outside));
    for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
      if (voxel.x >= 11 && voxel.x <= 14)
        ASSERT_EQ(by[n], glm::vec3(-2.5f, 0, 0)) << to_string(voxel);
      else if ((voxel.x >= 8 && voxel.x <= 10) || outside == Outside::background)
        ASSERT_TRUE(is_nan(by[n])) << to_string(voxel);
      else
        ASSERT_EQ(by[n], glm::vec3(0)) << to_string(voxel);
    });
  }
}

constexpr float kNothing = -7777;  // value of voxels that come from nowhere

/// An image by a forward field.
std::vector<float> resampled_by_us(const FloatImage& image, const VertexField& field) {
  const auto resample = itk::VertexFieldResampleImageFilter<FloatImage>::New();
  resample->SetInput(&image);
  resample->SetVertexField(itk_field(field));
  resample->SetDefaultPixelValue(kNothing);
  resample->Update();
  return pixels_of(*resample->GetOutput());
}

FloatImage::Pointer noise(const Geometry& grid) {
  Random random(9);
  return image_with<FloatImage>(
      grid, [&](const glm::dvec3&) { return static_cast<float>(random.real(-1000, 1000)); }, kFarStart);
}

/// ITK adds our inverse to the point in double and samples there; Tetwarp samples at the place that the inverse was
/// made of. The places differ by the rounding to float of an offset of up to 8 voxels, in voxels and in mm: below
/// 2^-20 voxel an axis. Linear interpolation in float is off by less than 2^-21 of the largest value.
///
/// NaN is made a place far outside first; why, the next test shows.
TEST(InverseDisplacementField, InItksResamplerGivesWhatVertexFieldResampleGives) {
  const Geometry grid = volume_grid();
  const VertexField field = shaken(grid, 4);
  const auto image = noise(grid);
  const auto inverse = inverse_by_filter(*image, field);
  const std::vector<glm::vec3> by = pixels_of(*inverse);
  std::vector<glm::vec3> filled = by;
  std::ranges::replace_if(filled, is_nan, glm::vec3(1e5f));
  const std::vector<float> a = resampled_by_us(*image, field);
  const std::vector<float> b = resampled_by_itk(*image, *field_image<double>(grid, filled, kFarStart), kNothing);
  const double tolerance = 3 * 2000 * std::ldexp(1, -20) + 1000 * std::ldexp(1, -21);
  const AffineMap place = point_from_index(grid), index = index_from_point(grid);
  std::size_t compared = 0, outside = 0;
  for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
    if (is_nan(by[n])) {
      ASSERT_EQ(a[n], kNothing);
      ASSERT_EQ(b[n], kNothing);
      ++outside;
      return;
    }
    // At the very end of a border of half a voxel, rounding decides who still has a value.
    const glm::dvec3 at = index(place(glm::dvec3(voxel)) + glm::dvec3(by[n]));
    const glm::dvec3 beyond = glm::max(-at, at - glm::dvec3(grid.size - std::int64_t{1}));
    if (std::abs(std::max({beyond.x, beyond.y, beyond.z}) - 0.5) < 1e-4) return;
    ASSERT_NEAR(a[n], b[n], tolerance) << to_string(voxel);
    ++compared;
  });
  EXPECT_GT(compared, 5000u);
  EXPECT_GT(outside, 100u);
}

/// ITK's interpolator takes the point of a voxel to an index that rounding puts 1e-15 beside it, and a neighbour's NaN
/// times 1e-15 is NaN. Tetwarp's own pull fields do without such a neighbour.
TEST(InverseDisplacementField, ItkLosesVoxelsBesideNanAndNoOthers) {
  const Geometry grid = volume_grid();
  const VertexField field = shaken(grid, 4);
  const auto image = noise(grid);
  const auto inverse = inverse_by_filter(*image, field);
  const std::vector<glm::vec3> by = pixels_of(*inverse);
  const std::vector<float> a = resampled_by_us(*image, field),
                           b = resampled_by_itk(*image, *field_image<double>(grid, by, kFarStart), kNothing);
  std::size_t lost = 0;
  for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
    ASSERT_TRUE(b[n] == kNothing || !is_nan(by[n])) << "to ITK a NaN is a place outside";
    if (b[n] != kNothing || a[n] == kNothing) return;
    bool beside = false;
    for_each_voxel(unit_grid({3, 3, 3}), [&](const glm::i64vec3& step, std::size_t) {
      const glm::i64vec3 at = voxel + step - std::int64_t{1};
      beside = beside || (is_voxel(grid, at) && is_nan(by[offset_of(grid, at)]));
    });
    ASSERT_TRUE(beside) << to_string(voxel);
    ++lost;
  });
  EXPECT_GT(lost, 0u);
}

}  // namespace
}  // namespace tetwarp::test
