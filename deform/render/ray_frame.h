// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// What every renderer makes of its style before rays are cast.

#include <vector>

#include "deform/core/ray_cast.h"
#include "deform/render/renderer.h"

namespace tetwarp {

/// What rays need to know of a volume and a plane, @param volume  straight or sheared, evenly spaced
RayFrame ray_frame(const Geometry& volume, const RenderStyle& style, const ViewPlane& plane);

/// Millimetres between two samples of a ray.
double step_mm(const Geometry& volume, const RenderStyle& style, const ViewPlane& plane);

/// @throws InputError for what a renderer cannot take
void require_renderable(const ConstVolumeView& volume);
void require_valid(const RenderStyle& style);
void require_valid(const Tints& tints, const ConstVolumeView& volume);

/// @throws InputError unless there are a volume and a style, and three bytes for each pixel
void require_ready(const ConstVolumeView& volume, const RenderStyle& style, const ViewPlane& plane, std::size_t bytes);

/// 256 entries.
std::vector<TransferEntry> tint_table(const Tints& tints);

/// What rays look up, kTransferEntries entries from the first point's value to the last one's: colour, and of `sum` the
/// density times the step, over `white`; of composite, opacity only tells what can be seen at all.
std::vector<TransferEntry> transfer_table(const TransferFunction& transfer, double step_mm);

/// Sums over the entries before each, kTransferEntries + 1 of them, and those of the first and the last entry alone.
struct TransferIntegrals {
  std::vector<TransferIntegral> before;
  TransferIntegral lowest, highest;
};

/// The optical depth of an entry is
/// -ln(1 - opacity) * step / 1 mm, so that a picture does not depend on the step.
TransferIntegrals transfer_integrals(const std::vector<TransferEntry>& table, double step_mm);

}  // namespace tetwarp
