// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/pictures/preview_layout.h"

#include <algorithm>
#include <cmath>

#include "io/pictures/text_raster.h"

namespace tetwarp {

namespace {

constexpr int kMostPanelWidth = 366, kMostPanelHeight = 368;
constexpr int kLeastCellWidth = 21 * kLetterWidth * kTextScale,
              kLeastCellHeight = 140;  // leaves room for captions and legends
constexpr int kLine = kLineHeight * kTextScale, kGutter = 9 * kTextScale, kMargin = 12;
constexpr int kHeader = 2 * kLine + 2 * kMargin;   // two lines: the title, and the size in voxels
constexpr int kAbove = 2 * kLine, kBelow = kLine;  // above a panel a caption and a letter, below it a letter
constexpr int kLegendWidth = 12 * kLetterWidth * kTextScale;

int pixels(double mm, double pixels_per_mm) { return std::max(1, static_cast<int>(std::lround(mm * pixels_per_mm))); }

}  // namespace

PreviewLayout layout_preview(const Geometry& geometry) {
  PreviewLayout layout;
  for (const AnatomicalPlane plane : {AnatomicalPlane::axial, AnatomicalPlane::coronal, AnatomicalPlane::sagittal}) {
    layout.slices[static_cast<std::size_t>(plane)] = middle_slice(geometry, plane);
  }
  layout.pixels_per_mm = INFINITY;
  for (const Slice& slice : layout.slices) {
    layout.pixels_per_mm = std::min(
        {layout.pixels_per_mm, kMostPanelWidth / slice.right.length_mm, kMostPanelHeight / slice.down.length_mm});
  }
  int cell_height = kLeastCellHeight;
  for (const Slice& slice : layout.slices) {
    cell_height = std::max(cell_height, pixels(slice.down.length_mm, layout.pixels_per_mm));
  }
  int x = kMargin;
  for (std::size_t column = 0; column < layout.slices.size(); ++column) {
    const Slice& slice = layout.slices[column];
    const int width = pixels(slice.right.length_mm, layout.pixels_per_mm),
              height = pixels(slice.down.length_mm, layout.pixels_per_mm);
    const int cell_width = std::max(width, kLeastCellWidth);
    int y = kHeader;
    for (auto& row : layout.panels) {
      row[column] = {x + kGutter + (cell_width - width) / 2, y + kAbove + (cell_height - height) / 2, width, height};
      y += kAbove + cell_height + kBelow;
    }
    x += cell_width + 2 * kGutter;
  }
  int y = kHeader + kAbove;
  for (Rectangle& legend : layout.legends) {
    legend = {x + kMargin, y, kLegendWidth, cell_height};
    y += kAbove + cell_height + kBelow;
  }
  layout.width = x + kMargin + kLegendWidth + kMargin;
  layout.footer_y = y - kAbove;
  layout.height = layout.footer_y + kLine + kMargin;
  return layout;
}

}  // namespace tetwarp
