// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <itkImage.h>
#include <itkImageFileReader.h>
#include <itkMetaImageIO.h>
#include <itkVector.h>

#include <functional>
#include <vector>

#include "bench/itk/itk_work.h"

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
template <class TOutput>
class ItkImageWork final : public ItkWork {
 public:
  /// @param filters    in the order of the pipeline: whoever comes last is updated
  /// @param deviation  of the output; may be null
  ItkImageWork(std::vector<itk::ProcessObject::Pointer> filters, std::uint64_t input_bytes,
               std::function<Deviation(const TOutput&)> deviation)
      : filters_(std::move(filters)), input_bytes_(input_bytes), deviation_(std::move(deviation)) {}

  void run() override { filters_.back()->Update(); }
  std::uint64_t input_bytes() const override { return input_bytes_; }
  std::uint64_t output_bytes() const override { return bytes_of(output()); }
  std::optional<Deviation> deviation() const override {
    return deviation_ ? std::optional(deviation_(output())) : std::nullopt;
  }

 private:
  const TOutput& output() const { return dynamic_cast<const TOutput&>(*filters_.back()->GetOutputs()[0]); }

  std::vector<itk::ProcessObject::Pointer> filters_;
  std::uint64_t input_bytes_;
  std::function<Deviation(const TOutput&)> deviation_;
};

}  // namespace tetwarp::bench
