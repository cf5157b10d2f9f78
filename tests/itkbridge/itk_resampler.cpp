// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/itkbridge/itk_resampler.h"

#include <itkDisplacementFieldTransform.h>
#include <itkResampleImageFilter.h>

namespace tetwarp::test {

namespace {

template <class TImage>
auto resampled(const TImage& image, const DoubleFieldImage& field, typename TImage::PixelType nothing) {
  const auto transform = itk::DisplacementFieldTransform<double, 3>::New();
  transform->SetDisplacementField(&const_cast<DoubleFieldImage&>(field));  // only read
  const auto resample = itk::ResampleImageFilter<TImage, TImage>::New();
  resample->SetInput(&image);
  resample->SetTransform(transform);
  resample->SetOutputParametersFromImage(&image);
  resample->SetDefaultPixelValue(nothing);
  resample->Update();
  return pixels_of(*resample->GetOutput());
}

}  // namespace

std::vector<float> resampled_by_itk(const FloatImage& image, const DoubleFieldImage& field, float nothing) {
  return resampled(image, field, nothing);
}

std::vector<short> resampled_by_itk(const ShortImage& image, const DoubleFieldImage& field, short nothing) {
  return resampled(image, field, nothing);
}

}  // namespace tetwarp::test
