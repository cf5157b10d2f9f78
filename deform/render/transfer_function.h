// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <string>
#include <vector>

#include "deform/core/host_device.h"
#include "deform/render/projection.h"

namespace tetwarp {

/// What one value looks like. Values between two points are interpolated linearly.
struct TransferPoint {
  double value = 0;      ///< value of a voxel, HU in CT
  glm::dvec3 colour{1};  ///< red, green and blue as a screen shows them, 0 to 1
  /// For Projection::composite the opacity of a layer of 1 mm, 0 to 1; for Projection::sum the density that each mm
  /// adds.
  double opacity = 0;
};

/// How values of a volume become a picture. Values below the first point look like the first, values above the last
/// like the last.
struct TransferFunction {
  std::string name;                               ///< name that messages show
  Projection projection = Projection::composite;  ///< how the samples of a ray become a pixel
  std::vector<TransferPoint> points;              ///< at least two, with rising values
  double ambient = 0.3,  ///< for Projection::composite: part of the light that comes from everywhere
      diffuse = 0.65,    ///< part from the viewer's upper left, on both sides of surfaces
      specular = 0.15;   ///< part that surfaces mirror (Phong 1975, Blinn 1977)
  /// For Projection::composite: change of the value in a mm from which a place is lit as a surface.
  double gradient = 50;
  double white = 1;  ///< for Projection::sum: the integral that is shown white
};

/// Names of the transfer functions that come with Tetwarp: ct-bone, ct-skin, ct-lung, ct-vessel, mip, xray.
std::vector<std::string> transfer_function_names();
/// The transfer function of one of these names.
/// @throws InputError for another name
TransferFunction transfer_function(const std::string& name);

/// Checks a transfer function.
/// @throws InputError for fewer than two points, values that do not rise, or numbers out of their ranges
void require_valid(const TransferFunction& transfer);

}  // namespace tetwarp
