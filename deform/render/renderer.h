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

/// How a picture is made from a volume.
struct RenderStyle {
  TransferFunction transfer;  ///< colour and opacity of each value
  /// Distance of two samples of a ray, 0.01 to 1, in units of the smallest spacing of the volume. Empty: 1 for a sum;
  /// else half a pixel, but at least 0.5 and at most 1.
  std::optional<double> step_voxels = {};
  glm::dvec3 background{0};  ///< red, green and blue, 0 to 1, of what lies behind the volume
};

/// Colours mixed into what is seen of a volume, as an overlay: one of up to 256 colours at each voxel, or none.
struct Tints {
  /// Type u8 on the grid of the volume: number of the colour, 0 for none; without voxels there is no tint.
  ConstVolumeView numbers;
  /// For each number: red, green and blue, and the share of this colour in the mixture, all 0 to 1.
  std::vector<glm::vec4> colours = {};
};

/// The values of which pictures in this style show something, rising, so that what a picture shows depends on no part
/// of a volume in which none of them lies between the least and the largest value. For `ForwardResampler::update`.
/// @throws InputError for a style with a number out of its range
std::vector<ValueRange> seen_values(const RenderStyle& style);

/// Casts parallel rays through a volume. It makes one picture after another, of one volume after another.
///
/// A picture depends on volume, style and plane alone: it has the same bytes on every backend, for any number of
/// threads. One object serves one thread at a time.
class Renderer {
 public:
  /// Frees what the renderer holds; volumes are not owned.
  virtual ~Renderer() = default;

  /// Takes a volume in host memory or in memory of its device, and finds out which blocks of it are empty.
  /// The view is kept: the voxels must not change until the next call, and call it again whenever they have changed.
  /// @throws InputError unless the view has one component and buffers its whole, straight and even grid (see
  ///         `straightened`)
  virtual void set_volume(const ConstVolumeView& volume, const Control& control = {}) = 0;

  /// Takes note that voxels of the volume that was set last have changed, within these regions of its grid and nowhere
  /// else. Tints stay.
  /// @throws InputError before a volume is set
  virtual void update_volume(std::span<const Region> changed, const Control& control = {}) = 0;

  /// Sets the style of the next pictures.
  /// @throws InputError for a style with a number out of its range
  virtual void set_style(const RenderStyle& style) = 0;

  /// Takes colours for the volume that was set last. Only Projection::composite shows them. The view is kept: call it
  /// again whenever its voxels have changed.
  /// @throws InputError for another grid, type or memory than that of the volume, or more than 256 colours
  virtual void set_tints(const Tints& tints) = 0;

  /// Makes a picture.
  /// @param plane    pixels and rays
  /// @param rgb      gets red, green and blue of each pixel, rows from the top: plane.width * plane.height * 3 bytes,
  ///         in host memory or in memory of its device
  /// @param control  stop and stream
  /// @throws InputError before a volume and a style are set, or for an array of another size
  /// @throws Cancelled
  virtual void render(const ViewPlane& plane, std::span<std::uint8_t> rgb, const Control& control = {}) = 0;

  /// The place in the volume that a pixel of a picture shows: where half of what its ray shows lies in front, or, for
  /// Projection::maximum, its largest value.
  /// @param plane    pixels and rays of the picture
  /// @param column   of the pixel, from 0 at the left  @param row  from 0 at the top
  /// @param control  stop and stream
  /// @return LPS mm; empty where nothing is seen
  /// @throws InputError before a volume and a style are set, or for a pixel outside the picture
  virtual std::optional<glm::dvec3> pick(const ViewPlane& plane, int column, int row, const Control& control = {}) = 0;
};

/// A renderer on the CPU. It refuses volumes in device memory.
std::unique_ptr<Renderer> make_cpu_renderer(Limits limits = {});

}  // namespace tetwarp
