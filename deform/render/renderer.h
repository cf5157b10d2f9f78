// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "deform/render/camera.h"
#include "deform/render/transfer_function.h"
#include "deform/resampler.h"

namespace tetwarp {

/// How a picture is made of a volume.
struct RenderStyle {
  TransferFunction transfer;
  /// Between two samples of a ray, in the smallest spacing of the volume, 0.01 to 1; nothing: half a pixel, but 0.5
  /// to 1, and 1 for a sum.
  std::optional<double> step_voxels = {};
  glm::dvec3 background{0};  ///< red, green, blue, 0 to 1: behind what is seen
};

/// Colours that are mixed to what is seen of a volume, as an overlay: one of 255 at each voxel, or none.
struct Tints {
  ConstVolumeView numbers;              ///< u8 on the grid of the volume, 0: none; without voxels: nowhere one
  std::vector<glm::vec4> colours = {};  ///< of number 0, 1, ...: red, green, blue, and the share of each, 0 to 1
};

/// Casts parallel rays through a volume: one picture after the other, of one volume after the other.
///
/// A picture is a function of volume, style and plane alone: the same bytes on every backend, for any number of
/// threads. One object is for one thread at a time.
class Renderer {
 public:
  virtual ~Renderer() = default;

  /// Takes a volume, in host memory or (CUDA) in that of the device, and looks which blocks of it are empty. The view
  /// is kept: the voxels must stay as they are until the next call, which has to follow whenever they change.
  /// @throws InputError unless the view has one component and holds its whole, evenly spaced grid (see `straightened`)
  virtual void set_volume(const ConstVolumeView& volume, const Control& control = {}) = 0;

  /// @throws InputError for a style that are not valid
  virtual void set_style(const RenderStyle& style) = 0;

  /// Takes colours for the volume that was set last; the voxels are looked at in `render`. Composite alone shows them.
  /// @throws InputError for another grid, type or memory, or more than 256 colours
  virtual void set_tints(const Tints& tints) = 0;

  /// The picture, red, green and blue of each pixel, rows from the top.
  /// @param rgb  plane.width * plane.height * 3 bytes, in host memory or (CUDA) in that of the device
  /// @throws InputError without a volume and a style, or for another size; Cancelled
  virtual void render(const ViewPlane& plane, std::span<std::uint8_t> rgb, const Control& control = {}) = 0;
};

std::unique_ptr<Renderer> make_cpu_renderer(Limits limits = {});
/// @param limits  `memory`: the most bytes of its copy of a volume, without which pictures take longer
/// @throws DeviceError without a device, NotCompiled in a build without CUDA
std::unique_ptr<Renderer> make_cuda_renderer(int device = 0, Limits limits = {});

}  // namespace tetwarp
