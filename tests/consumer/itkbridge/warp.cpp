// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Reads an image and a forward field, warps, writes, and compares with what the program `tetwarp deform` wrote.
#include <itkImageFileReader.h>
#include <itkImageFileWriter.h>

#include <iostream>
#include <string>

#include "itkbridge/itkDisplacementFieldToVertexFieldFilter.h"
#include "itkbridge/itkVertexFieldResampleImageFilter.h"

using ImageType = itk::Image<short, 3>;
using FieldImageType = itk::Image<itk::Vector<float, 3>, 3>;

/// Whether two images have the same grid and voxels, and the first differs from the undeformed one.
bool is_as_expected(const ImageType& warped, const ImageType& expected, const ImageType& undeformed) {
  const auto region = expected.GetLargestPossibleRegion();
  if (warped.GetLargestPossibleRegion() != region || warped.GetOrigin() != expected.GetOrigin() ||
      warped.GetSpacing() != expected.GetSpacing() || warped.GetDirection() != expected.GetDirection()) {
    std::cout << "other grids:\n" << warped << expected;
    return false;
  }
  const std::size_t count = region.GetNumberOfPixels();
  std::size_t wrong = 0, moved = 0;
  for (std::size_t n = 0; n < count; ++n) {
    wrong += warped.GetBufferPointer()[n] != expected.GetBufferPointer()[n];
    moved += warped.GetBufferPointer()[n] != undeformed.GetBufferPointer()[n];
  }
  std::cout << wrong << " of " << count << " voxels are not those of tetwarp deform; " << moved << " changed\n";
  return wrong == 0 && moved > count / 10;
}

int main(int, char** arguments) {
  const std::string input = arguments[1], field = arguments[2], output = arguments[3], expected = arguments[4];

  auto image_reader = itk::ImageFileReader<ImageType>::New();
  image_reader->SetFileName(input);
  auto field_reader = itk::ImageFileReader<FieldImageType>::New();
  field_reader->SetFileName(field);
  auto vertex_field = itk::DisplacementFieldToVertexFieldFilter<FieldImageType>::New();
  vertex_field->SetInput(field_reader->GetOutput());
  auto warp = itk::VertexFieldResampleImageFilter<ImageType>::New();
  warp->SetInput(image_reader->GetOutput());
  warp->SetVertexField(vertex_field->GetOutput());
  warp->SetDefaultPixelValue(-1024);
  auto writer = itk::ImageFileWriter<ImageType>::New();
  writer->SetInput(warp->GetOutput());
  writer->SetFileName(output);
  writer->Update();

  return is_as_expected(*itk::ReadImage<ImageType>(output), *itk::ReadImage<ImageType>(expected),
                        *itk::ReadImage<ImageType>(input))
             ? 0
             : 1;
}
