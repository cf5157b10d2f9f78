// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to renderers.

#include <optional>
#include <span>
#include <vector>

#include "deform/core/region.h"
#include "deform/render/camera.h"

namespace tetwarp {

/// Which pixels of a picture have to be drawn again after parts of its volume have changed.
///
/// A pixel depends on the voxels around its ray alone. So a picture that was kept still holds where no ray comes near
/// what has changed. Pixels are counted by patches, rectangles from the upper left corner on.
class StalePatches {
 public:
  /// @param width, height  pixels of a patch
  StalePatches(int width, int height) : width_(width), height_(height) {}

  /// No picture holds any more. None need be kept until the volume changes in part.
  void forget();
  /// Takes note that voxels of these regions have changed.
  void change(const Geometry& volume, std::span<const Region> regions);
  /// Whether the next picture is worth keeping.
  bool is_worth_keeping() const { return volume_changes_; }

  /// The patches of a picture that have to be drawn into the one that was kept, rising: y * columns + x; empty: all.
  /// Nothing counts as kept from then on, until `keep`.
  std::optional<std::vector<int>> take(const ViewPlane& plane);
  /// The picture of this plane was drawn, and is kept.
  void keep(const ViewPlane& plane);

 private:
  int width_, height_;
  bool volume_changes_ = false;    ///< since `forget`
  std::optional<ViewPlane> kept_;  ///< the picture that is kept
  int columns_ = 0, rows_ = 0;     ///< of its patches
  /// How many changes each patch of it has met, as differences along both axes, so that a change is noted at the four
  /// corners of its patches. There is one column and one row more than patches.
  std::vector<int> changes_;
};

}  // namespace tetwarp
