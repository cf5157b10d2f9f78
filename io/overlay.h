// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>
#include <vector>

#include "deform/volume.h"
#include "io/png.h"

namespace tetwarp {

/// What may lie over a picture of a deformed volume.
enum class OverlayKind : std::uint8_t {
  coverage,  ///< where no value came through the field: `Maps::coverage`, u8
  folds,     ///< where several places map to one: `Maps::owners`, u16
  jacobian,  ///< how much the volume grew or shrank: `Maps::jacobian`, f32
  lattice    ///< cells of the deformed lattice: `Maps::inverse_mm`, f32, 3 components
};

/// A colour, and how much of it is mixed to what lies below, 0 to 1.
struct Tint {
  Colour colour = {0, 0, 0};
  double share = 0;
};

/// Of a voxel of a map. @param kind  not lattice
Tint tint_of(OverlayKind kind, double value);

/// What the colours mean, for a legend: "Jacobian: blue 1/2, red 2".
std::string legend_of(OverlayKind kind);

/// The tints of an overlay as numbers of a byte, for volumes of them (Tints, deform/render/renderer.h).
class TintScale {
 public:
  /// @param kind  not lattice
  explicit TintScale(OverlayKind kind) : kind_(kind) {}

  /// 0 where there is no tint.
  std::uint8_t number(double value) const;
  /// Red, green, blue and share of each number, 0 to 1.
  std::vector<glm::vec4> colours() const;

 private:
  double value_of(int number) const;

  OverlayKind kind_;
};

Colour mixed(const Colour& below, const Tint& tint);

/// An overlay on the grid of a volume; the map holds at least what is shown of it.
struct Overlay {
  OverlayKind kind = OverlayKind::coverage;
  ConstVolumeView map;
  Geometry lattice = {};  ///< for OverlayKind::lattice: the grid of its undeformed vertices
};

}  // namespace tetwarp
