// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>
#include <string>

#include "io/overlay.h"
#include "io/preview_scale.h"
#include "io/slice_picture.h"
#include "io/view_picture.h"

namespace tetwarp {

/// A slice and what lies over it, the first overlay lowest; their maps hold the slice.
struct SlicePart {
  Slice slice;
  std::vector<Overlay> overlays;
};

/// How slices are shown side by side.
struct SliceViewOptions {
  Window window;
  int width = 512, height = 512;  ///< pixels that the picture may have at most
  ViewCaption caption;
  bool plain = false;  ///< the slices alone: no text, no letters, no bar
};

/// The slice nearest to a point. @throws InputError for a point outside the grid
Slice slice_through(const Geometry& geometry, AnatomicalPlane plane, const glm::dvec3& point);

/// The voxels of a slice.
Region region_of(const Geometry& geometry, const Slice& slice);

/// `choose_window` for the values of the three middle slices of a volume.
/// @throws InputError unless the view has one component and holds the whole grid
Window choose_window(const ConstVolumeView& volume);

/// Draws the cells of a lattice over a picture of one slice that it fills.
/// @param overlay  of OverlayKind::lattice; its map holds the slice
void draw_lattice(Picture& picture, const Geometry& grid, const Slice& slice, const Overlay& overlay);

/// Slices of one volume side by side, all at the same scale, in their proportions (mm), patient directions around them.
/// @param parts  all with overlays of the same kinds
/// @throws InputError for a picture that is too small for them
Picture draw_slices(const ConstVolumeView& volume, std::span<const SlicePart> parts, const SliceViewOptions& options);

}  // namespace tetwarp
