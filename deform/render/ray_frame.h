// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to renderers: what all of them compute from volume, style and plane before rays are cast.

#include <vector>

#include "deform/core/ray_cast.h"
#include "deform/render/renderer.h"

namespace tetwarp {

/// What rays need to know of a volume and a plane. @param volume  straight or sheared, with even slices
RayFrame ray_frame(const Geometry& volume, const RenderStyle& style, const ViewPlane& plane);

/// Distance of two samples of a ray, mm.
double step_mm(const Geometry& volume, const RenderStyle& style, const ViewPlane& plane);

/// Checks a volume. @throws InputError for one that a renderer cannot take
void require_renderable(const ConstVolumeView& volume);
void require_valid(const RenderStyle& style);
void require_valid(const Tints& tints, const ConstVolumeView& volume);

/// Checks what a picture is made of. @throws InputError unless there are a volume and a style, and three bytes for each
/// pixel
void require_ready(const ConstVolumeView& volume, const RenderStyle& style, const ViewPlane& plane, std::size_t bytes);
/// @throws InputError unless there are a volume and a style, and the pixel lies in the picture
void require_pixel(const ConstVolumeView& volume, const RenderStyle& style, const ViewPlane& plane, int column,
                   int row);

/// The colours of tints as a table of 256 entries.
std::vector<TransferEntry> tint_table(const Tints& tints);

/// The table in which rays look up values: kTransferEntries entries from the first point's value to the last one's.
/// Each has a colour and a number. For Projection::sum this is density times step over `white`; for the others it is
/// the opacity of 1 mm, which only tells what can be seen at all.
std::vector<TransferEntry> transfer_table(const TransferFunction& transfer, double step_mm);

/// Values that have no opacity: those below all that have it, and those of the longest run of clear entries between.
/// @param table  see `transfer_table`
ClearValues clear_values(const std::vector<TransferEntry>& table, const RayFrame& frame);

/// Integrals of a transfer function for Projection::composite: for each entry the sum over all entries before it
/// (kTransferEntries + 1 sums), and the first and the last entry alone.
struct TransferIntegrals {
  std::vector<TransferIntegral> before;
  TransferIntegral lowest, highest;
};

/// The integrals of a table. The optical depth of an entry is -ln(1 - opacity) * step / 1 mm, so that a picture does
/// not depend on the step.
TransferIntegrals transfer_integrals(const std::vector<TransferEntry>& table, double step_mm);

}  // namespace tetwarp
