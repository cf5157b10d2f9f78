// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Images deformed by displacement fields of registrations, beside ITK's ResampleImageFilter with a
// DisplacementFieldTransform.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include "itkbridge/itkPullFieldResampleImageFilter.h"
#include "tests/itkbridge/itk_resampler.h"
#include "tests/support/run.h"
#include "tests/support/says.h"

namespace tetwarp::test {
namespace {

template <class TImage = FloatImage, class TField = FieldImage>
using PullResample = itk::PullFieldResampleImageFilter<TImage, TField>;

constexpr float kNothing = -7777;  // value of voxels that come from nowhere

template <class TImage, class TField>
auto resampled_by_us(const TImage& image, const TField& field, Outside outside = Outside::refuse) {
  const auto filter = PullResample<TImage, TField>::New();
  filter->SetInput(&image);
  filter->SetDisplacementField(&field);
  filter->SetOutside(outside);
  filter->SetDefaultPixelValue(static_cast<typename TImage::PixelType>(kNothing));
  filter->Update();
  return pixels_of(*filter->GetOutput());
}

Geometry volume_grid() { return oblique_grid({20, 18, 16}); }

/// Coarser than the volume, turned against it, and around it.
Geometry field_grid() {
  Geometry grid = {{14, 13, 12}, {2.1, 2.3, 2.9}, {}, rotation({2, -1, 1}, 0.4)};
  grid.origin += centre(volume_grid()) - centre(grid);
  return grid;
}

/// Waves of up to 2.5 mm along each axis.
std::vector<glm::vec3> smooth_vectors(const Geometry& grid, std::uint64_t seed) {
  Random random(seed);
  glm::dmat3 wave;
  glm::dvec3 phase;
  for (int axis = 0; axis < 3; ++axis) {
    wave[axis] = {random.real(-0.4, 0.4), random.real(-0.4, 0.4), random.real(-0.4, 0.4)};
    phase[axis] = random.real(0, 6);
  }
  std::vector<glm::vec3> vectors;
  for_each_voxel(grid, [&](const glm::i64vec3& at, std::size_t) {
    vectors.emplace_back(2.5 * glm::sin(wave * point_from_index(grid)(glm::dvec3(at)) + phase));
  });
  return vectors;
}

/// Values from -1000 to 1000 that change smoothly.
double anatomy(const glm::dvec3& x) { return 1000 * std::sin(0.21 * x.x + 0.4) * std::cos(0.17 * x.y - 0.13 * x.z); }

template <class TImage = FloatImage>
typename TImage::Pointer volume(const Geometry& grid, const itk::Index<3>& start = {{0, 0, 0}}) {
  return image_with<TImage>(
      grid, [](const glm::dvec3& x) { return static_cast<typename TImage::PixelType>(anatomy(x)); }, start);
}

/// The largest differences of neighbours along i, j and k, added up: how much a value changes at most where the place
/// moves by one voxel on each axis.
double steepness(const FloatImage& image) {
  const Geometry grid = geometry_of(image);
  const std::vector<float> values = pixels_of(image);
  glm::dvec3 largest(0);
  for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
    for (int axis = 0; axis < 3; ++axis) {
      glm::i64vec3 next = voxel;
      ++next[axis];
      if (is_voxel(grid, next))
        largest[axis] = std::max<double>(largest[axis], std::abs(values[offset_of(grid, next)] - values[n]));
    }
  });
  return largest.x + largest.y + largest.z;
}

/// Linear interpolation in float, beside double: three blends, each of three roundings.
double rounding_of(double largest_difference) { return 9 * std::ldexp(largest_difference, -24); }

/// ITK takes the field's vectors as they are, Tetwarp rounds them to 2^-12 voxel: the place is off by 2^-13 voxel an
/// axis.
TEST(PullFieldResample, IsItksToTheRoundingOfVectors) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    const auto image = volume(volume_grid(), kFarStart);
    const std::vector<glm::vec3> vectors = smooth_vectors(field_grid(), seed);
    const itk::Index<3> start{{-2, 7, 3}};
    const std::vector<float> ours = resampled_by_us(*image, *field_image(field_grid(), vectors, start));
    const std::vector<float> itks =
        resampled_by_itk(*image, *field_image<double>(field_grid(), vectors, start), kNothing);
    const double tolerance = std::ldexp(steepness(*image), -13) + rounding_of(2000);
    EXPECT_LT(tolerance, 0.06);
    std::size_t compared = 0, different = 0;
    for (std::size_t n = 0; n < ours.size(); ++n) {
      different += (ours[n] == kNothing) != (itks[n] == kNothing);  // at the very end of the image's border
      if (ours[n] == kNothing || itks[n] == kNothing) continue;
      ASSERT_NEAR(ours[n], itks[n], tolerance) << n;
      ++compared;
    }
    EXPECT_GT(compared, 3000u);
    EXPECT_LE(different, 3u);
  }
}

/// Vectors that are multiples of 2^-12 voxel, at samples 4 voxels apart: both filters sample at exactly the same
/// places.
TEST(PullFieldResample, OfVectorsThatSnapExactlyIsItksToFloatRounding) {
  const Geometry grid = unit_grid({29, 25, 21}), coarse = {{8, 7, 6}, glm::dvec3(4), {0, 0, 0}, glm::dmat3(1)};
  Random random(4);
  std::vector<glm::vec3> vectors;
  for_each_voxel(coarse, [&](const glm::i64vec3&, std::size_t) {
    const auto any = [&] { return static_cast<double>(random.integer(-3 * 4096, 3 * 4096)) / 4096; };
    vectors.emplace_back(any(), any(), any());
  });
  const auto image =
      image_with<FloatImage>(grid, [&](const glm::dvec3&) { return static_cast<float>(random.real(-1000, 1000)); });
  const std::vector<float> ours = resampled_by_us(*image, *field_image(coarse, vectors));
  const std::vector<float> itks = resampled_by_itk(*image, *field_image<double>(coarse, vectors), kNothing);
  for (std::size_t n = 0; n < ours.size(); ++n) ASSERT_NEAR(ours[n], itks[n], rounding_of(2000)) << n;
  EXPECT_LT(std::ranges::count(ours, kNothing), 3000);
}

/// A field that covers a part of the volume, samples 3 voxels apart, and where a voxel lies in it: samples of the
/// field.
struct PartlyCovered {
  Geometry grid = unit_grid({40, 30, 24});
  Geometry part = {{7, 6, 5}, glm::dvec3(3), {10.2, 7.3, 5.4}, glm::dmat3(1)};
  std::vector<glm::vec3> vectors = smooth_vectors(part, 5);

  /// How far outside the outermost samples, in samples.
  double beyond(const glm::i64vec3& voxel) const {
    const glm::dvec3 at = index_from_point(part)(glm::dvec3(voxel));
    const glm::dvec3 past = glm::max(-at, at - glm::dvec3(part.size - std::int64_t{1}));
    return std::max({past.x, past.y, past.z});
  }
};

/// ITK's field goes on for half a sample with its outermost vectors. Then both leave the voxel where it is.
TEST(PullFieldResample, OutsideTheFieldItRestsAsItkButForHalfASample) {
  const PartlyCovered scene;
  const auto image = volume(scene.grid);
  const std::vector<float> source = pixels_of(*image);
  const std::vector<float> ours = resampled_by_us(*image, *field_image(scene.part, scene.vectors), Outside::rest);
  const std::vector<float> itks = resampled_by_itk(*image, *field_image<double>(scene.part, scene.vectors), kNothing);
  const double tolerance = std::ldexp(steepness(*image), -13) + rounding_of(2000);
  std::size_t inside = 0, shell = 0, moved = 0, outside = 0;
  for_each_voxel(scene.grid, [&](const glm::i64vec3& voxel, std::size_t n) {
    const double beyond = scene.beyond(voxel);
    if (beyond <= 0) {
      ASSERT_NEAR(ours[n], itks[n], tolerance) << to_string(voxel);
      ++inside;
      return;
    }
    ASSERT_EQ(ours[n], source[n]) << to_string(voxel) << " rests, bit for bit";
    if (beyond < 0.5) {
      ++shell;
      moved += std::abs(itks[n] - source[n]) > 1;
    } else {
      ASSERT_NEAR(itks[n], source[n], rounding_of(2000)) << to_string(voxel);
      ++outside;
    }
  });
  EXPECT_GT(inside, 2000u);
  EXPECT_GT(outside, 15000u);
  EXPECT_GT(moved, shell / 2) << "of those half a sample outside ITK moves most";
}

/// What ITK does there: the outermost samples once more beyond them, and half of that.
TEST(PullFieldResample, ItksHalfASampleIsTheOutermostVectorOnceMore) {
  const PartlyCovered scene;
  Geometry grown = scene.part;
  grown.size += std::int64_t{2};
  grown.origin -= grown.spacing;
  std::vector<glm::vec3> vectors;
  for_each_voxel(grown, [&](const glm::i64vec3& at, std::size_t) {
    const glm::i64vec3 nearest = glm::clamp(at - std::int64_t{1}, glm::i64vec3(0), scene.part.size - std::int64_t{1});
    vectors.push_back(scene.vectors[offset_of(scene.part, nearest)]);
  });
  const auto image = volume(scene.grid);
  const std::vector<float> ours = resampled_by_us(*image, *field_image(grown, vectors), Outside::rest);
  const std::vector<float> itks = resampled_by_itk(*image, *field_image<double>(scene.part, scene.vectors), kNothing);
  const double tolerance = std::ldexp(steepness(*image), -13) + rounding_of(2000);
  for_each_voxel(scene.grid, [&](const glm::i64vec3& voxel, std::size_t n) {
    ASSERT_TRUE(scene.beyond(voxel) >= 0.5 || std::abs(ours[n] - itks[n]) <= tolerance) << to_string(voxel);
  });
}

TEST(PullFieldResample, OutsideTheFieldItRefusesOrGivesTheDefaultPixelValue) {
  const PartlyCovered scene;
  const auto image = volume(scene.grid);
  const auto field = field_image(scene.part, scene.vectors);
  EXPECT_TRUE(says(refusal_by_itk([&] { resampled_by_us(*image, *field); }), {"does not reach over", "7 x 6 x 5"}));
  const std::vector<float> found = resampled_by_us(*image, *field, Outside::background);
  for_each_voxel(scene.grid, [&](const glm::i64vec3& voxel, std::size_t n) {
    ASSERT_EQ(found[n] == kNothing, scene.beyond(voxel) > 0) << to_string(voxel);
  });
}

/// Samples 4 voxels apart, one of them missing: so is what would be interpolated from it, in ITK as here, whatever
/// `Outside` says. Voxels on a plane of other samples have no weight for it.
TEST(PullFieldResample, NanInTheFieldGivesTheDefaultPixelValueAsInItk) {
  const Geometry grid = unit_grid({29, 25, 21}), coarse = {{8, 7, 6}, glm::dvec3(4), {0, 0, 0}, glm::dmat3(1)};
  std::vector<glm::vec3> vectors(static_cast<std::size_t>(voxel_count(coarse)), glm::vec3(0.25f, -0.5f, 0.125f));
  vectors[offset_of(coarse, {3, 3, 2})].y = NAN;
  const auto image = volume(grid);
  const std::vector<float> itks = resampled_by_itk(*image, *field_image<double>(coarse, vectors), kNothing);
  for (const Outside outside : {Outside::refuse, Outside::rest, Outside::background}) {
    const std::vector<float> ours = resampled_by_us(*image, *field_image(coarse, vectors), outside);
    for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
      const glm::i64vec3 off = glm::abs(voxel - glm::i64vec3(12, 12, 8));
      ASSERT_EQ(ours[n] == kNothing, std::max({off.x, off.y, off.z}) < 4) << to_string(voxel);
      ASSERT_NEAR(ours[n], itks[n], rounding_of(2000)) << to_string(voxel);
    });
  }
}

/// The inverse of a forward field that the core gives, on an oblique grid and NaN where nothing maps: the same voxels
/// get a value, and places differ by the rounding of vectors.
TEST(PullFieldResample, OfAnInverseWithGapsIsTheForwardField) {
  const Geometry grid = volume_grid();
  const auto image = volume(grid);
  const auto resampler = make_cpu_resampler(grid);
  const VertexField forward = shaken(grid, 4);
  resampler->set_field(view(forward));
  const Outcome<float> expected =
      run(*resampler, Volume<float>{grid, pixels_of(*image)}, {.background = double{kNothing}});
  const std::vector<float> found = resampled_by_us(*image, *field_image(grid, expected.inverse_mm.voxels));
  const double tolerance = std::ldexp(steepness(*image), -13) + rounding_of(2000);
  std::size_t gaps = 0;
  for (std::size_t n = 0; n < found.size(); ++n) {
    ASSERT_NEAR(found[n], expected.output.voxels[n], tolerance) << n;
    gaps += found[n] == kNothing;
  }
  EXPECT_GT(gaps, 100u);
}

TEST(PullFieldResample, InfiniteVectorsAreRefused) {
  std::vector<glm::vec3> vectors = smooth_vectors(field_grid(), 6);
  vectors[offset_of(field_grid(), {3, 2, 1})].z = INFINITY;
  const auto image = volume(volume_grid());
  EXPECT_TRUE(says(refusal_by_itk([&] { resampled_by_us(*image, *field_image(field_grid(), vectors)); }),
                   {"(3, 2, 1)", "infinite"}));
}

TEST(PullFieldResample, VectorsOfDoublesAreRoundedToFloat) {
  const auto image = volume(volume_grid());
  const std::vector<glm::vec3> vectors = smooth_vectors(field_grid(), 7);
  const auto doubles = field_image<double>(field_grid(), vectors);
  const std::vector<float> expected = resampled_by_us(*image, *field_image(field_grid(), vectors));
  EXPECT_TRUE(same_bits(expected, resampled_by_us(*image, *doubles)));
  auto* const values = doubles->GetBufferPointer();
  for (std::size_t n = 0; n < vectors.size(); ++n) values[n] *= 1 + 1e-9;
  doubles->Modified();
  EXPECT_TRUE(same_bits(expected, resampled_by_us(*image, *doubles)));
}

/// Vectors of doubles, of which a copy was made.
TEST(PullFieldResample, SeesThatTheFieldWasChanged) {
  const auto image = volume(volume_grid());
  const std::vector<glm::vec3> vectors = smooth_vectors(field_grid(), 8), others = smooth_vectors(field_grid(), 9);
  const auto field = field_image<double>(field_grid(), vectors);
  const auto filter = PullResample<FloatImage, DoubleFieldImage>::New();
  filter->SetInput(image);
  filter->SetDisplacementField(field);
  filter->SetDefaultPixelValue(kNothing);
  filter->Update();
  EXPECT_TRUE(same_bits(resampled_by_us(*image, *field_image(field_grid(), vectors)), pixels_of(*filter->GetOutput())));
  for (std::size_t n = 0; n < others.size(); ++n) field->GetBufferPointer()[n] = itk_vector<double>(others[n]);
  field->Modified();
  filter->Update();
  EXPECT_TRUE(same_bits(resampled_by_us(*image, *field_image(field_grid(), others)), pixels_of(*filter->GetOutput())));
}

/// Half a voxel along i: 1.5, 2.5, ... and -1.5, -2.5, ...
TEST(PullFieldResample, RoundsToNearestEvenWhereItkTruncates) {
  const Geometry grid = unit_grid({31, 4, 4});
  const auto image = image_with<ShortImage>(grid, [](const glm::dvec3& x) { return static_cast<short>(x.x - 15); });
  const std::vector<glm::vec3> half(static_cast<std::size_t>(voxel_count(grid)), glm::vec3(0.5f, 0, 0));
  const std::vector<short> ours = resampled_by_us(*image, *field_image(grid, half));
  const std::vector<short> itks =
      resampled_by_itk(*image, *field_image<double>(grid, half), static_cast<short>(kNothing));
  for_each_voxel(grid, [&](const glm::i64vec3& voxel, std::size_t n) {
    if (voxel.x == 30) return;  // at the very end of the border of half a voxel
    const double value = static_cast<double>(voxel.x) - 14.5;
    ASSERT_EQ(ours[n], static_cast<short>(2 * std::floor(value / 2 + 0.5))) << value;
    ASSERT_EQ(itks[n], static_cast<short>(std::trunc(value))) << value;
  });
}

TEST(PullFieldResample, OfAnatomyDiffersFromItksByTheRoundingOfIntegers) {
  const auto exact = volume(volume_grid());
  const auto image = volume<ShortImage>(volume_grid());
  const auto of_integers = image_with<FloatImage>(
      volume_grid(), [](const glm::dvec3& x) { return static_cast<float>(static_cast<short>(anatomy(x))); });
  const std::vector<glm::vec3> vectors = smooth_vectors(field_grid(), 10);
  const auto field = field_image(field_grid(), vectors);
  const auto doubles = field_image<double>(field_grid(), vectors);
  const std::vector<float> value = resampled_by_us(*of_integers, *field);
  const std::vector<short> ours = resampled_by_us(*image, *field);
  const std::vector<short> itks = resampled_by_itk(*image, *doubles, static_cast<short>(kNothing));
  const double doubt = std::ldexp(steepness(*exact) + 3, -13) + rounding_of(2000);  // of ITK's value and of Tetwarp's
  std::size_t other = 0;
  for (std::size_t n = 0; n < ours.size(); ++n) {
    ASSERT_EQ(ours[n], static_cast<short>(std::nearbyint(value[n]))) << n;
    if (value[n] == kNothing || std::abs(value[n] - std::round(value[n])) < doubt) continue;
    ASSERT_EQ(itks[n], static_cast<short>(std::trunc(value[n]))) << n;
    other += itks[n] != ours[n];
  }
  EXPECT_GT(other, ours.size() / 4);
}

}  // namespace
}  // namespace tetwarp::test
