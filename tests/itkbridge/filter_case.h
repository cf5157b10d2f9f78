// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstring>
#include <random>

#include "deform/fields/formula.h"
#include "itkbridge/image_view.h"
#include "itkbridge/itkVertexField.h"

namespace tetwarp::test {

using ShortImage = itk::Image<short, 3>;

/// A grid turned about two axes, none of whose numbers is round.
inline Geometry turned_grid(const glm::i64vec3& size) {
  const double a = std::cos(0.3), b = std::sin(0.3), c = std::cos(0.2), d = std::sin(0.2);
  return {.size = size,
          .spacing = {0.9, 1.1, 1.3},
          .origin = {-11.5, 7.25, 40.125},
          .direction = glm::dmat3(a, b, 0, -b * c, a * c, d, b * d, -a * d, c)};
}

/// An image of noise: integers from 0 to 100 in every component.
template <class TImage>
typename TImage::Pointer noise_image(const Geometry& grid, const itk::Index<3>& start = {{0, 0, 0}},
                                     unsigned components = 1) {
  const auto image = TImage::New();
  set_geometry(*image, grid, start);
  image->SetRegions(image->GetLargestPossibleRegion());
  if constexpr (std::is_same_v<TImage, itk::VectorImage<typename TImage::InternalPixelType, 3>>)
    image->SetNumberOfComponentsPerPixel(components);
  image->Allocate();
  std::mt19937 random(1);
  auto* values = reinterpret_cast<ComponentOf<TImage>*>(image->GetBufferPointer());
  const auto count = static_cast<std::size_t>(voxel_count(grid)) * image->GetNumberOfComponentsPerPixel();
  for (std::size_t n = 0; n < count; ++n) values[n] = static_cast<ComponentOf<TImage>>(random() % 101);
  return image;
}

/// A twist over a whole volume. It moves some corners out of the volume, and leaves others empty.
inline itk::VertexField::Pointer twist_over(const Geometry& volume, std::int64_t cell_size, double angle = 0.4) {
  const auto field = itk::VertexField::New();
  field->SetField(twist(volume, angle, cell_size));
  return field;
}

/// The result of the core for an image, in the layout of the image.
template <class TImage>
typename TImage::Pointer resampled_by_core(const TImage& image, const Geometry& grid, const FieldView& field,
                                           Target settings = {}, Report* report = nullptr) {
  const auto output = TImage::New();
  set_geometry(*output, grid);
  output->SetRegions(output->GetLargestPossibleRegion());
  output->SetNumberOfComponentsPerPixel(image.GetNumberOfComponentsPerPixel());
  output->Allocate();
  const Geometry source = geometry_of(image);
  settings.source = view_of(image, source);
  settings.output = view_of(*output, grid);
  const auto resampler = make_cpu_resampler(grid);
  resampler->set_field(field);
  const Report found = resampler->resample(whole(grid), {&settings, 1});
  if (report) *report = found;
  return output;
}

/// Whether two images buffer the same bytes; false for images without pixels.
template <class TImage>
bool same_pixels(const TImage& a, const TImage& b) {
  const auto count = a.GetBufferedRegion().GetNumberOfPixels();
  if (count == 0 || a.GetBufferedRegion() != b.GetBufferedRegion()) return false;
  const std::size_t pixel = sizeof(ComponentOf<TImage>) * a.GetNumberOfComponentsPerPixel();
  return a.GetNumberOfComponentsPerPixel() == b.GetNumberOfComponentsPerPixel() &&
         std::memcmp(a.GetBufferPointer(), b.GetBufferPointer(), count * pixel) == 0;
}

/// The description of the ITK exception that an action throws; empty if it throws none.
template <class Action>
std::string itk_error_of(Action&& action) {
  try {
    action();
  } catch (const itk::ExceptionObject& error) {
    return error.GetDescription();
  }
  return {};
}

}  // namespace tetwarp::test
