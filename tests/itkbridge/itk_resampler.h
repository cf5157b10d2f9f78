// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "tests/itkbridge/itk_fields.h"

namespace tetwarp::test {

using ShortImage = itk::Image<short, 3>;

/// Resamples an image onto its own grid by ITK's ResampleImageFilter with a DisplacementFieldTransform, both linear.
/// @param field    maps output to input
/// @param nothing  value of pixels that come from outside the image
std::vector<float> resampled_by_itk(const FloatImage& image, const DoubleFieldImage& field, float nothing);
std::vector<short> resampled_by_itk(const ShortImage& image, const DoubleFieldImage& field, short nothing);

}  // namespace tetwarp::test
