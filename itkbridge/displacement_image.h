// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <itkVector.h>

#include <array>
#include <memory>
#include <vector>

#include "deform/vertex_field.h"
#include "itkbridge/image_view.h"

namespace tetwarp {

/// Vectors on a grid, and what keeps them alive.
struct HeldDisplacements {
  Geometry grid;                            ///< grid of the samples
  const glm::vec3* displacement = nullptr;  ///< one for each sample, LPS mm, i fastest
  std::shared_ptr<const void> keeper = {};  ///< owner of the vectors
};

/// The vectors of a displacement image, LPS mm; the caller knows whether they are forward or pull. An image of
/// `Vector<float, 3>`, or of another array of three floats, is used in place: its pixel container is kept, not the
/// image. Other components are converted to float.
/// @throws InputError unless the whole image is buffered and has three components
template <class TImage>
std::shared_ptr<const HeldDisplacements> hold_displacements(const TImage& image) {
  const unsigned components = image.GetNumberOfComponentsPerPixel();
  require(components == 3, "a displacement image of " + std::to_string(components) + " components, expected 3");
  const itk::ImageRegion<3>& whole = image.GetLargestPossibleRegion();
  require(image.GetBufferedRegion() == whole && image.GetBufferPointer(),
          "the displacement image does not buffer its largest possible region; update it whole");
  HeldDisplacements held{geometry_of(image)};
  using Component = ComponentOf<TImage>;
  const auto* values = reinterpret_cast<const Component*>(image.GetBufferPointer());
  if constexpr (std::is_same_v<Component, float>) {
    struct Keeper {
      typename TImage::PixelContainerConstPointer pixels;
    };
    held.keeper = std::make_shared<Keeper>(Keeper{image.GetPixelContainer()});
    held.displacement = reinterpret_cast<const glm::vec3*>(values);
  } else {
    const auto count = static_cast<std::size_t>(voxel_count(held.grid));
    const auto converted = std::make_shared<std::vector<glm::vec3>>(count);
    for (std::size_t n = 0; n < count; ++n) {
      for (std::size_t axis = 0; axis < 3; ++axis)
        (*converted)[n][static_cast<int>(axis)] = static_cast<float>(values[3 * n + axis]);
    }
    held.displacement = converted->data();
    held.keeper = converted;
  }
  return std::make_shared<const HeldDisplacements>(std::move(held));
}

/// Holds the vectors of the last image that a filter got. It returns the same object until the image changes.
template <class TImage>
class DisplacementHolder {
 public:
  /// The vectors of an image, LPS mm.
  /// @throws InputError for an image that `hold_displacements` refuses
  std::shared_ptr<const HeldDisplacements> hold(const TImage& image) {
    const std::array<itk::ModifiedTimeType, 2> times{image.GetMTime(), image.GetUpdateMTime()};
    if (!held_ || pixels_ != image.GetPixelContainer() || times_ != times) {
      held_ = hold_displacements(image);
      pixels_ = image.GetPixelContainer();
      times_ = times;
    }
    return held_;
  }

 private:
  std::shared_ptr<const HeldDisplacements> held_;
  typename TImage::PixelContainerConstPointer pixels_;
  std::array<itk::ModifiedTimeType, 2> times_{};
};

}  // namespace tetwarp
