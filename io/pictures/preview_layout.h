// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>

#include "io/slice_picture.h"

namespace tetwarp {

/// A rectangle of a picture, in pixels.
struct Rectangle {
  int x = 0, y = 0, width = 0, height = 0;
};

/// Where things are on a preview. All panels have the same number of pixels a millimetre, along both sides.
struct PreviewLayout {
  static constexpr int kRows = 3, kColumns = 3;  ///< before, after, difference; axial, coronal, sagittal

  std::array<Slice, kColumns> slices;
  double pixels_per_mm = 1;
  int width = 0, height = 0;                                  ///< of the whole picture, at most 1400 each
  std::array<std::array<Rectangle, kColumns>, kRows> panels;  ///< [row][column]: the voxels alone, without captions
  std::array<Rectangle, kRows> legends;
  int footer_y = 0;
};

constexpr int kTextScale = 2;

PreviewLayout layout_preview(const Geometry& geometry);

}  // namespace tetwarp
