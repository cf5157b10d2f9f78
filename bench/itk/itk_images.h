// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <itkImage.h>
#include <itkImageFileReader.h>
#include <itkMetaImageIO.h>
#include <itkVector.h>

#include <vector>

#include "bench/itk/itk.h"
#include "io/image_file.h"

namespace tetwarp::bench {

using ItkImage = itk::Image<std::int16_t, 3>;
using ItkField = itk::Image<itk::Vector<float, 3>, 3>;

template <class TImage>
typename itk::ImageFileReader<TImage>::Pointer itk_reader(const std::filesystem::path& path) {
  const auto reader = itk::ImageFileReader<TImage>::New();
  reader->SetImageIO(itk::MetaImageIO::New());
  reader->SetFileName(path.string());
  return reader;
}

/// A file's image, which no longer knows its reader.
template <class TImage>
typename TImage::Pointer itk_read(const std::filesystem::path& path) {
  const auto reader = itk_reader<TImage>(path);
  reader->Update();
  const typename TImage::Pointer image = reader->GetOutput();
  image->DisconnectPipeline();
  return image;
}

template <class TImage>
std::uint64_t bytes_of(const TImage& image) {
  return image.GetPixelContainer()->Size() * sizeof(typename TImage::InternalPixelType);
}

/// The vectors of a field in memory.
inline std::span<const glm::vec3> vectors_of(const ItkField& field) {
  return {reinterpret_cast<const glm::vec3*>(field.GetBufferPointer()), field.GetPixelContainer()->Size()};
}

/// Filters whose last makes an image.
/// @param filters    in the order of the pipeline: whoever comes last is updated
/// @param deviation  of the output
template <class TOutput, class Compare>
ItkWork image_work(std::vector<itk::ProcessObject::Pointer> filters, std::uint64_t input_bytes, Compare deviation) {
  const itk::ProcessObject::Pointer last = filters.back();
  const auto output = [last]() -> const TOutput& { return dynamic_cast<const TOutput&>(*last->GetOutputs()[0]); };
  return {[filters] { filters.back()->Update(); }, input_bytes, [=] { return bytes_of(output()); },
          [=] { return deviation(output()); }};
}

/// Calls `compare` with the true inverse of the request's field.
template <class Compare>
Deviation with_truth(const std::filesystem::path& inverse, Compare&& compare) {
  const AnyVolume truth = read_image(inverse);
  const std::span vectors(reinterpret_cast<const glm::vec3*>(truth.data()), truth.size_bytes() / sizeof(glm::vec3));
  return compare(TrueInverse{&truth.geometry(), vectors});
}

/// The pixels of an image in memory.
template <class TImage>
std::span<const typename TImage::PixelType> values_of(const TImage& image) {
  return {image.GetBufferPointer(), image.GetPixelContainer()->Size()};
}

}  // namespace tetwarp::bench
