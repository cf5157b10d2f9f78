// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <gtest/gtest.h>
#include <itkImage.h>
#include <itkVector.h>

#include <algorithm>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "itkbridge/image_geometry.h"
#include "itkbridge/itkVertexField.h"
#include "tests/support/fields.h"

namespace tetwarp::test {

using FloatImage = itk::Image<float, 3>;
using FieldImage = itk::Image<itk::Vector<float, 3>, 3>;
using DoubleFieldImage = itk::Image<itk::Vector<double, 3>, 3>;

/// Index of the first voxel of an image, in tests of start indices.
inline constexpr itk::Index<3> kFarStart{{5, -3, 11}};

template <class Triple>
glm::dvec3 glm_of(const Triple& numbers) {
  return {numbers[0], numbers[1], numbers[2]};
}
inline itk::Point<double, 3> itk_point(const glm::dvec3& point) {
  itk::Point<double, 3> result;
  for (unsigned axis = 0; axis < 3; ++axis) result[axis] = point[static_cast<int>(axis)];
  return result;
}
template <class Component>
itk::Vector<Component, 3> itk_vector(const glm::dvec3& vector) {
  itk::Vector<Component, 3> result;
  for (unsigned axis = 0; axis < 3; ++axis) result[axis] = static_cast<Component>(vector[static_cast<int>(axis)]);
  return result;
}

/// An image without pixels on a grid whose first voxel has index `start`.
template <class TImage = FloatImage>
typename TImage::Pointer grid_image(const Geometry& grid, const itk::Index<3>& start = {{0, 0, 0}}) {
  const auto image = TImage::New();
  set_geometry(*image, grid, start);
  return image;
}

/// An image on a grid. @param pixel  gives the pixel at a point
template <class TImage, class Pixel>
typename TImage::Pointer image_with(const Geometry& grid, Pixel&& pixel, const itk::Index<3>& start = {{0, 0, 0}}) {
  const auto image = grid_image<TImage>(grid, start);
  image->SetRegions(image->GetLargestPossibleRegion());
  image->Allocate();
  const AffineMap place = point_from_index(grid);
  auto* to = image->GetBufferPointer();
  for (std::int64_t k = 0; k < grid.size.z; ++k) {
    for (std::int64_t j = 0; j < grid.size.y; ++j) {
      for (std::int64_t i = 0; i < grid.size.x; ++i) *to++ = pixel(place(glm::dvec3(i, j, k)));
    }
  }
  return image;
}

/// Vectors as the pixels of an image on their grid.
template <class Component = float>
auto field_image(const Geometry& grid, const std::vector<glm::vec3>& vectors,
                 const itk::Index<3>& start = {{0, 0, 0}}) {
  auto next = vectors.begin();
  return image_with<itk::Image<itk::Vector<Component, 3>, 3>>(
      grid, [&](const glm::dvec3&) { return itk_vector<Component>(*next++); }, start);
}

/// All pixels of an image, i fastest.
template <class Pixel>
std::vector<Pixel> pixels_of(const itk::Image<Pixel, 3>& image) {
  const auto count = static_cast<std::ptrdiff_t>(image.GetBufferedRegion().GetNumberOfPixels());
  return {image.GetBufferPointer(), image.GetBufferPointer() + count};
}
template <class Component>
std::vector<glm::vec3> pixels_of(const itk::Image<itk::Vector<Component, 3>, 3>& image) {
  const auto count = static_cast<std::ptrdiff_t>(image.GetBufferedRegion().GetNumberOfPixels());
  std::vector<glm::vec3> pixels;
  std::transform(image.GetBufferPointer(), image.GetBufferPointer() + count, std::back_inserter(pixels),
                 [](const auto& pixel) { return glm::vec3(glm_of(pixel)); });
  return pixels;
}

inline itk::VertexField::Pointer itk_field(VertexField field) {
  const auto result = itk::VertexField::New();
  result->SetField(std::move(field));
  return result;
}

/// A field over a volume whose vertices are moved at random by up to a third of a cell, also at the border, where some
/// voxels get nothing.
inline VertexField shaken(const Geometry& volume, std::int64_t cell_size, std::uint64_t seed = 1) {
  Random random(seed);
  const double most = 0.3 * static_cast<double>(cell_size);
  return field_in_voxels(volume, lattice_over(volume, cell_size), [&](const glm::dvec3&) {
    return glm::dvec3(random.real(-most, most), random.real(-most, most), random.real(-most, most));
  });
}

/// The description of the `itk::ExceptionObject` that `action` throws; if it throws none, a text that says so.
template <class Action>
std::string refusal_by_itk(Action&& action) {
  try {
    action();
  } catch (const itk::ExceptionObject& error) {
    return error.GetDescription();
  } catch (const std::exception& error) {
    return std::string("(another exception) ") + error.what();
  }
  return "(nothing thrown)";
}

}  // namespace tetwarp::test
