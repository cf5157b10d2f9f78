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

FieldFilter::Pointer make_inverter(ItkInverter inverter, const VertexField& field, int threads) {
  FieldFilter::Pointer filter;
  if (inverter == ItkInverter::iterative) {
    filter = IterativeInverse::New().GetPointer();
  } else {
    const auto invert = Invert::New();
    invert->SetEnforceBoundaryCondition(inverter == ItkInverter::fixed_border);
    filter = invert.GetPointer();
  }
  use_threads(*filter, threads);
  filter->SetInput(wrap<Field>(field.lattice, field.displacement));
  return filter;
}

/// @param before  runs before it; may be null
Peer make_warp(const PeerInput& input, const Field::Pointer& inverse, const FieldFilter::Pointer& before) {
  const auto warp = Warp::New();
  use_threads(*warp, input.threads);
  const Image::Pointer source = wrap<Image>(input.volume.geometry, input.volume.voxels);
  warp->SetInput(source);
  warp->SetDisplacementField(inverse);
  warp->SetOutputParametersFromImage(source);
  warp->SetEdgePaddingValue(input.background);
  return [=]() -> std::span<const std::int16_t> {
    if (before) before->Modified();
    warp->Modified();
    warp->Update();
    const Image* image = warp->GetOutput();
    return {image->GetBufferPointer(), image->GetPixelContainer()->Size()};
  };
}

}  // namespace

std::optional<std::string> itk_version() { return itk::Version::GetITKVersion(); }

Peer make_itk_warp(const PeerInput& input, const PullField& inverse) {
  return make_warp(input, wrap<Field>(inverse.grid, inverse.displacement), nullptr);
}

Peer make_itk_invert_and_warp(const PeerInput& input, const VertexField& field) {
  const FieldFilter::Pointer invert = make_inverter(ItkInverter::fixed_border, field, input.threads);
  return make_warp(input, invert->GetOutput(), invert);
}

InversePeer make_itk_inverter(ItkInverter inverter, const VertexField& field, int threads) {
  return [filter = make_inverter(inverter, field, threads)]() -> std::span<const glm::vec3> {
    filter->Modified();
    filter->Update();
    const Field* inverse = filter->GetOutput();
    return {reinterpret_cast<const glm::vec3*>(inverse->GetBufferPointer()), inverse->GetPixelContainer()->Size()};
  };
}

}  // namespace tetwarp::bench
