// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <itkDefaultConvertPixelTraits.h>
#include <itkImage.h>
#include <itkVectorImage.h>

#include <span>
#include <type_traits>

#include "deform/volume.h"
#include "itkbridge/image_geometry.h"

namespace tetwarp {

/// Type of one component of an image's pixels: short for Image<short, 3>, Image<Vector<short, 2>, 3> and
/// VectorImage<short, 3>.
template <class TImage>
using ComponentOf = typename itk::DefaultConvertPixelTraits<typename TImage::PixelType>::ComponentType;

/// The VoxelType of a component, by its kind, size and sign, so that `char` has one, too.
template <class Component>
constexpr VoxelType component_type_of() {
  static_assert(std::is_arithmetic_v<Component>, "Tetwarp samples pixels of numbers");
  static_assert(
      std::is_floating_point_v<Component> ? sizeof(Component) == 4 || sizeof(Component) == 8 : sizeof(Component) <= 4,
      "Tetwarp has no voxels of 64-bit integers or long double: cast the image (itk::CastImageFilter)");
  constexpr bool kSigned = std::is_signed_v<Component>;
  if constexpr (std::is_floating_point_v<Component>)
    return sizeof(Component) == 4 ? VoxelType::f32 : VoxelType::f64;
  else if constexpr (sizeof(Component) == 1)
    return kSigned ? VoxelType::i8 : VoxelType::u8;
  else if constexpr (sizeof(Component) == 2)
    return kSigned ? VoxelType::i16 : VoxelType::u16;
  else
    return kSigned ? VoxelType::i32 : VoxelType::u32;
}

/// A view of what an image buffers, without a copy. The image must be an itk::Image of numbers or of arrays of numbers
/// (RGBPixel, Vector, FixedArray, SymmetricSecondRankTensor and so on), or an itk::VectorImage.
/// @param image     the image, which must outlive the view
/// @param geometry  `geometry_of(image)`, which must outlive the view
template <class TImage>
auto view_of(TImage& image, const Geometry& geometry) {
  using Component = ComponentOf<std::remove_const_t<TImage>>;
  using Byte = std::conditional_t<std::is_const_v<TImage>, const std::byte, std::byte>;
  const unsigned components = image.GetNumberOfComponentsPerPixel();
  using Stored = typename TImage::InternalPixelType;
  static_assert(sizeof(Stored) % sizeof(Component) == 0, "a pixel must be an array of its components");
  return BasicView<Byte>{&geometry,
                         region_of(image, image.GetBufferedRegion()),
                         component_type_of<Component>(),
                         static_cast<int>(components),
                         reinterpret_cast<Byte*>(image.GetBufferPointer()),
                         Memory::host};
}

/// A pixel container for memory that something else owns. It keeps the owner alive.
template <class Pixel>
class KeepingImageContainer : public itk::ImportImageContainer<itk::SizeValueType, Pixel> {
 public:
  ITK_DISALLOW_COPY_AND_MOVE(KeepingImageContainer);
  /** This class. */
  using Self = KeepingImageContainer;
  /** The class from which this one is derived. */
  using Superclass = itk::ImportImageContainer<itk::SizeValueType, Pixel>;
  /** Pointer that shares ownership. */
  using Pointer = itk::SmartPointer<Self>;
  /** Pointer that shares ownership, for reading only. */
  using ConstPointer = itk::SmartPointer<const Self>;
  itkNewMacro(Self);
  itkTypeMacro(KeepingImageContainer, ImportImageContainer);

  /// Refers to `count` pixels and keeps their owner alive.
  void Keep(Pixel* pixels, itk::SizeValueType count, std::shared_ptr<void> owner) {
    this->SetImportPointer(pixels, count, false);
    owner_ = std::move(owner);
  }

 protected:
  KeepingImageContainer() = default;
  ~KeepingImageContainer() override = default;

 private:
  std::shared_ptr<void> owner_;
};

/// A volume as an image that owns it, without a copy.
/// @throws InputError unless the volume has the type and components of TImage's pixels, and for slices at unequal
///         distances
template <class TImage>
typename TImage::Pointer image_of(AnyVolume&& volume) {
  const auto owner = std::make_shared<AnyVolume>(std::move(volume));
  constexpr VoxelType kWanted = component_type_of<ComponentOf<TImage>>();
  const auto image = TImage::New();
  if constexpr (std::is_same_v<TImage, itk::VectorImage<typename TImage::InternalPixelType, 3>>)
    image->SetNumberOfComponentsPerPixel(static_cast<unsigned>(owner->components()));
  const unsigned wanted = image->GetNumberOfComponentsPerPixel();
  require(owner->type() == kWanted && owner->components() == static_cast<int>(wanted),
          "the volume holds " + std::to_string(owner->components()) + " x " + to_string(owner->type()) +
              " a voxel, the image " + std::to_string(wanted) + " x " + to_string(kWanted));
  set_geometry(*image, owner->geometry());
  image->SetRegions(image->GetLargestPossibleRegion());
  using Stored = typename TImage::InternalPixelType;
  const auto pixels = KeepingImageContainer<Stored>::New();
  pixels->Keep(reinterpret_cast<Stored*>(owner->data()), owner->size_bytes() / sizeof(Stored), owner);
  image->SetPixelContainer(pixels);
  return image;
}

}  // namespace tetwarp
