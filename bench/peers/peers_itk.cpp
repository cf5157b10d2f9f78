// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <itkImage.h>
#include <itkInvertDisplacementFieldImageFilter.h>
#include <itkIterativeInverseDisplacementFieldImageFilter.h>
#include <itkMultiThreaderBase.h>
#include <itkVersion.h>
#include <itkWarpImageFilter.h>

#include "bench/peers/peers.h"

namespace tetwarp::bench {

namespace {

using Image = itk::Image<std::int16_t, 3>;
using Field = itk::Image<itk::Vector<float, 3>, 3>;
using Warp = itk::WarpImageFilter<Image, Image, Field>;
using Invert = itk::InvertDisplacementFieldImageFilter<Field, Field>;
using IterativeInverse = itk::IterativeInverseDisplacementFieldImageFilter<Field, Field>;
using FieldFilter = itk::ImageToImageFilter<Field, Field>;

static_assert(sizeof(Field::PixelType) == sizeof(glm::vec3));

/// An image on the caller's memory, which the filters only read. Spacing 1, origin 0.
template <class ItkImage, class Value>
typename ItkImage::Pointer wrap(const Geometry& geometry, const std::vector<Value>& values) {
  using Pixel = typename ItkImage::PixelType;
  typename ItkImage::SizeType size;
  for (unsigned axis = 0; axis < 3; ++axis) {
    size[axis] = static_cast<itk::SizeValueType>(geometry.size[static_cast<int>(axis)]);
  }
  const auto image = ItkImage::New();
  image->SetRegions(size);
  image->GetPixelContainer()->SetImportPointer(
      const_cast<Pixel*>(reinterpret_cast<const Pixel*>(values.data())),
      static_cast<typename ItkImage::PixelContainer::ElementIdentifier>(values.size()), false);
  return image;
}

template <class Filter>
void use_threads(Filter& filter, int threads) {
  const auto count = static_cast<itk::ThreadIdType>(threads);
  itk::MultiThreaderBase::SetGlobalDefaultNumberOfThreads(count);
  filter.GetMultiThreader()->SetMaximumNumberOfThreads(count);
  filter.ReleaseDataBeforeUpdateFlagOff();  // the output's memory is kept from run to run
}

FieldFilter::Pointer make_filter(ItkInverter inverter) {
  if (inverter == ItkInverter::iterative) return IterativeInverse::New().GetPointer();
  const auto invert = Invert::New();
  invert->SetEnforceBoundaryCondition(inverter == ItkInverter::fixed_border);
  return invert.GetPointer();
}

FieldFilter::Pointer make_inverter(ItkInverter inverter, const VertexField& field, int threads) {
  const FieldFilter::Pointer filter = make_filter(inverter);
  use_threads(*filter, threads);
  filter->SetInput(wrap<Field>(field.lattice, field.displacement));
  return filter;
}

class ItkInverse final : public InversePeer {
 public:
  ItkInverse(ItkInverter inverter, const VertexField& field, int threads)
      : filter_(make_inverter(inverter, field, threads)) {}

  void run() override {
    filter_->Modified();
    filter_->Update();
  }
  std::span<const glm::vec3> inverse() const override {
    const Field* field = filter_->GetOutput();
    return {reinterpret_cast<const glm::vec3*>(field->GetBufferPointer()), field->GetPixelContainer()->Size()};
  }

 private:
  FieldFilter::Pointer filter_;
};

class ItkWarp final : public Peer {
 public:
  ItkWarp(const PeerInput& input, const PullField& inverse) : ItkWarp(input) {
    warp_->SetDisplacementField(wrap<Field>(inverse.grid, inverse.displacement));
  }
  ItkWarp(const PeerInput& input, const VertexField& field) : ItkWarp(input) {
    invert_ = make_inverter(ItkInverter::fixed_border, field, input.threads);
    warp_->SetDisplacementField(invert_->GetOutput());
  }

  void run() override {
    if (invert_) invert_->Modified();
    warp_->Modified();
    warp_->Update();
  }
  std::span<const std::int16_t> output() const override {
    const Image* image = warp_->GetOutput();
    return {image->GetBufferPointer(), image->GetPixelContainer()->Size()};
  }

 private:
  explicit ItkWarp(const PeerInput& input) : warp_(Warp::New()) {
    use_threads(*warp_, input.threads);
    const Image::Pointer source = wrap<Image>(input.volume.geometry, input.volume.voxels);
    warp_->SetInput(source);
    warp_->SetOutputParametersFromImage(source);
    warp_->SetEdgePaddingValue(input.background);
  }

  Warp::Pointer warp_;
  FieldFilter::Pointer invert_;
};

}  // namespace

std::optional<std::string> itk_version() { return itk::Version::GetITKVersion(); }

std::unique_ptr<Peer> make_itk_warp(const PeerInput& input, const PullField& inverse) {
  return std::make_unique<ItkWarp>(input, inverse);
}

std::unique_ptr<Peer> make_itk_invert_and_warp(const PeerInput& input, const VertexField& field) {
  return std::make_unique<ItkWarp>(input, field);
}

std::unique_ptr<InversePeer> make_itk_inverter(ItkInverter inverter, const VertexField& field, int threads) {
  return std::make_unique<ItkInverse>(inverter, field, threads);
}

}  // namespace tetwarp::bench
