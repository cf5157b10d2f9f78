#include <itkImage.h>
#include <itkInvertDisplacementFieldImageFilter.h>
#include <itkMultiThreaderBase.h>
#include <itkVersion.h>
#include <itkWarpImageFilter.h>

#include "bench/peers.h"

namespace tetwarp::bench {

namespace {

using Image = itk::Image<std::int16_t, 3>;
using Field = itk::Image<itk::Vector<float, 3>, 3>;
using Warp = itk::WarpImageFilter<Image, Image, Field>;
using Invert = itk::InvertDisplacementFieldImageFilter<Field, Field>;

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

class ItkWarp final : public Peer {
 public:
  ItkWarp(const PeerInput& input, const PullField& inverse) : ItkWarp(input) {
    warp_->SetDisplacementField(wrap<Field>(inverse.grid, inverse.displacement));
  }
  ItkWarp(const PeerInput& input, const VertexField& field) : ItkWarp(input) {
    invert_ = Invert::New();
    use_threads(*invert_, input.threads);
    invert_->SetDisplacementField(wrap<Field>(field.lattice, field.displacement));
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
  Invert::Pointer invert_;
};

}  // namespace

std::optional<std::string> itk_version() { return itk::Version::GetITKVersion(); }

std::unique_ptr<Peer> make_itk_warp(const PeerInput& input, const PullField& inverse) {
  return std::make_unique<ItkWarp>(input, inverse);
}

std::unique_ptr<Peer> make_itk_invert_and_warp(const PeerInput& input, const VertexField& field) {
  return std::make_unique<ItkWarp>(input, field);
}

}  // namespace tetwarp::bench
